"""The firmwares of virtual robots: ``btcom-1.1.3``, ``btcom-2.0``, ``asercom-1.2.2`` and ``epuck2``."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from types import MappingProxyType

from elib.emulator.firmware.asercom import Asercom122
from elib.emulator.firmware.base import Firmware
from elib.emulator.firmware.btcom import BtCom20, BtCom113
from elib.emulator.firmware.epuck2 import EPuck2
from elib.emulator.hardware import Hardware
from elib.emulator.timing import Timing
from elib.errors import ArgumentError

_CLASSES = (BtCom113, BtCom20, Asercom122, EPuck2)

FIRMWARES: Mapping[str, type[Firmware]] = MappingProxyType({program.NAME: program for program in _CLASSES})
"""Every firmware, by its name."""


def check_name(name: str) -> str:
    """Return *name* if it is the name of a firmware.

    Raises:
        ArgumentError: There is no such firmware; the message lists all.
    """
    if name not in FIRMWARES:
        near = difflib.get_close_matches(name, FIRMWARES, n=1)
        hint = f"did you mean {near[0]}?" if near else ""
        raise ArgumentError(f"there is no firmware {name!r}; there are {', '.join(FIRMWARES)}", hint=hint)
    return name


def step_rate(name: str, speed: int) -> float:
    """Return the step rate that the firmware *name* makes of a wanted speed: its timer has only some; steps/s, signed.

    Raises:
        ArgumentError: There is no such firmware.
    """
    motor = FIRMWARES[check_name(name)].new_motor()
    motor.set_speed(speed)
    return motor.rate


def load(name: str, hardware: Hardware, timing: Timing, resets: int = 0) -> Firmware:
    """Return the firmware *name*, ready to boot on *hardware*.

    Raises:
        ArgumentError: There is no such firmware.
    """
    return FIRMWARES[check_name(name)](hardware, timing, resets)
