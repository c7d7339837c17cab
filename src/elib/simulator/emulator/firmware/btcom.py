"""BTCom 1.1.3 and 2.0, the first firmwares of the e-puck1."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from elib.simulator.emulator.build import EPUCK1, Build
from elib.simulator.emulator.firmware.base import binary, text
from elib.simulator.emulator.firmware.dspic import DsPicFirmware
from elib.simulator.emulator.firmware.helptext import HELP_BTCOM
from elib.simulator.emulator.firmware.steps import FirmwareSteps
from elib.simulator.emulator.timing import BTCOM_1_1_3, BTCOM_2_0, Timing


class _BtCom(DsPicFirmware):
    """The base of both BTComs."""

    BUILD: ClassVar[Build] = EPUCK1
    HELP: ClassVar[bytes] = HELP_BTCOM
    VERSION: ClassVar[bytes]

    @text("V")
    def _text_version(self, line: bytes) -> bytes:
        return self.VERSION

    @text("M")
    def _text_ground(self, line: bytes) -> bytes:
        # The published builds do not have the module.
        return b"m,0,0,0\r\n"

    @binary(0xB3)
    def _binary_ground(self, parameters: bytes) -> bytes:
        return bytes(6)


class BtCom113(_BtCom):
    """BTCom 1.1.3, September 2006.

    How many bytes can wait while it is busy is an assumption: the library that it was linked with is not published, and
    is older than the receive ring, so that only the UART's own bytes remain (wire-protocol.md, 1.1). An overrun may
    stall the real robot; here it only loses bytes. The driver is that of the PO3030 for every camera.
    """

    NAME: ClassVar[str] = "btcom-1.1.3"
    TIMING: ClassVar[Timing] = BTCOM_1_1_3
    DROPS: ClassVar[bool] = True
    LOOKS_FOR_CHIP: ClassVar[bool] = False
    VERSION: ClassVar[bytes] = b"v,Version 1.1.3 September 2006\r\n"
    LACKS: ClassVar[frozenset[int]] = frozenset({0xBB, 0x8B})  # speed and microphones

    def calibrated(self) -> list[int]:
        """Return the proximity values minus their offsets; in this version they may be below 0."""
        return [value - offset for value, offset in zip(self.prox_reading()[:8], self.offsets, strict=False)]

    @text("A")
    def _text_accelerometer(self, line: bytes) -> Sequence[int]:
        return self.analog()

    @binary(0xB2)
    def _binary_proximity(self, parameters: bytes) -> Sequence[int]:
        return self.prox_reading()[:8]

    @binary(0xB4, parameters=2)
    def _binary_set_led(self, parameters: bytes) -> bytes:
        # In this version 8 and 9 do not stand for the body and front LED, but for all ring LEDs.
        self.light(*parameters)
        self.show()
        return b""


class BtCom20(_BtCom):
    """BTCom 2.0, January 2008, built without turret and ground sensors."""

    NAME: ClassVar[str] = "btcom-2.0"
    TIMING: ClassVar[Timing] = BTCOM_2_0
    VERSION: ClassVar[bytes] = b"v,Version 2.0.0 January 2008\r\n"
    LIGHTS_CALIBRATION: ClassVar[bool] = False

    def first_line(self) -> FirmwareSteps:
        """Calibrate the proximity sensors, as this version does at every start."""
        # The time it takes is part of the start-up's.
        self.offsets = [int(value) for value in self.prox_reading()]
        yield from ()

    @text("A")
    @binary(0x9F)
    def _accelerometer(self, _: bytes) -> Sequence[int]:
        return self.zeroed()

    @text("W")
    def _text_turret(self, line: bytes) -> bytes:
        return b""

    @binary(0xA9)
    def _binary_turret(self, parameters: bytes) -> bytes:
        return b""

    @text("X")
    def _text_dummy(self, line: bytes) -> bytes:
        """Answer ``x,`` and as many ones as asked for; the text ends where the buffer has a zero by chance."""
        self.scan(line, "position_left")
        count = self.variables["position_left"]
        self.memory.store(count + 2, b"\r")
        self.memory.store(count + 3, b"\n")
        if count > 0:
            self.memory.store(2, b"1" * count)
            self.variables["position_left"] = 0
        self.memory.store(0, b"x,")
        return self.memory.text(0)
