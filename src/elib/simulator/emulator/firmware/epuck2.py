"""The firmware of the e-puck2, "advanced sercom v2" of January 2018, over Bluetooth.

Two things follow the golden transcripts where these differ from the real robot (tests/golden/README.md): reading the
accelerometer does not change its zero, and ``prox`` and the distance sensor answer while they are switched off.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import ClassVar

from elib.link.protocol import camera
from elib.simulator.emulator.build import EPUCK2, Build
from elib.simulator.emulator.firmware.acceleration import GRAVITY_INERTIAL, LEVEL, attitude_double, scaled
from elib.simulator.emulator.firmware.asercom import AsercomCommands
from elib.simulator.emulator.firmware.base import BANNER, binary, text, words
from elib.simulator.emulator.firmware.bootloader import ProgramMemory
from elib.simulator.emulator.firmware.helptext import HELP_ASERCOM
from elib.simulator.emulator.firmware.steps import Busy, FirmwareStep, FirmwareSteps, Send
from elib.simulator.emulator.hardware import Hardware
from elib.simulator.emulator.motors import MicrostepMotor, StepMotor
from elib.simulator.emulator.timing import EPUCK2 as DURATIONS
from elib.simulator.emulator.timing import Timing

RED_INTENSITY = 10
"""Intensity with which ``L`` lights an RGB LED, percent (wire-protocol.md, 5.2)."""

STOP_SOUND = 0x20
"""In the sound byte of the actuator packet (wire-protocol.md, 3.5)."""

IDENTITY = 0xFFF7
"""The identity word, which is constant here (wire-protocol.md, 2.1)."""


THREAD_PERIOD = 0.02
"""Period of the avoidance thread, s (wire-protocol.md, 5.1)."""

NOISE = 5
"""Proximity, counts, below which a sensor has no effect (e-puck2_main-processor: src/behaviors.c)."""

FORWARD = (-1.0, -0.5, 0.0, 0.75, 0.75, 0.0, -0.5, -1.0)
SIDEWAYS = (0.5, 0.5, 1.0, 0.5, -0.5, -1.0, -0.5, -0.5)
"""How much each proximity sensor pushes the robot forward and to the left: a simplified field of forces
(e-puck2_main-processor: src/behaviors.c)."""

REMOTE_SPEED = 600
REMOTE_TURNS = {
    **dict.fromkeys((5, 12), (0, 0)),
    **dict.fromkeys((2, 32), (1, 1)),
    **dict.fromkeys((8, 33), (-1, -1)),
    **dict.fromkeys((6, 16), (1, -1)),
    **dict.fromkeys((4, 17), (-1, 1)),
    3: (1, 0),
    1: (0, 1),
    9: (-1, 0),
    7: (0, -1),
}
"""Directions of the wheels for each key of the remote control (wire-protocol.md, 5.10)."""


class Threads:
    """The robot's threads beside its command loop: obstacle avoidance and the remote control."""

    def __init__(self) -> None:
        self.avoids = False  # whether obstacle avoidance is on
        self.target = (0, 0)  # the speeds asked for while it is on, steps/s
        self._last_code: tuple[int, int, int] | None = None

    def avoidance(self, near: Sequence[int]) -> tuple[int, int]:
        """Return speeds that lead around near obstacles, steps/s.

        Args:
            near: Eight calibrated proximity values, counts.
        """
        seen = [value if value >= NOISE else 0 for value in near]
        forward = int(sum(weight * value for weight, value in zip(FORWARD, seen, strict=True))) >> 1
        sideways = int(sum(weight * value for weight, value in zip(SIDEWAYS, seen, strict=True))) << 2
        left, right = self.target
        left += (forward if left >= 0 else -forward) - sideways
        right += (forward if right >= 0 else -forward) + sideways
        return left, right

    def heard(self, code: tuple[int, int, int]) -> bool:
        """Keep the remote control's last code; return whether it is new and moves the robot.

        Args:
            code: Check bit, address, key; a new press changes the check bit, so a repeated key acts again.
        """
        is_new = self._last_code is not None and code != self._last_code
        self._last_code = code
        return is_new and code[2] in REMOTE_TURNS

    def remote_speeds(self) -> tuple[int, int]:
        """Return the speeds that the last code asks for, steps/s."""
        left, right = REMOTE_TURNS[self._last_code[2]] if self._last_code else (0, 0)
        return left * REMOTE_SPEED, right * REMOTE_SPEED


