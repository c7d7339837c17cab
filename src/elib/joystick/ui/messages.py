"""What a page sends is a stranger's: each value is taken out of it by its kind and its range."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from elib.errors import ArgumentError

SHOWN = 40
"""Characters of a wrong value that an error repeats."""


@dataclass(frozen=True, slots=True)
class Message:
    """The values that came with an event.

    Attributes:
        values: As they came.
    """

    values: object

    def _of(self, key: str) -> object:
        return self.values.get(key) if isinstance(self.values, dict) else None

    def number(self, key: str, low: float, high: float) -> float:
        """Return a number.

        Raises:
            ArgumentError: It is none, or out of its range.
        """
        value = self._of(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ArgumentError(f"{key} is {_shown(value)}; it must be a number")
        if not low <= value <= high:
            raise ArgumentError(f"{key} is {value:g}; it must be from {low:g} to {high:g}")
        return float(value)

    def whole(self, key: str, low: int, high: int) -> int:
        """Return a whole number.

        Raises:
            ArgumentError: It is none, or out of its range.
        """
        number = self.number(key, low, high)
        if not number.is_integer():
            raise ArgumentError(f"{key} is {number:g}; it must be a whole number")
        return int(number)

    def text(self, key: str, longest: int) -> str:
        """Return a text.

        Raises:
            ArgumentError: It is none, or too long.
        """
        value = self._of(key)
        if not isinstance(value, str):
            raise ArgumentError(f"{key} is {_shown(value)}; it must be a text")
        if len(value) > longest:
            raise ArgumentError(f"{key} has {len(value)} characters; at most {longest} are possible")
        return value

    def choice(self, key: str, among: Collection[str]) -> str:
        """Return one of some texts.

        Raises:
            ArgumentError: It is none of them.
        """
        value = self._of(key)
        if not isinstance(value, str) or value not in among:
            raise ArgumentError(f"{key} is {_shown(value)}; it must be one of {', '.join(among)}")
        return value

    def flag(self, key: str) -> bool:
        """Return yes or no; nothing is no.

        Raises:
            ArgumentError: It is something else.
        """
        value = self._of(key)
        if value is None:
            return False
        if not isinstance(value, bool):
            raise ArgumentError(f"{key} is {_shown(value)}; it must be true or false")
        return value

    def has(self, key: str) -> bool:
        """Return whether there is anything."""
        return self._of(key) is not None


def _shown(value: object) -> str:
    if isinstance(value, str | int | float | bool | None):
        text = repr(value[:SHOWN] if isinstance(value, str) else value)
        return text if len(text) <= SHOWN + 2 else f"{text[:SHOWN]}..."
    return f"a {type(value).__name__}"


__all__ = ["Message"]
