"""Asercom 1.2.2, and the commands that the firmware of the e-puck2 took over from it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from elib.base.body import wrapped
from elib.link.protocol.camera import CENTRED
from elib.link.protocol.image import Mounting
from elib.simulator.emulator.build import EPUCK1_HW13, Build
from elib.simulator.emulator.firmware.acceleration import LEVEL, scaled, with_signed_low_byte
from elib.simulator.emulator.firmware.base import Firmware, binary, text, words
from elib.simulator.emulator.firmware.dspic import DsPicFirmware
from elib.simulator.emulator.firmware.helptext import HELP_ASERCOM, HELP_ASERCOM_OLD
from elib.simulator.emulator.firmware.steps import FirmwareSteps, Send
from elib.simulator.emulator.hardware import Hardware
from elib.simulator.emulator.timing import ASERCOM_1_2_2 as DURATIONS
from elib.simulator.emulator.timing import Timing

GROUND_MODULE = 0xC0
"""Write address (wire-protocol.md, 5.12)."""

ACCELEROMETER, GYROSCOPE = 0x3C, 0xD4
"""Write addresses of the two halves of the LSM330, the inertial chip of revision 1.3 (wire-protocol.md, 2.6)."""

CAMERA = 0xDC
"""Write address of all three camera chips (tests/golden, group "W Y Z i2c")."""

ADDRESSES = range(2, 255, 2)
"""Addresses that ``Z`` tries (wire-protocol.md, 2.6)."""

RGB_PANEL_BYTES = 35
"""Parameters of the RGB-panel command (wire-protocol.md, 3.1)."""

GROUND_REGISTERS = 21  # wire-protocol.md, 5.12


class AsercomCommands(Firmware):
    """What both robots have from this firmware: camera window, ground sensors, gyroscope and I2C."""

    CASE_MATTERS: ClassVar[bytes] = b"bg"
    VERSION: ClassVar[bytes]
    BYTES_ARE_SIGNED: ClassVar[bool]
    ABSENT: ClassVar[int]
    """Byte that is read from a device that does not answer, 0..255."""
    PICTURE_LIMIT: ClassVar[int]
    """Largest picture, bytes (wire-protocol.md, 3.4)."""

    def __init__(self, hardware: Hardware, timing: Timing, resets: int = 0) -> None:
        super().__init__(hardware, timing, resets)
        self.variables.update(device=0, register=0, value=0)

    @property
    def hardware_version(self) -> int:
        """The identity word, 16 bit."""
        return self.hardware.eeprom & 0xFFFF

    @property
    def chip(self) -> int:
        """The camera on the bus."""
        return self.hardware.camera_chip

    def battery_percentage(self, raw: int) -> int:
        """Return the charge, percent, for a raw value; it is linear and may be outside of 0..100.

        (wire-protocol.md, 5.11)
        """
        low, full = self.BUILD.battery
        return int(100 * (raw - low) / (full - low))

    def battery_text(self) -> str:
        """Return raw value and percentage."""
        raw = self.hardware.battery()
        return f"b,{raw} ({self.battery_percentage(raw)}%)\r\n"

    def read_register(self, device: int, number: int) -> int:
        """Return a register as this compiler's ``char``."""
        value = self.register(device & 0xFF, number & 0xFF)
        byte = self.ABSENT if value is None else value
        return wrapped(byte, 8) if self.BYTES_ARE_SIGNED else byte

    def register(self, device: int, number: int) -> int | None:
        """Read a register of the I2C bus.

        Args:
            device: Write address, 0..255.
            number: Register, 0..255.

        Returns:
            The byte, or None if no device answers.
        """
        if device == GROUND_MODULE and self.hardware.floor_present and number < GROUND_REGISTERS:
            return _ground_registers(self.hardware)[number]
        if device == CAMERA and self.chip and number < 2:
            return self.chip.to_bytes(2, "big")[number]
        return None

    @abstractmethod
    def ground_values(self) -> list[int]:
        """Return the five values of the ground module, counts."""

    @abstractmethod
    def rotation(self) -> Sequence[int]:
        """Return the gyroscope's three axes, counts."""

    @text("J")
    def _text_set_camera(self, line: bytes) -> FirmwareSteps:
        self.variables.update(x=CENTRED, y=CENTRED)
        self.scan(line, "mode", "width", "height", "zoom", "x", "y")
        self.keep_size()
        if self.variables["size"] > self.PICTURE_LIMIT:  # only zoom and corner are kept
            self.variables.update(mode=1, width=40, height=40, size=3200)
        yield from self.set_window(self.variables["x"], self.variables["y"])

    @text("M")
    @binary(0xB3)
    def _ground(self, _: bytes) -> Sequence[int]:
        return self.ground_values()

    @text("g")
    @binary(0x99)
    def _gyroscope(self, _: bytes) -> Sequence[int]:
        return self.rotation()

    @text("V")
    def _text_version(self, line: bytes) -> bytes:
        return self.VERSION + self.print(f"HW version: {self.hardware_version:X}\r\n")

    @text("W")
    def _text_i2c_write(self, line: bytes) -> bytes:
        # No device on the emulated bus keeps what is written to it.
        self.scan(line, "device", "register", "value")
        return b"w\r\n"

    @text("Y")
    def _text_i2c_read(self, line: bytes) -> bytes:
        self.scan(line, "device", "register")
        device, number = self.variables["device"], self.variables["register"]
        first = self.print_numbers("y", (device, number))
        self.variables["value"] = self.read_register(device, number)
        return first + self.print_numbers("y", (self.variables["value"],))

    @text("Z")
    def _text_i2c_scan(self, line: bytes) -> bytes:
        lines = []
        for device in ADDRESSES:
            self.variables["value"] = self.read_register(device, 0)
            if self.variables["value"] >= 0:
                lines.append(self.print(f"{device}: {self.variables['value']}\r\n"))
        return b"".join(lines)

    @binary(0xB0, parameters=4)
    def _binary_set_encoders(self, parameters: bytes) -> bytes:
        self.variables["position_left"], self.variables["position_right"] = self.unpacked(parameters)
        self.set_steps(self.variables["position_left"], self.variables["position_right"])
        return b""

    @binary(0xA9, parameters=3)
    def _binary_i2c_write(self, parameters: bytes) -> bytes:
        # Only the lowest byte of each variable is overwritten.
        for name, byte in zip(("device", "register", "value"), parameters, strict=True):
            self.variables[name] = (self.variables[name] & ~0xFF) | byte
        return b""

    @binary(0x89, parameters=RGB_PANEL_BYTES)
    def _binary_rgb_panel(self, parameters: bytes) -> bytes:
        # The firmware puts them where the answer goes on, as scratch memory.
        self.memory.store(self.answer_length, parameters)
        return b""


