"""Helpers for tests of programs that drive e-pucks."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from elib.testing.emulated import EmulatedRobot
    from elib.testing.faults import fault_scripts, faults_of, with_faults
    from elib.testing.inside import emulator_of, link_of, simulation_of, world_of
    from elib.testing.simulated_time import simulated
    from elib.testing.transports import check_transport

_HOMES = {
    "EmulatedRobot": "emulated",
    "check_transport": "transports",
    "emulator_of": "inside",
    "fault_scripts": "faults",
    "faults_of": "faults",
    "link_of": "inside",
    "simulated": "simulated_time",
    "simulation_of": "inside",
    "with_faults": "faults",
    "world_of": "inside",
}


def __getattr__(name: str) -> object:
    """Import a helper when it is asked for: pytest loads this package in every run, also where no test uses elib."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


__all__ = [
    "EmulatedRobot",
    "check_transport",
    "emulator_of",
    "fault_scripts",
    "faults_of",
    "link_of",
    "simulated",
    "simulation_of",
    "with_faults",
    "world_of",
]
