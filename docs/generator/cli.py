"""The page of the command line, from its own help."""

from __future__ import annotations

import contextlib
import io
import os
from unittest import mock

from elib.behaviours import Behaviour, behaviours
from elib.cli import main
from elib.cli.program import APPS, COMMANDS, build
from elib.cli.terminal import typed
from elib.link.protocol.profiles import rule
from generator.markdown import inline, joined, table

INTRODUCTION = """# Command line

The result of a command goes to stdout, everything else to stderr. Exit codes: 0 done; 1 a robot, its link or its world
failed or is not there, or what was checked is not in order; 2 wrong usage; 130 after Ctrl-C; 143 after SIGTERM.
`elib simulate`, `joystick`, `serve`, `foxglove` and `agent` end with 0 on both signals, which are their usual end.
`--robot URL` takes any of the [URLs](urls.md).

Every command of the robot is a sub-command of `elib send`: [Commands](commands.md) describes them, and
`elib send COMMAND --help` does too.
"""

BEHAVIOURS = """## elib run BEHAVIOUR

All behaviours have the options below, except for `--cruise`, which is an option of `avoid` alone.
"""
SAMPLE = ["run", "avoid"]


def page() -> str:
    """Return the page."""
    parts = [INTRODUCTION]
    for name in COMMANDS:
        parts.append(help_entry([name]))
        if name == "run":
            parts += [help_entry(["run", "all"]), f"{BEHAVIOURS}\n{help_block(SAMPLE)}"]
            parts += [behaviour_entry(each) for each in behaviours().values()]
        elif name in APPS and name != "send":  # its sub-commands are on a page of their own
            parts += [help_entry([name, part]) for part in build([name])[name] if not part.startswith("-")]
    parts.insert(1, help_entry([]))
    return joined(parts)


def behaviour_entry(behaviour: Behaviour) -> str:
    """Return the text of a behaviour and its own options."""
    paragraphs = [inline(part) for part in behaviour.doc.split("\n\n")]
    if behaviour.world:
        paragraphs.append(f"Without `--robot` it runs in `{behaviour.url}`.")
    if behaviour.options:
        options = [
            (f"`--{each.name}`", behaviour.meanings[each.name], rule(each.quantity), typed(each.default))
            for each in behaviour.options
        ]
        paragraphs.append(table(("Option", "Meaning", "Value", "Default"), options))
    return "\n\n".join([f"### {behaviour.name}", *paragraphs])


def help_entry(words: list[str]) -> str:
    """Return a section with the help page of a command."""
    return f"## {' '.join(['elib', *words])}\n\n{help_block(words)}"


def help_block(words: list[str]) -> str:
    """Return what ``--help`` prints, 80 columns wide and without colour.

    Raises:
        RuntimeError: The command failed.
    """
    stream = io.StringIO()
    plain = {"COLUMNS": "80", "NO_COLOR": "1", "TERM": "dumb", "FORCE_COLOR": ""}
    with mock.patch.dict(os.environ, plain), contextlib.redirect_stdout(stream):
        if main([*words, "--help"]) != 0:
            raise RuntimeError(f"elib {' '.join(words)} --help failed")
    lines = [line.rstrip() for line in stream.getvalue().strip().splitlines()]
    return "\n".join(["```text", *lines, "```"])
