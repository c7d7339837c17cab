"""A robot that answers: its firmware, byte for byte, on hardware that is fixed or simulated."""
