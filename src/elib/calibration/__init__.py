"""How closely the simulated robot matches a recorded one, and what makes it match better."""
