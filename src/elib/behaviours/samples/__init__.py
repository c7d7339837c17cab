"""Programs to start from: ``elib new`` copies them."""
