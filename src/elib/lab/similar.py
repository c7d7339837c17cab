"""Which submissions are much alike, compared by the shape of their programs.

A program is a row of tokens without comments, texts, numbers and layout; its own names are all the same token. So
renaming, reformatting and other numbers change nothing. What the lab's start.py has does not count.
"""

from __future__ import annotations

import builtins
import io
import keyword
import tokenize
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from itertools import combinations

import elib

RUN = 10
"""Tokens in a row that are compared: about one statement and a half. Shorter rows occur in every program."""
FEWEST = 50
"""Different rows of a program's own below which it is not compared: short programs for one task are alike."""
ALIKE = 0.8
"""Share of the shorter program's rows that the other one has too, from which two are named."""
COMMON = 0.5
"""Share of all submissions above which a row does not count: it belongs to the task. It needs ten submissions."""

SKIPPED = (tokenize.COMMENT, tokenize.NL, tokenize.ENCODING, tokenize.ENDMARKER)


def similar(programs: Mapping[str, str], start: str = "") -> list[tuple[str, str, float]]:
    """Return the pairs of programs that are much alike and the share that they have in common, the most alike first."""
    given = fingerprint(start)
    rows = {name: fingerprint(text) - given for name, text in programs.items()}
    if len(rows) >= 10:
        counts: dict[int, int] = {}
        for row in (row for own in rows.values() for row in own):
            counts[row] = counts.get(row, 0) + 1
        common = {row for row, count in counts.items() if count > COMMON * len(rows)}
        rows = {name: own - common for name, own in rows.items()}
    found = []
    for (first, ours), (second, theirs) in combinations(sorted(rows.items()), 2):
        shorter = min(len(ours), len(theirs))
        if shorter >= FEWEST and (share := len(ours & theirs) / shorter) >= ALIKE:
            found.append((first, second, share))
    return sorted(found, key=lambda pair: (-pair[2], pair[:2]))


def fingerprint(program: str) -> set[int]:
    """Return the rows of tokens of a program, as numbers."""
    words = list(_words(program))
    return {hash(tuple(words[place : place + RUN])) for place in range(len(words) - RUN + 1)}


def _words(program: str) -> Iterator[str]:
    """Yield what is compared, up to a place that is not Python."""
    previous = tokenize.NEWLINE
    try:
        for token in tokenize.generate_tokens(io.StringIO(program).readline):
            if token.type in SKIPPED:
                continue
            is_docstring = token.type == tokenize.STRING and previous in (
                tokenize.NEWLINE,
                tokenize.INDENT,
                tokenize.DEDENT,
            )
            previous = token.type
            if is_docstring:
                continue
            if token.type == tokenize.NAME:
                yield token.string if token.string in known() else "name"
            elif token.type in (tokenize.OP,):
                yield token.string
            else:
                yield tokenize.tok_name[token.type]
    except (tokenize.TokenError, SyntaxError):
        return


@cache
def known() -> frozenset[str]:
    """Return the names that a student cannot choose: those of Python and of elib."""
    names: Iterable[str] = (
        *keyword.kwlist,
        *dir(builtins),
        *dir(elib),
        *dir(elib.Epuck),
        *dir(elib.BlockingEpuck),
    )
    # BlockingEpuck has an attribute "robot", and nearly every student a variable of this name, which may be renamed.
    return frozenset(names) - {"robot"}
