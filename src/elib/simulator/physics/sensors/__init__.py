"""What a robot perceives of the world: one law a module, computed only when read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from importlib import import_module

from elib.base.errors import ArgumentError
from elib.simulator.physics.engine import kernel, phase
from elib.simulator.physics.records import SENSORS, Records


def chosen(sensors: Iterable[str]) -> int:
    """Return a number that says which sensors are to be read: a bit for each, in the order of ``SENSORS``.

    Raises:
        ArgumentError: There is no such sensor.
    """
    found = 0
    for name in sensors:
        if name not in SENSORS:
            raise ArgumentError(f"there is no sensor {name!r}", hint=f"choose from {', '.join(SENSORS)}")
        found |= 1 << SENSORS.index(name)
    return found


def _reading(names: Sequence[str]) -> Callable[[Records, int, int], None]:
    """Return a function that lets a robot read its sensors: those of *names* whose bits are set."""
    # Each is compiled by itself: its call passes all records of a world, and a call of all others would once more.
    read = phase(import_module(f"{__name__}.{names[0]}").read)
    others = kernel(_reading(names[1:])) if len(names) > 1 else no_more

    def sense(world: Records, i: int, sensors: int) -> None:
        if sensors & 1:
            read(world, i)
        if sensors > 1:
            others(world, i, sensors >> 1)

    return sense


@kernel
def no_more(world: Records, i: int, sensors: int) -> None:
    """There is no further sensor."""


sense = kernel(_reading(SENSORS))
"""Let robot *i* read its sensors: ``sense(world, i, chosen(["proximity"]))``."""
