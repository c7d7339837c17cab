"""The tasks that come with elib, one file each: a module here with a ``TASK`` is found by itself."""
