"""Doors to other tools, each a thin layer on the panel's robots: Foxglove, programs in other languages, agents."""