class EPuck2(AsercomCommands):
    """The firmware of the e-puck2's main processor, selector 3: 32-bit integers, unsigned ``char``."""

    NAME: ClassVar[str] = "epuck2"
    TIMING: ClassVar[Timing] = DURATIONS
    BUILD: ClassVar[Build] = EPUCK2
    MOTOR: ClassVar[type[StepMotor]] = MicrostepMotor
    INT_BITS: ClassVar[int] = 32
    DROPS: ClassVar[bool] = True
    # It was 64 where the transcripts were made; numbers beyond 2^31 depend on that (tests/golden/README.md).
    LONG_BITS: ClassVar[int] = 64
    PAIR: ClassVar[str] = "<2H"  # unsigned (wire-protocol.md, 5.1)
    HELP: ClassVar[bytes] = HELP_ASERCOM
    VERSION: ClassVar[bytes] = b"v,Version 2.0 January 2018 GCtronic\r\n"
    BYTES_ARE_SIGNED: ClassVar[bool] = False
    ABSENT: ClassVar[int] = 0
    PICTURE_LIMIT: ClassVar[int] = 4136

    def __init__(self, hardware: Hardware, timing: Timing, resets: int = 0) -> None:
        super().__init__(hardware, timing, resets)
        self.aim()  # zoom 8 acts as 4 from the start
        self.threads = Threads()
        self._thread_due = 0.0
        self.zero: Sequence[int] = (0, 0, 0)
        self.gyroscope_zero: Sequence[int] = (0, 0, 0)
        self.has_ground = False
        self.magnetometer_on = 0
        self.proximity_rate = 1
        self.distance_on = 1
        self._sample = bytearray(self.PICTURE_LIMIT)
        self._picture_address = 0

    # -- the start --

    def boot(self, memory: ProgramMemory, *, cold: bool) -> FirmwareSteps:
        """Start: drivers, calibrations, banner; there is no bootloader on this line."""
        ranging = self.timing.calibration - self.timing.calibration_lights
        yield Busy(self.timing.startup - ranging)
        yield from self.calibrate(ranging)
        self.zero, self.gyroscope_zero = self.hardware.inertial_zeros()
        self.has_ground = self.hardware.floor_present
        yield Send(BANNER, unasked=True)

    def run_threads(self, time: float) -> None:
        """Move the motors as obstacle avoidance wants, 50 times a second."""
        self.next_thread = self._thread_due = time + THREAD_PERIOD
        self.drive(*self.threads.avoidance(self.calibrated()))

    def wants_remote(self) -> bool:
        """Return whether there is a new code; a thread of its own looks for it, and does not change the variables."""
        return self.timing.runs and self.threads.heard(self.hardware.infrared())

    def obey_remote(self) -> None:
        """Drive with the speeds of the last code."""
        self.drive(*self.threads.remote_speeds())

    def report(self) -> dict[str, object]:
        """Return what it has set; the keys are those of ``hw`` in the golden files."""
        return {
            **super().report(),
            "led": self.lights.ring[0::2],
            "rgb": list(self.lights.rgb),
            "oa": int(self.threads.avoids),
            "oa_target": list(self.threads.target),
            "prox_mode": self.proximity_rate,
            "tof_on": self.distance_on,
            "mag_on": self.magnetometer_on,
        }

    # -- motors, lamps, sensors --

    @property
    def hardware_version(self) -> int:
        """The identity word: a constant on this robot."""
        return IDENTITY

    @property
    def chip(self) -> int:
        """The camera on the bus: this robot has only one type."""
        return 0x8030

    def ask_speed(self, left: int, right: int) -> None:
        """Set the speeds that a command asks for, steps/s; while obstacle avoidance is on they are only a target."""
        if self.threads.avoids:
            self.threads.target = (left, right)
        else:
            self.drive(left, right)

    def light(self, led: int, action: int) -> None:
        """Set ring LED *led*, a red one or the red of an RGB LED; any other number sets all, one after the other."""
        if not 0 <= led < 8:
            for each in range(8):
                self.light(each, action)
            return
        if led % 2 == 0:
            self.lights.ring[led] = self.switched(self.lights.ring[led], action)
            return
        first = 3 * (led // 2)
        rgb, action = self.lights.rgb, self.unsigned(action)
        if action > 1:
            rgb[first] = 0 if rgb[first] else RED_INTENSITY
        else:
            rgb[first : first + 3] = [action * RED_INTENSITY, 0, 0]

    def light_rgb(self, values: bytes) -> None:
        """Set all four RGB LEDs; a value over 100 leaves its colour as it is (wire-protocol.md, 3.5)."""
        for position, value in enumerate(values):
            if value <= 100:
                self.lights.rgb[position] = value

    def prox_reading(self) -> Sequence[int]:
        """Return the reflected light, counts; here it is never below 0."""
        return [max(0, value) for value in self.hardware.reflected_light()]

    def zeroed(self) -> list[int]:
        """Return the acceleration minus the zero on the e-puck1's scale, counts; z is +768 at rest."""
        x, y, z = (axis - zero for axis, zero in zip(self.hardware.inertial_acceleration(), self.zero, strict=True))
        return [scaled(-x), scaled(y), scaled(GRAVITY_INERTIAL - z)]

    def raw_acceleration(self) -> list[int]:
        """Return the acceleration around 2048, counts."""
        x, y, z = self.hardware.inertial_acceleration()
        return [scaled(axis) + LEVEL for axis in (-x, y, -z)]

    def battery_percentage(self, raw: int) -> int:
        """Return the charge, percent, at least 0: here it becomes an unsigned number on a processor that ends at 0.

        The firmware computes it from volts, and so may be 1 below this: 3440 counts are 4.199 V and not quite 4.2.
        """
        return max(0, super().battery_percentage(raw))

    def rotation(self) -> list[int]:
        """Return the gyroscope in the e-puck1's axes, counts."""
        x, y, z = (axis - zero for axis, zero in zip(self.hardware.rotation(), self.gyroscope_zero, strict=True))
        return [-y, x, z]

    def register(self, device: int, number: int) -> int | None:
        """Read a register of the I2C bus; the driver takes an odd address for the even one below it."""
        return super().register(device & ~1, number)

    def ground_values(self) -> list[int]:
        """Return five values of the module, counts; zeros unless it answered at the start."""
        if not self.has_ground or not self.hardware.floor_present:
            return [0] * 5
        return [value & 0xFFFF for value in self.hardware.ground()[:5]]

    def ground_ambient_values(self) -> list[int]:
        """Return the same with the emitters off, counts."""
        return list(self.hardware.ground_ambient()[:5]) if self.has_ground else [0] * 5

    # -- the camera --

    @property
    def camera_driver(self) -> camera.CameraDriver:
        """This robot's one driver."""
        return camera.EPUCK2

    def set_window(self, x: int = camera.CENTRED, y: int = camera.CENTRED) -> FirmwareSteps:
        """Set up the camera."""
        yield Busy(self.timing.camera_setup)
        self.aim(x, y)
        yield Send(b"j\r\n")

    def launch_capture(self, address: int) -> None:
        """Fill the camera's own memory; only the place of the last request in the answer gets the picture."""
        picture = self.take_picture()
        self._sample[: len(picture)] = picture
        self._picture_address = address

    def finish_capture(self) -> bool:
        """Copy as many bytes as the header says; a negative number ends the program."""
        size = self.variables["size"]
        if size < 0:
            return False
        self.memory.store(self._picture_address, bytes(self._sample[:size]))
        return True

    # -- text commands --

    @text("A")
    def _text_accelerometer(self, line: bytes) -> FirmwareSteps:
        yield Busy(self.timing.acceleration)
        yield Send(self.print_numbers("a", self.raw_acceleration()))

    @text("b")
    def _text_battery(self, line: bytes) -> bytes:
        return self.print(self.battery_text())

    @text("R")
    def _text_reset(self, line: bytes) -> bytes:
        return b""

    # -- binary commands --

    @binary(0x9F)
    def _binary_accelerometer(self, parameters: bytes) -> Iterator[FirmwareStep | bytes]:
        yield Busy(self.timing.acceleration)
        yield words(self.raw_acceleration())

    @binary(0xBF)
    def _binary_attitude(self, parameters: bytes) -> bytes:
        return attitude_double(*self.zeroed())

    @binary(0x9E)
    def _binary_battery(self, parameters: bytes) -> Sequence[int]:
        return (self.hardware.battery(),)

    @binary(0xB3)
    def _binary_ground(self, parameters: bytes) -> Sequence[int]:
        return self.ground_values()[:4]

    @binary(0x8C)
    def _binary_temperature(self, parameters: bytes) -> bytes:
        return b"\0"  # a condition is inverted in the firmware (wire-protocol.md, 3.1)

    @binary(0xA7, parameters=2)
    def _binary_i2c_read(self, parameters: bytes) -> bytes:
        for name, byte in zip(("device", "register"), parameters, strict=True):
            self.variables[name] = (self.variables[name] & ~0xFF) | byte
        self.variables["value"] = self.read_register(*parameters)
        return bytes((self.variables["value"] & 0xFF,))

    @binary(0xF8)
    def _binary_sensors(self, parameters: bytes) -> Iterator[FirmwareStep | bytes]:
        hardware = self.hardware
        yield words(self.zeroed()) + attitude_double(*self.zeroed()) + words(self.rotation())
        yield struct.pack("<3f", *hardware.magnetic_field()) + bytes((hardware.temperature() & 0xFF,))
        yield words(self.calibrated()) + words(hardware.ambient_light()[:8]) + words((hardware.distance(),))
        yield words(self.volumes()[:4]) + words([motor.steps for motor in self.motors])
        yield words((hardware.battery(),)) + bytes((hardware.has_sd_card(),))
        yield bytes(value & 0xFF for value in (*hardware.infrared(), hardware.selector()))
        yield words(self.ground_values()[:3]) + words(self.ground_ambient_values()[:3]) + b"\0"

    @binary(0xF7, parameters=19)
    def _binary_set_actuators(self, parameters: bytes) -> FirmwareSteps:
        flags, lamps, sounds = parameters[0], parameters[5], parameters[18]
        if flags & 1:
            yield from self.calibrate(self.timing.calibration - self.timing.calibration_lights)
        self.threads.avoids = bool(flags & 2)
        self.next_thread = self._thread_due if self.timing.runs and self.threads.avoids else math.inf
        left, right = self.unpacked(parameters[1:5])
        self.variables["speed_left"], self.variables["speed_right"] = left, right
        if flags & 4:
            self.set_steps(left, right)
        else:
            self.drive_as_asked()
        self.lights.ring[0::2] = [lamps >> bit & 1 for bit in range(4)]
        self.lights.body, self.lights.front = lamps >> 4 & 1, lamps >> 5 & 1
        self.light_rgb(parameters[6:18])
        self.show()
        for number in range(1, 6):
            if sounds >> (number - 1) & 1:
                self.play(number)
        if sounds & STOP_SOUND:
            self.play(0)

    @binary(0xF6, parameters=12)
    def _binary_set_rgb_led(self, parameters: bytes) -> bytes:
        self.light_rgb(parameters)
        self.show()
        return b""

    @binary(0xF5)
    def _binary_button(self, parameters: bytes) -> bytes:
        return bytes((self.hardware.button_is_pressed(),))

    @binary(0xF4)
    def _binary_all_microphones(self, parameters: bytes) -> Sequence[int]:
        return self.volumes()[:4]

    @binary(0xF3)
    def _binary_distance(self, parameters: bytes) -> Sequence[int]:
        return (self.hardware.distance(),)

    @binary(0xF2)
    def _binary_sd_card(self, parameters: bytes) -> bytes:
        return bytes((self.hardware.has_sd_card(),))

    @binary(0xF1, parameters=1)
    def _binary_start_magnetometer(self, parameters: bytes) -> bytes:
        if parameters[0] == 1:
            self.magnetometer_on = 1
        return b"\0"

    @binary(0xF0, parameters=1)
    def _binary_set_proximity_rate(self, parameters: bytes) -> bytes:
        self.proximity_rate = parameters[0]
        return b"\0"

    @binary(0xEF, parameters=1)
    def _binary_set_distance_sensor(self, parameters: bytes) -> bytes:
        self.distance_on = int(parameters[0] != 0)
        return b"\0"


GREEN, BLUE, DARK = (0, 100, 0), (0, 0, 100), (0, 0, 0)
"""Colours of LED2 while the ESP32 waits for a client, while it sends, and between two packets, percent
(wire-protocol.md, 4.1)."""

KEEP = bytes((255,) * 3)
"""A colour that changes nothing (wire-protocol.md, trap 33)."""


class EPuck2Wifi(EPuck2):
    """The same firmware at selector 15, where only the ESP32 with its Wi-Fi firmware talks to it.

    The camera takes 160 x 120 pixels in colour, the magnetometer is on, and LED2 belongs to the ESP32
    (wire-protocol.md, 4.1).
    """

    NAME: ClassVar[str] = "epuck2-wifi"
    BUILD: ClassVar[Build] = replace(EPUCK2, selector=15)

    def __init__(self, hardware: Hardware, timing: Timing, resets: int = 0) -> None:
        super().__init__(hardware, timing, resets)
        self.window = self.camera_driver.window(1, 160, 120, 4, camera.CENTRED, camera.CENTRED)
        self.magnetometer_on = 1

    def light_rgb(self, values: bytes) -> None:
        """Set the RGB LEDs but LED2."""
        super().light_rgb(KEEP + values[3:])

    def show_status(self, colour: tuple[int, int, int]) -> None:
        """Set LED2, for the ESP32."""
        self.lights.rgb[:3] = colour
        self.show()
