"""Several robots in one program: opened together, commanded in parallel or in sequence, stopped together."""
