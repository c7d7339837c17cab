"""What a robot perceives of the world: one law a module, computed only when read."""
