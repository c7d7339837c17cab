"""One robot: its API styles, motion, telemetry, events and reconnecting, and what stops it in an emergency."""
