"""What defines, finds and runs behaviours. The samples themselves are the other modules of the package."""
