"""Make text from robots, files, logs and Bluetooth devices safe to show on a terminal."""

from __future__ import annotations

import re

_UNSAFE = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")
"""Control characters but tabs and ends of lines, and those that turn the direction of text."""


def plain(text: str) -> str:
    r"""Return *text* with its control characters as escapes such as ``\x1b``: a terminal does not obey them."""
    return _UNSAFE.sub(lambda match: match[0].encode("unicode_escape").decode("ascii"), text)


__all__ = ["plain"]
