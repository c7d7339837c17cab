"""Helpers for tests of programs that drive e-pucks: virtual robots, simulated time, faults of the link.

It stands on ``robot`` and ``simulator``. Begin with ``simulated_time.py`` and ``faults.py``; ``plugin.py`` gives them
to pytest as fixtures.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from elib.testing.emulated import EmulatedRobot as EmulatedRobot
    from elib.testing.faults import fault_scripts as fault_scripts
    from elib.testing.faults import faults_of as faults_of
    from elib.testing.faults import with_faults as with_faults
    from elib.testing.inside import emulator_of as emulator_of
    from elib.testing.inside import hardware_of as hardware_of
    from elib.testing.inside import link_of as link_of
    from elib.testing.inside import simulation_of as simulation_of
    from elib.testing.inside import world_of as world_of
    from elib.testing.simulated_time import simulated as simulated
    from elib.testing.transports import check_transport as check_transport

_HOMES = {
    "EmulatedRobot": "emulated",
    "check_transport": "transports",
    "emulator_of": "inside",
    "fault_scripts": "faults",
    "faults_of": "faults",
    "hardware_of": "inside",
    "link_of": "inside",
    "simulated": "simulated_time",
    "simulation_of": "inside",
    "with_faults": "faults",
    "world_of": "inside",
}
__all__ = sorted(_HOMES)


if not TYPE_CHECKING:  # to a type checker, every name would then be there

    def __getattr__(name: str) -> object:
        """Import a helper when it is asked for: pytest loads this package in every run, even if no test uses elib."""
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
