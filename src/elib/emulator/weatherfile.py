"""Fault scripts as TOML files: those that come with elib, and the rules for your own.

::

    description = "Bluetooth on a bad day"
    seed = 1                       # of everything left to chance

    [[fault]]
    kind = "loss"                  # a key of KINDS in elib.emulator.weather
    probability = 0.02             # what the kind takes

    [[fault]]
    kind = "delay"
    from = 10                      # s; 0 if left out
    until = 30                     # s; for ever if left out
    delay = [0.0, 0.4]             # rises from one to the other, from 10 s until 30 s

    [[fault]]
    kind = "stall"
    from = 5
    every = 20                     # again at 25 s, 45 s, ...
    for = 0.5                      # s each time

    [[fault]]
    kind = "reset"
    at = 12                        # once; with for, or until, where the kind has a length

Times are seconds of robot time since the first byte that a program sent to the robot.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from importlib.resources import files

from elib.emulator.weather import KINDS, FaultScript, Ramp, TimedFault, When, meant
from elib.errors import ArgumentError, SimulationError
from elib.files import read_file
from elib.physics.keys import shown
from elib.physics.tomltext import LARGEST_FILE, read

TIMES = ("at", "from", "until", "every", "for")
"""The keys of a fault that say when it holds."""

LARGEST = 1e12
"""No number of a script comes near it."""


def gallery() -> list[str]:
    """Return the names of the scripts that come with elib, in alphabetical order."""
    return sorted(
        entry.name.removesuffix(".toml")
        for entry in files("elib").joinpath("weather").iterdir()
        if entry.name.endswith(".toml")
    )


def load(name: str) -> FaultScript:
    """Read a script that comes with elib, or a file where *name* is a path or ends in ``.toml``.

    Raises:
        ArgumentError: There is no such script, or the file cannot be read.
        SimulationError: The file breaks a rule; the message names the file, the key and a cure.
    """
    if name.endswith(".toml") or "/" in name or os.sep in name:
        return parse(read_file(name, "the fault script", largest=LARGEST_FILE), name)
    names = gallery()
    if name not in names:
        raise ArgumentError(
            f"there is no fault script {name!r}", hint=f"{meant(name, names)}; the name of a file ends in .toml"
        )
    return parse(files("elib").joinpath("weather", f"{name}.toml").read_bytes(), name)


def parse(content: bytes, name: str) -> FaultScript:
    """Return the script that *content* describes.

    Args:
        content: TOML in UTF-8.
        name: Of the script; messages begin with it.

    Raises:
        SimulationError: It is no TOML, or a key is missing, unknown, of the wrong type or out of its range.
    """
    _, document = read(content, name)
    where = name
    try:
        _refuse_unknown(document, ["description", "seed", "fault"])
        description = document.get("description")
        if not isinstance(description, str):
            raise _wrong("description", description, "a text", 'write description = "..."')
        seed = document.get("seed", 0)
        if isinstance(seed, bool) or not isinstance(seed, int):
            raise _wrong("seed", seed, "a whole number", "write seed = 1")
        tables = document.get("fault", [])
        if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
            raise ArgumentError("fault must be an array of tables", hint="write [[fault]] above each of them")
        faults = []
        for index, table in enumerate(tables):
            where = f"{name}: fault[{index}]"
            faults.append(_fault(table))
        where = name
        return FaultScript(name, description, seed, tuple(faults))
    except ArgumentError as error:
        raise SimulationError(f"{where}: {error.message}", hint=error.hint) from error


def _fault(table: Mapping[str, object]) -> TimedFault:
    kind = table.get("kind")
    if not isinstance(kind, str):
        raise _wrong("kind", kind, "a text", f'write kind = "{next(iter(KINDS))}"')
    if kind in KINDS:
        _refuse_unknown(table, ["kind", *TIMES, *(key.name for key in KINDS[kind].keys)])
    strengths = {key: _ramp(key, value) for key, value in table.items() if key not in ("kind", *TIMES)}
    return TimedFault(kind, _when(table), strengths)


def _when(table: Mapping[str, object]) -> When:
    times = {key: _number(key, table[key]) for key in TIMES if key in table}
    if "at" in times and ("from" in times or "every" in times):
        raise ArgumentError("at is for what happens once", hint="write from and every, or at alone")
    if "for" in times and "until" in times and "every" not in times:
        raise ArgumentError("for and until both say when it ends", hint="leave one of them out")
    return When(
        times.get("at", times.get("from", 0.0)), times.get("until", math.inf), times.get("every"), times.get("for")
    )


def _ramp(key: str, value: object) -> Ramp:
    if isinstance(value, list):
        if len(value) != 2:
            raise _wrong(key, value, "a number, or two", f"write {key} = [0.0, 0.5]")
        return Ramp(_number(key, value[0]), _number(key, value[1]))
    number = _number(key, value)
    return Ramp(number, number)


def _number(key: str, value: object) -> float:
    # A whole number of TOML has no bound, so it is compared before it becomes a float.
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise _wrong(key, value, "a number", f"write for example {key} = 0.5")
    return float(value)


def _wrong(key: str, value: object, kind: str, cure: str) -> ArgumentError:
    if value is None:
        return ArgumentError(f"{key} is missing; it must be {kind}", hint=cure)
    return ArgumentError(f"{key} is {shown(value)}; it must be {kind}", hint=cure)


def _refuse_unknown(table: Mapping[str, object], known: list[str]) -> None:
    for key in table:
        if key not in known:
            raise ArgumentError(f"{key} = {shown(table[key])}: there is no such key here", hint=meant(key, known))
