"""Find words that this project does not use, in the code and the documents; ``make check`` runs it.

A name that the field knows is better than one that only we know, and a plain phrase better than an old-fashioned one.
The list holds names and phrases that came back; it does not replace reading.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
NAMES = {
    "blurt": "send_unqueued",
    "deaf": "busy",
    "deafness": "busy time",
    "farewell": "final_command",
    "last_words": "final_command",
    "Meter": "LinkStats",
    "onlooker": "client",
    "onlookers": "clients",
    "Overheard": "RecordingTransport",
    "Patience": "AdaptiveTimeout",
    "class Stage": "RunContext",
    "Stray": "UnexpectedReply",
    "weather": "link faults",
}
"""What to say instead of a name."""
PHRASES = {
    r"(?:an? |the )?line in doubt": "a line that is out of sync",
    r"has not got": "does not have",
    r"(?:it|that|this|which|who) (?:is|are|was) no (?!more\b|\w+er\b)\w+": "is not a",
    r"bears? (?:it|them|all)": "supports",
    r"befalls?": "happens to",
    r"whither": "where to",
    r"whosoever": "everybody who",
    r"take note (?:that|of|how)": "record, count",
    r"(?-i:It does)\.": "a full sentence",
    r"(?-i:It is none)\.": "a full sentence",
    r"errors as of": "Raises what ... raises",
    r"(?:is|take it|taken) amiss": "wrong",
    r"whoever": "who, everybody who",
    r"shall\b": "must, will",
    r"\w+: (?-i:Of) (?:its|their|all|the)\b": "a full sentence",
    r"there can be no\b": "cannot",
    r"anew": "again",
    r"nobody": "no program, no one",
}
"""What to say instead of a phrase, a regular expression."""
PLACES = ("src", "docs", "examples", "README.md", "CONTRIBUTING.md")
LEFT_OUT = (
    "docs/decisions/",
    "docs/check_words.py",
)
"""Decisions are history, as the changelog is."""


def complaints() -> list[str]:
    """Return ``file:line: what was found, and what to say instead`` for each place."""
    rules = [(re.compile(rf"\b{name}\b"), better) for name, better in NAMES.items()]
    rules += [(re.compile(rf"(?i)\b{phrase}"), better) for phrase, better in PHRASES.items()]
    found = []
    for path in sorted(each for place in PLACES for each in _files(ROOT / place)):
        name = path.relative_to(ROOT).as_posix()
        if name.startswith(LEFT_OUT):
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            line = re.sub(r"\S+\.md\b", "", line)  # decisions keep the names of their files
            found += [
                f'{name}:{number}: "{match[0]}"; say: {better}'
                for rule, better in rules
                if (match := rule.search(line))
            ]
    return found


def _files(place: Path) -> list[Path]:
    if place.is_file():
        return [place]
    return [path for path in place.rglob("*") if path.suffix in (".py", ".md", ".toml")]


if __name__ == "__main__":
    lines = complaints()
    print(*lines, sep="\n", end="\n" if lines else "")
    sys.exit(f"{len(lines)} places use words that this project avoids" if lines else 0)
