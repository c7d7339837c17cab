"""Help pages: two aligned columns that read well in 80 of them, with and without colour."""

from __future__ import annotations

import re
import textwrap
from typing import TYPE_CHECKING

from elib.cli.terminal import WIDEST, table

if TYPE_CHECKING:
    from cyclopts.help import HelpEntry, HelpPanel
    from rich.console import Console, ConsoleOptions


class AlignedHelp:
    """Formats a page for cyclopts."""

    def __call__(self, console: Console, options: ConsoleOptions, panel: HelpPanel) -> None:
        """Write one list: of commands, arguments or options."""
        if panel.format == "command":
            rows = [(", ".join(entry.all_options), _headline(entry)) for entry in panel.entries]
        else:
            rows = [(" ".join(entry.display_labels_with_metavar), _text(entry)) for entry in panel.entries]
        if rows:
            title = {"Parameters": "Options"}.get(str(panel.title), str(panel.title))
            _write(console, f"{title}:\n{table(rows, width=_width(console))}\n")

    def render_usage(self, console: Console, options: ConsoleOptions, usage: object) -> None:
        """Write the first line."""
        text = getattr(usage, "plain", str(usage)).strip()
        if text:
            _write(console, f"Usage: {text}\n")

    def render_description(self, console: Console, options: ConsoleOptions, description: object) -> None:
        """Write what the command does."""
        text = _plain(description, console)
        paragraphs = [" ".join(part.split()) for part in re.split(r"\n\s*\n", text) if part.strip()]
        if paragraphs:
            _write(console, "\n\n".join(textwrap.fill(part, _width(console)) for part in paragraphs) + "\n")


def _headline(entry: HelpEntry) -> str:
    """Return the first clause: a list of forty commands should fit a screen; each has its own page."""
    usual = {"--help": "Show this page", "--version": "Show the version"}
    text = usual.get(entry.all_options[0]) or " ".join(_plain(entry.description).split())
    return re.split(r"[.;:](?:\s|$)", text, maxsplit=1)[0]


def _text(entry: HelpEntry) -> str:
    text = " ".join(_plain(entry.description).split())
    if entry.default is not None and entry.default not in ("False", "None"):
        text += f" (default: {entry.default})"
    return text


def _plain(text: object, console: Console | None = None) -> str:
    plain = getattr(text, "plain", None)
    if isinstance(plain, str):
        return plain
    if text is None or isinstance(text, str):
        return text or ""
    from rich.console import Console as RichConsole

    wide = RichConsole(width=10_000, color_system=None, force_terminal=False)
    with wide.capture() as capture:
        wide.print(text, markup=False, highlight=False)
    return capture.get()


def _width(console: Console) -> int:
    return min(console.width, WIDEST)


def _write(console: Console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)
