"""The pages of the panel: NiceGUI for what stands still, parts of our own in ``js`` for what moves."""
