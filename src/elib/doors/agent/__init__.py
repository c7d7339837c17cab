"""``elib agent``: a Model Context Protocol server through which an agent drives robots within limits."""
