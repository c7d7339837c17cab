"""``elib serve``: robots for programs in any language, by JSON messages over a WebSocket."""
