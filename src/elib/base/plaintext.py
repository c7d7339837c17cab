"""Make text from robots, files, logs and Bluetooth devices safe to show on a terminal, and in a notebook."""

from __future__ import annotations

import html
import inspect
import re
import textwrap
from collections.abc import Iterable, Sequence

_UNSAFE = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")
"""Control characters but tabs and ends of lines, and those that turn the direction of text."""


def plain(text: str) -> str:
    r"""Return *text* with its control characters as escapes such as ``\x1b``: a terminal does not obey them."""
    return _UNSAFE.sub(lambda match: match[0].encode("unicode_escape").decode("ascii"), text)


def two_columns(rows: Sequence[tuple[str, str]], width: int, *, indent: int = 2, widest: int | None = None) -> str:
    """Return two aligned columns, of which the second is wrapped.

    A label that is longer than *widest*, half the width by default, gets a line of its own: one long word should not
    push all texts to the edge.
    """
    most = width // 2 if widest is None else widest
    longest = max((len(label) for label, _ in rows if len(label) <= most), default=0)
    margin = " " * (indent + longest + 2)
    lines: list[str] = []
    for label, text in rows:
        first = f"{' ' * indent}{label}"
        if len(label) > longest:
            lines.append(first)
            first = ""
        # A path or a URL stays whole, so that it can be copied.
        wrapped = textwrap.wrap(text, width - len(margin), break_on_hyphens=False, break_long_words=False) or [""]
        lines.append(f"{first:<{len(margin)}}{wrapped[0]}".rstrip())
        lines.extend(margin + line for line in wrapped[1:])
    return "\n".join(lines)


def counted(number: int, what: str) -> str:
    """Return a number of things: ``1 box``, ``2 boxes``."""
    return f"{number} {what}" + ("" if number == 1 else "es" if what.endswith(("x", "ch")) else "s")


def summary(kind: type) -> str:
    """Return the first line of the docstring of *kind* for people who do not read Python, without its references."""
    first = (inspect.getdoc(kind) or "").partition("\n")[0]
    return re.sub(r"; see .*|:(\w+):`~?\.?(\w+)`", lambda match: match[2] or "", first).strip()


class Html(str):
    """Text that is HTML already."""

    __slots__ = ()


def html_table(rows: Iterable[Sequence[str]], title: str = "") -> str:
    """Return a table for a notebook, whose rows begin with their labels.

    Args:
        rows: The rows, as text or :class:`Html`.
        title: Words above the table.
    """
    lines = [f"<caption style='text-align:left;white-space:nowrap'>{html.escape(title)}</caption>"] if title else []
    for label, *cells in rows:
        texts = [cell if isinstance(cell, Html) else html.escape(cell) for cell in cells]
        shown = "".join(f"<td style='text-align:left'>{text}</td>" for text in texts)
        lines.append(f"<tr><th style='text-align:left'>{html.escape(label)}</th>{shown}</tr>")
    return f"<table>{''.join(lines)}</table>"


def html_bar(share: float) -> Html:
    """Return a bar for a cell of :func:`html_table`, full for 1 and empty for 0."""
    width = round(120 * min(max(share, 0.0), 1.0))
    return Html(f"<div style='width:{width}px;height:0.8em;background:#3d7ebf'></div>")
