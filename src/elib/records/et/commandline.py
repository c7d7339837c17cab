"""The command line of et: options anywhere, an action and its arguments, and the help."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from inspect import getdoc
from typing import Annotated

from elib.base.errors import ArgumentError
from elib.base.plaintext import two_columns
from elib.base.rules import REQUIRED, Choice, nearest
from elib.records.et.action import Action, Plotted
from elib.records.et.actions import actions
from elib.records.et.arguments import FileName, Parameter, arguments_of, usage, values_of
from elib.records.et.formats import FORMATS

WIDTH = 80

ABOUT = """Elib Tools: read the log of a robot's calls, and copy, count or describe its rows.

A log has six columns with one space between, counted from 0: time (s), robot, call or ok or ko, command, calls not yet
sent, calls not yet answered. Rows that begin with # are comments; they and empty lines are skipped."""

SAMPLE = """\
    # elib log 1, names: python
    812.10250000 Ada call proximity 0 0
    812.11310000 Ada call ambient_light 0 1
    812.15120000 Ada ok proximity 0 1
    #start of second round
    812.19840000 Ada ok ambient_light 0 0"""

EXAMPLES = (
    ("et Latency -s run.log", "how long each command took"),
    ("et -s run.log FromTo time 60 120 | et Avg 5", "the mean queue in the second minute"),
    ("et Join -s run.log -d calls.csv", "calls with their latencies, for a spreadsheet"),
)

LONG = {"--source": "-s", "--destination": "-d", "--help": "-h"}


@dataclass(frozen=True, slots=True)
class Help:
    """A request for help: about *action*, or about all actions if it is None."""

    action: type[Action] | None


@dataclass(frozen=True, slots=True)
class Request:
    """The request that a command line makes."""

    action: Action  # the action, with its arguments
    # path of the log, or None for standard input
    source: Annotated[
        str | None, Parameter("-s SOURCE", FileName(), "The log; standard input by default, or if it is -.")
    ] = None
    # path of the output, or None for standard output
    destination: Annotated[
        str | None, Parameter("-d DEST", FileName(), "Where results go; standard output by default, or if it is -.")
    ] = None
    # name of the output's format, if it was given
    format: Annotated[
        str | None,
        Parameter(
            "--format FORMAT",
            Choice(FORMATS),
            "text, csv, json, jsonl or parquet; by default the ending of DEST says it.",
        ),
    ] = None
    # path of the picture, if one is wanted
    plot: Annotated[
        str | None, Parameter("--plot FILE", FileName(), "Also draw the results: a .png, .svg or .pdf.")
    ] = None


def parse(tokens: Sequence[str]) -> Request | Help:
    """Parse a command line; of an option that is repeated the last one holds."""
    words, options = _split(tokens)
    kind = _action(words[0]) if words else None
    if "-h" in options or not tokens:
        return Help(kind)
    if kind is None:
        raise ArgumentError("et needs an action", hint=f"one of {', '.join(actions())}; et --help explains them")
    known = [each.option for each in (*arguments_of(kind), *arguments_of(Request)) if each.option]
    for option in options:
        if option not in known:
            near = nearest(option, known)
            hint = near if near.startswith("did") else f"{near}; words that begin with - go after --"
            raise ArgumentError(f"{kind.__name__} has no option {option!r}", hint=hint)
    action = kind(**values_of(kind, options, words[1:], name=kind.__name__))
    return Request(action, **values_of(Request, options))


def _split(tokens: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Return words and options; every option but help has a value."""
    words: list[str] = []
    options: dict[str, str] = {}
    rest = iter(tokens)
    for token in rest:
        name, equals, value = token.partition("=") if token.startswith("--") else (token, "", "")
        name = LONG.get(name, name)
        if token == "--":
            words += rest
        elif token == "-" or not token.startswith("-") or re.match(r"-\.?[0-9]", token):
            words.append(token)
        elif name == "-h":
            options[name] = ""
        elif equals:
            options[name] = value
        else:
            given = next(rest, None)
            if given is None:
                raise ArgumentError(f"{name} needs a value", hint="et --help explains it")
            options[name] = given
    return words, options


def _action(word: str) -> type[Action]:
    found = actions()
    kind = {name.lower(): kind for name, kind in found.items()}.get(word.lower())
    if kind is None:
        raise ArgumentError(f"et has no action {word!r}", hint=nearest(word, found))
    return kind


def summary(kind: type[Action]) -> str:
    """Return the first line of an action's docstring."""
    return (getdoc(kind) or "").partition("\n")[0]


def page(kind: type[Action] | None, program: str = "et") -> str:
    """Return the help about an action, or about all if *kind* is None."""
    options = _rows(Request)
    if kind is not None:
        parts = [f"Usage: {program} {usage(kind)}", _filled(getdoc(kind) or "")]
        if given := _rows(kind):
            parts.append("Arguments:\n" + _table(given))
        if not issubclass(kind, Plotted):
            options = [row for row in options if not row[0].startswith("--plot")]
        return "\n\n".join([*parts, "Other options, anywhere:\n" + _table(options)])
    found = actions().values()
    parts = [
        f"Usage: {program} [OPTIONS] ACTION [ARGUMENTS]",
        _filled(ABOUT),
        SAMPLE,
        "Actions:\n" + _table([(usage(kind), summary(kind)) for kind in found]),
        "Options, anywhere:\n" + _table([*options, ("-h", "This page; after an action, the page of the action.")]),
        "Plots: " + ", ".join(kind.__name__ for kind in found if issubclass(kind, Plotted)) + ".",
        "Examples:\n" + _table(EXAMPLES),
    ]
    return "\n\n".join(parts)


def _filled(text: str) -> str:
    return "\n\n".join(textwrap.fill(" ".join(part.split()), WIDTH) for part in text.split("\n\n"))


def _rows(kind: type) -> list[tuple[str, str]]:
    return [(argument.label, argument.help + _default(argument.default)) for argument in arguments_of(kind)]


def _default(value: object) -> str:
    if value is REQUIRED or value is None or value == ():
        return ""
    shown = ",".join(f"{each:g}" for each in value) if isinstance(value, tuple) else value
    return f" (default: {shown})"


def _table(rows: Sequence[tuple[str, str]]) -> str:
    return two_columns(rows, WIDTH, widest=28)
