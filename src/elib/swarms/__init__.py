"""Several robots as one: opened together, told the same in sequence or in parallel, stopped together."""
