"""The page of fault scripts, from the tables that check them."""

from __future__ import annotations

import inspect
import math
from importlib.resources import files

from elib.base.files import FAULTS
from elib.base.plaintext import summary
from elib.base.tables import Key
from elib.simulator.emulator import faultscript
from elib.simulator.emulator.faultkinds import KINDS, Counts, Kind, Strength, When
from elib.testing import faults as testing
from elib.testing import plugin
from generator.markdown import block, docstring, field_table, joined, section, table

INTRODUCTION = """# Fault scripts

A fault script says what goes wrong with virtual robots and their links, when, and how badly. It is a TOML file;
`fault=` in a [`sim://` URL](urls.md#sim) and `elib simulate --fault` take its path, or the name of one that comes with
elib. [Link faults](../guides/link-faults.md) shows how they are used.
"""
CODE = "a key of KINDS"
"""Words of the docstring that the page replaces."""
TOP = (
    ("`description`", "text", "a sentence for people; it must be there"),
    (
        "`seed`",
        "a whole number, 0 to 2\\*\\*64 - 1",
        "of all random numbers; 0 if left out. A seed in the URL replaces it",
    ),
    ("`[[fault]]`", "array of tables", "the faults; one answer may have several"),
)
TIMES = {
    "at": ("start", "once, then. With `for` or `until` where the kind has a length"),
    "from": ("start", "its beginning; 0 if left out"),
    "until": ("until", "its end; none if left out"),
    "every": ("every", "from one beginning to the next; needs `for` where the kind has a length"),
    "for": ("lasting", "how long it holds each time"),
}


def page() -> str:
    """Return the page."""
    parts = [INTRODUCTION, file(), times(), kinds(), shipped(), tests()]
    return joined(parts)


def file() -> str:
    """Return an example and the keys at the top of a file."""
    shown = block(faultscript.__doc__).replace(CODE, "one of the kinds below")
    rule = inspect.cleandoc(faultscript.__doc__ or "").partition("\n\nTimes are")[2]
    return (
        f"## The file\n\n```toml\n{shown}\n```\n\n{table(('Key', 'Type', 'What it is'), TOP)}\n\nTimes are{rule}\n\n"
        "What breaks a rule is refused before anything runs, with the file, the line, the key and what to try."
    )


def times() -> str:
    """Return the keys that say when a fault holds.

    Raises:
        KeyError: The code has a key of time that is not described.
    """
    told = section(When.__doc__, "Attributes")
    assert all(field in told for field, _ in TIMES.values())
    rows = [(f"`{key.name}`", TIMES[key.name][1]) for key in faultscript.TIMES]
    told = "Every fault takes these, in seconds, and `robots`: which robots of a world have it"
    told += f" ({faultscript.ROBOTS.rule}); all if it is left out."
    return f"## When, and which robots\n\n{told}\n\n" + table(("Key", "What it says"), rows)


def kinds() -> str:
    """Return an entry for each kind of fault."""
    parts = [
        "## Kinds\n\nA number that may change can be two, `[first, last]`: it goes from one to the other meanwhile."
    ]
    for name, kind in KINDS.items():
        parts.append(f"### {name}\n\n{' '.join([summary(kind), *rules(kind)])}")
        if kind.keys:
            head = ("Key", "What it sets", "Unit", "Range", "Default", "May change")
            parts.append(table(head, [*map(name_row, kind.names), *map(row, kind.keys)]))
    return "\n\n".join(parts)


def rules(kind: type[Kind]) -> list[str]:
    """Return what is special about a kind's times."""
    found = []
    if kind.is_instant:
        found.append("It has no length.")
    if kind.needs_end:
        found.append("It needs an end.")
    if not kind.may_repeat:
        found.append("It comes once.")
    return found


def row(key: Strength) -> tuple[str, ...]:
    """Return a key's line."""
    default = "must be given" if key.default is None else usual(key)
    unit, may_change = key.unit or "-", "yes" if key.may_change else "no"
    return f"`{key.name}`", key.meaning, unit, f"{key.low:g} to {key.high:g}", default, may_change


def usual(key: Strength) -> str:
    """Return the default of a key."""
    return "none" if math.isnan(key.default or 0.0) else f"{key.default:g}"


def name_row(key: Key) -> tuple[str, ...]:
    """Return the line of a key that says what a fault hits."""
    default = "must be given" if key.is_needed else key.default
    return f"`{key.name}`", f"what it hits: {key.rule}", "-", "-", default, "no"


def overview() -> str:
    """Return the table of kinds for the guide."""
    rows = []
    for name, kind in KINDS.items():
        keys = [f"`{key.name}`" + ("" if key.is_needed else f" ({key.default})") for key in kind.names]
        keys += [f"`{key.name}`" + (f" ({usual(key)})" if key.default is not None else "") for key in kind.keys]
        rows.append(
            (f"[`{name}`](../reference/faults.md#{name})", " ".join([summary(kind), *rules(kind)]), ", ".join(keys))
        )
    return table(("Kind", "What happens", "Its keys (default)"), rows)


def gallery() -> str:
    """Return the table of shipped scripts for the guide."""
    rows = ((linked(name), f"{faultscript.load(name).description}.") for name in faultscript.gallery())
    return table(("Script", "What it is like"), rows)


def linked(name: str) -> str:
    """Return a name that leads from a guide to its entry here."""
    return f"[`{name}`](../reference/faults.md#{name})"


def shipped() -> str:
    """Return the scripts that come with elib, as they are."""
    parts = ["## Scripts that come with elib"]
    for name in faultscript.gallery():
        text = files("elib").joinpath(FAULTS, f"{name}.toml").read_text(encoding="utf-8")
        parts.append(f"### {name}\n\n```toml\n{text.strip()}\n```")
    return "\n\n".join(parts)


def tests() -> str:
    """Return what a program's own tests use."""
    parts = ["## For tests: elib.testing"]
    for what in (testing.fault_scripts, testing.with_faults, testing.faults_of):
        names = ", ".join(str(item).partition(":")[0] for item in inspect.signature(what).parameters.values())
        parts.append(f"### {what.__name__}\n\n```text\n{what.__name__}({names})\n```\n\n{docstring(what.__doc__)}")
    parts.append(f"### Counts\n\n{summary(Counts)}\n\n{field_table(section(Counts.__doc__, 'Attributes'))}")
    fixture = inspect.cleandoc(inspect.getsource(plugin.elib_link_faults)).partition('"""')[2].partition('"""')[0]
    parts.append(f"### The fixture elib_link_faults\n\n{docstring(fixture)}")
    return "\n\n".join(parts)