class Asercom122(AsercomCommands, DsPicFirmware):
    """Asercom 1.2.2 "GCtronic", August 2008, on its Bluetooth side.

    The gumstix side (selector 10, wire-protocol.md, 2.7) is not emulated: every position answers as over Bluetooth.
    """

    NAME: ClassVar[str] = "asercom-1.2.2"
    TIMING: ClassVar[Timing] = DURATIONS
    # The later camera sits upright; this firmware does not mirror it, so its pictures come upside down
    # (wire-protocol.md, 3.2).
    BUILD: ClassVar[Build] = replace(EPUCK1_HW13, camera_chip=0x8030, mounting=Mounting.HALF)
    VERSION: ClassVar[bytes] = b"v,Version 1.2.2 August 2008 GCtronic\r\n"
    BYTES_ARE_SIGNED: ClassVar[bool] = True
    ABSENT: ClassVar[int] = 0xFF
    PICTURE_LIMIT: ClassVar[int] = 3456

    def first_line(self) -> FirmwareSteps:
        """Send which demo was selected, as the surrounding program does for every position."""
        yield Send(self.print(f"Selector pos {self.hardware.selector()}\r\n"), unasked=True)

    def raw_acceleration(self) -> list[int]:
        """Return the acceleration around 2048, counts; revision 1.3 exchanges x and y and scales the values."""
        if not self.hardware.hw13:
            return list(self.hardware.acceleration())
        x, y, z = self.hardware.inertial_acceleration()
        return [scaled(axis) + LEVEL for axis in (y, x, z)]

    def rotation(self) -> Sequence[int]:
        """Return the gyroscope's axes, counts; zeros on a robot without a gyroscope."""
        return self.hardware.rotation() if self.hardware.hw13 else (0, 0, 0)

    def ground_values(self) -> list[int]:
        """Return the module's five values, signed; without the module the bus reads all ones."""
        if not self.hardware.floor_present:
            return [-1] * 5
        return [wrapped(value, 16) for value in self.hardware.ground()[:5]]

    def register(self, device: int, number: int) -> int | None:
        """Read a register of the I2C bus; those of the inertial chip that the firmware never reads are taken as 0."""
        if self.hardware.hw13 and device in (ACCELEROMETER, GYROSCOPE):
            return _inertial_registers(self.hardware, device).get(number, 0)
        return super().register(device, number)

    @text("H")
    def _text_help_text(self, line: bytes) -> bytes:
        return HELP_ASERCOM if self.hardware.hw13 else HELP_ASERCOM_OLD

    @text("A")
    @binary(0x9F)
    def _accelerometer(self, _: bytes) -> Sequence[int]:
        return self.raw_acceleration()

    @text("b")
    def _text_battery(self, line: bytes) -> bytes:
        if self.hardware.hw13:
            return self.print(self.battery_text())
        return self.print_numbers("b", (int(not self.hardware.battery_is_low()),))

    @text("g")
    def _text_gyroscope(self, line: bytes) -> Sequence[int]:
        # Each axis is read with both bytes signed; the binary command reads them properly (wire-protocol.md, 5.5).
        return [wrapped(with_signed_low_byte(axis), 16) for axis in self.rotation()]

    @binary(0x9E)
    def _binary_battery(self, parameters: bytes) -> Sequence[int]:
        return (self.hardware.battery() if self.hardware.hw13 else int(not self.hardware.battery_is_low()),)

    @binary(0x8C)
    def _binary_temperature(self, parameters: bytes) -> bytes:
        return bytes((self.hardware.temperature() & 0xFF if self.hardware.hw13 else 0,))

    @binary(0x89, parameters=RGB_PANEL_BYTES)
    def _binary_rgb_panel(self, parameters: bytes) -> bytes:
        # The firmware uses the start of the answer as scratch memory (wire-protocol.md, trap 22).
        self.memory.store(0, parameters)
        return b""


def _inertial_registers(hardware: Hardware, device: int) -> dict[int, int]:
    """Return those registers of the LSM330 that the firmware reads: who it is, the thermometer, the three axes."""
    if device == ACCELEROMETER:
        known, axes = {0x0F: 0x40}, hardware.inertial_acceleration()
    else:
        known, axes = {0x26: hardware.temperature() & 0xFF}, hardware.rotation()
    return known | dict(enumerate(words(axes), 0x28))


def _ground_registers(hardware: Hardware) -> bytes:
    """Return the registers as the module has them: high byte first, the revision between ground and cliff."""
    values, ambient = hardware.ground(), hardware.ground_ambient()
    ground, cliff = _big_endian(values[:3]), _big_endian(values[3:5])
    return ground + _big_endian(ambient[:3]) + b"\0" + cliff + _big_endian(ambient[3:5])


def _big_endian(values: Sequence[int]) -> bytes:
    return b"".join((value & 0xFFFF).to_bytes(2, "big") for value in values)
