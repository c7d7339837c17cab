"""The firmwares of virtual robots: four that talk on a serial line, and ``epuck2-wifi``."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from elib.link.protocol.profiles import profile_named
from elib.simulator.emulator.firmware.asercom import Asercom122
from elib.simulator.emulator.firmware.base import Firmware
from elib.simulator.emulator.firmware.btcom import BtCom20, BtCom113
from elib.simulator.emulator.firmware.epuck2 import EPuck2, EPuck2Wifi

_CLASSES = (BtCom113, BtCom20, Asercom122, EPuck2)

FIRMWARES: Mapping[str, type[Firmware]] = MappingProxyType({program.NAME: program for program in _CLASSES})
"""Every firmware that talks on a serial line, by its name."""

WIFI_FIRMWARES: Mapping[str, type[EPuck2Wifi]] = MappingProxyType({EPuck2Wifi.NAME: EPuck2Wifi})
"""Every firmware that an ESP32 offers over Wi-Fi, by its name."""


def firmware_named(name: str) -> type[Firmware]:
    """Return the class of a firmware.

    Raises:
        ArgumentError: There is no such firmware; the message lists all.
    """
    if name in WIFI_FIRMWARES:
        return WIFI_FIRMWARES[name]
    return FIRMWARES[profile_named(name).name]
