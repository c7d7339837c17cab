"""The table of all programs of the cookbook, made from its pages."""

from __future__ import annotations

import re
from pathlib import Path

from generator.markdown import table

FOLDER = Path(__file__).parents[1] / "cookbook"
PAGES = (
    "move",
    "sense",
    "light-and-sound",
    "camera",
    "behaviours",
    "several-robots",
    "link-and-failures",
    "simulate-and-worlds",
    "record-and-replay",
    "logs-and-data",
    "tests",
    "notebooks",
)
"""The themes in their order on the page."""


def programs() -> str:
    """Return a table for each page: what a program is called, and what it does."""
    return "\n\n".join(_theme(f"{page}.md") for page in PAGES)


def _theme(page: str) -> str:
    text = (FOLDER / page).read_text(encoding="utf-8")
    title = text.removeprefix("# ").partition("\n")[0]
    rows = []
    for name, sentence in re.findall(r"^## (.+)\n\n((?:[^`\n].*\n|`[^`].*\n)+)", text, re.MULTILINE):
        anchor = re.sub(r"[^\w\- ]", "", name.lower()).replace(" ", "-")
        rows.append((f"[{name}]({page}#{anchor})", " ".join(sentence.split())))
    return f"## {title}\n\n{table(('Program', 'What it does'), rows)}"
