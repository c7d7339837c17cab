"""What declares, finds and runs behaviours. The samples are the other modules of ``elib.behaviours``."""
