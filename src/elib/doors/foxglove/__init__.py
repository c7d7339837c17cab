"""The door to Foxglove: robots as live topics, parameters, and topics by which a client drives."""
