"""The base of the e-puck1's firmwares: lamps, accelerometer, camera, sound, remote control and start."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import ClassVar

from elib.base.body import wrapped
from elib.link.protocol.camera import CENTRED, EPUCK1_DRIVERS, PO3030, SENSOR_HEIGHT, CameraDriver
from elib.simulator.emulator.firmware.acceleration import (
    GRAVITY_ANALOG,
    GRAVITY_INERTIAL,
    attitude_single,
    scaled,
    with_signed_low_byte,
)
from elib.simulator.emulator.firmware.base import BANNER, Firmware, binary, text, words
from elib.simulator.emulator.firmware.bootloader import ProgramMemory, run_bootloader
from elib.simulator.emulator.firmware.steps import Busy, FirmwareStep, FirmwareSteps, Restart, Send
from elib.simulator.emulator.hardware import Hardware, Lights
from elib.simulator.emulator.motors import PowerSavingMotor, StepMotor
from elib.simulator.emulator.timing import Timing

REMOTE_ADDRESSES = (0, 8)
REMOTE_SPEEDS = {
    1: (300, 600),
    2: (600, 600),
    3: (600, 300),
    4: (-600, 600),
    5: (0, 0),
    6: (600, -600),
    7: (-300, -600),
    8: (-600, -600),
    9: (-600, -300),
}
"""Left and right speed, steps/s, for each key of the remote control; 0 plays a sound, all others stop
(wire-protocol.md, 5.10)."""
REMOTE_SOUND = 5


class DsPicFirmware(Firmware):
    """A firmware of the e-puck1: 16-bit integers, and one loop that does nothing else while it sends."""

    MOTOR: ClassVar[type[StepMotor]] = PowerSavingMotor
    INT_BITS: ClassVar[int] = 16
    LONG_BITS: ClassVar[int] = 32
    PAIR: ClassVar[str] = "<2h"
    LOOKS_FOR_CHIP: ClassVar[bool] = True
    """Whether it looks for the camera's chip, and takes no picture without one."""

    def __init__(self, hardware: Hardware, timing: Timing, resets: int = 0) -> None:
        super().__init__(hardware, timing, resets)
        self._believes_amplifier_on = self._is_amplifier_on = False
        self.zero = (0, 0, 0)
        self._last_key = 0
        self._capture_address = 0

    # -- the start --

    def boot(self, memory: ProgramMemory, *, cold: bool) -> FirmwareSteps:
        """Start: bootloader, initialisation, banner; after power-on the chip resets itself once in between."""
        if cold:
            self.resets += 1
            yield from run_bootloader(memory, self.timing, self._light_upload)
        yield from run_bootloader(memory, self.timing, self._light_upload)
        yield Busy(self.timing.startup)
        yield from self.first_line()
        yield Busy(self.timing.camera_start)
        self.zero_acceleration()
        yield Send(BANNER, unasked=True)

    def first_line(self) -> FirmwareSteps:
        """Do what comes before the camera is started."""
        yield from ()

    def _light_upload(self, on: int) -> None:
        """Switch the LED with which the bootloader shows that an upload has ended."""
        self.lights.ring[6] = on
        self.show()

    def wants_remote(self) -> bool:
        """Return whether there is a key other than the last one, from an address that it listens to."""
        _, address, key = self.hardware.infrared()
        return key != self._last_key and address in REMOTE_ADDRESSES

    def obey_remote(self) -> None:
        """Play a sound for key 0, or take the speeds of another key; then set the speeds that are in the variables."""
        self._last_key = self.hardware.infrared()[2]
        if self._last_key == 0:
            self.play(REMOTE_SOUND)
        else:
            left, right = REMOTE_SPEEDS.get(self._last_key, (0, 0))
            self.variables["speed_left"], self.variables["speed_right"] = left, right
        self.drive_as_asked()

    # -- motors, lamps, sensors --

    def light(self, led: int, action: int) -> None:
        """Set ring LED *led*; "all" takes the lowest bit of the action and never toggles (wire-protocol.md, 2.2)."""
        ring = self.lights.ring
        if 0 <= led < 8:
            ring[led] = self.switched(ring[led], action)
        else:
            ring[:] = [action & 1] * 8

    def play(self, number: int) -> None:
        """Start a sound, 1..5; any other number switches the amplifier off (wire-protocol.md, 5.9).

        A camera set-up switches it off, too, and the firmware does not notice: sounds stay silent until it switches the
        amplifier off and on itself.
        """
        if not self._believes_amplifier_on:
            self._believes_amplifier_on = self._is_amplifier_on = True
        if not 1 <= number <= 5:
            self._believes_amplifier_on = self._is_amplifier_on = False
        super().play(number if self._is_amplifier_on else 0)

    def prox_reading(self) -> Sequence[int]:
        """Return the reflected light, counts; it may be negative."""
        return self.hardware.reflected_light()

    def analog(self) -> list[int]:
        """Return the three ADC channels of the accelerometer; from revision 1.3 on the third is the battery."""
        x, y, z = self.hardware.acceleration()
        return [x, y, self.hardware.battery() if self.hardware.hw13 else z]

    def zero_acceleration(self) -> None:
        """Measure the zero of the accelerometer, on a level robot that stands still.

        On revision 1.3 the driver reads the low bytes as signed here, and it does not exchange the axes as it does
        when it reads values: the golden transcripts show both.
        """
        if self.hardware.hw13:
            x, y, z = (with_signed_low_byte(axis) for axis in self.hardware.inertial_acceleration())
            gravity = GRAVITY_INERTIAL
        else:
            x, y, z = self.hardware.acceleration()
            gravity = GRAVITY_ANALOG
        self.zero = (x, y, z - gravity)

    def zeroed(self) -> list[int]:
        """Return the acceleration minus the zero, counts; the third axis is +1 g at rest."""
        if not self.hardware.hw13:
            return [
                wrapped(axis - zero, 16) for axis, zero in zip(self.hardware.acceleration(), self.zero, strict=True)
            ]
        x, y, z = self.hardware.inertial_acceleration()
        return [scaled(wrapped(axis - zero, 16)) for axis, zero in zip((y, x, z), self.zero, strict=True)]

    # -- the camera --

    @property
    def camera_driver(self) -> CameraDriver | None:
        """The driver of the chip on the bus."""
        return EPUCK1_DRIVERS.get(self.hardware.camera_chip) if self.LOOKS_FOR_CHIP else PO3030

    def set_window(self, x: int = CENTRED, y: int = CENTRED) -> FirmwareSteps:
        """Set up the camera, and with it every port: lamps and amplifier go off (wire-protocol.md, 2.2)."""
        self.lights = Lights()
        self.show()
        self._is_amplifier_on = False
        super().play(0)
        yield Busy(self.timing.camera_setup)
        self.aim(x, y)
        yield Send(b"j\r\n")

    def launch_capture(self, address: int) -> None:
        """Let the next capture go to *address*; an earlier one of the same answer is dropped."""
        self._capture_address = address

    def finish_capture(self) -> bool:
        """Write the picture to the last capture's address; return False without a camera, or if its rows never end."""
        if (self.LOOKS_FOR_CHIP and self.hardware.camera_chip == 0) or not 0 < self.window.height <= SENSOR_HEIGHT:
            return False
        self.memory.store(self._capture_address, self.take_picture())
        return True

    # -- commands --

    @text("J")
    def _text_set_camera(self, line: bytes) -> FirmwareSteps:
        self.scan(line, "mode", "width", "height", "zoom")
        self.keep_size()
        yield from self.set_window()

    @text("R")
    def _text_reset(self, line: bytes) -> FirmwareSteps:
        # The reset cuts off the last byte, which the transmitter has just begun to send (wire-protocol.md, 1.2).
        yield Send(b"r\r")
        yield Restart()

    @binary(0xBF)
    def _binary_attitude(self, parameters: bytes) -> Iterator[FirmwareStep | bytes]:
        answer = attitude_single(*self.zeroed())
        yield Busy(self.timing.attitude)
        yield answer

    @binary(0xAB)
    def _binary_microphone_samples(self, parameters: bytes) -> Iterator[FirmwareStep | bytes]:
        yield Send(words(self.hardware.microphone_rings()), waits=False)
        yield bytes((self.hardware.microphone_index() & 0xFF,))
