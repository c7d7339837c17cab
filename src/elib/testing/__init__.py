"""Helpers for tests of programs that drive e-pucks."""

from elib.testing.bench import Bench

__all__ = ["Bench"]
