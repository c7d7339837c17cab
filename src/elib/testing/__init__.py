"""Helpers for tests of programs that drive e-pucks."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from elib.testing.bench import Bench


def __getattr__(name: str) -> object:
    """Import the emulator when it is asked for: pytest loads this package in every run, whatever it tests."""
    if name == "Bench":
        from elib.testing.bench import Bench

        return Bench
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = ["Bench"]
