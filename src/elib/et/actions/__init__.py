"""The actions of et: each class in a file here is one."""
