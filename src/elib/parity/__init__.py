"""How much a simulated robot is like a recorded one, and what makes it more so."""
