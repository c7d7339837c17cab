"""Drive an e-puck robot, real or virtual, from Python."""
