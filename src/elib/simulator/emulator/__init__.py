"""Virtual robots: their firmware, byte for byte, on fixed or simulated hardware; their links, and faults of these."""
