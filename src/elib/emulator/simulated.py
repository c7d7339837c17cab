"""A robot's hardware in a simulated world: the only place where counts and steps become SI, and back.

Several robots share one :class:`~elib.physics.World`; it runs as far as the latest of them asks and never back. What
the world does not model yet reads as on a robot at rest in a lit, quiet room: acceleration, rotation, magnetic field,
temperature, microphones, ground sensors, battery.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from elib.emulator.hardware import CameraWindow, Lights
from elib.errors import ArgumentError
from elib.physics import Colour, Lamps, World
from elib.physics.body import WHEEL_DIAMETER

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

STEPS_PER_TURN = 1000
"""20 steps a turn of the motor, times the gear's 50."""

METRES_PER_STEP = math.pi * WHEEL_DIAMETER / STEPS_PER_TURN
"""0.1288 mm of the nominal wheel's rim."""

SENSOR_WIDTH, SENSOR_HEIGHT = 640, 480  # Of every camera chip an e-puck carries.

Mounting = Literal["upright", "quarter-turn", "half-turn", "three-quarter-turn"]
"""How far a picture must be turned counter-clockwise to stand upright.

``quarter-turn`` is the PO3030 of the e-puck1 as BTcom drives it, both mirrors on; without the mirrors, as asercom
leaves them, the same chip delivers ``three-quarter-turn``.
"""

_MOUNTINGS: tuple[Mounting, ...] = ("upright", "quarter-turn", "half-turn", "three-quarter-turn")


@dataclass(frozen=True, slots=True)
class Build:
    """What differs between the robots that were made.

    Attributes:
        hw13: Hardware revision 1.3 of the e-puck1.
        camera_chip: Chip number.
        mounted: How its camera sits.
        gravity: What the digital accelerometer's z reads at rest, counts; the chip of the e-puck2 is upside down.
        battery: Raw reading of a nearly full battery, counts.
        has_time_of_flight: It carries the distance sensor.
    """

    hw13: bool
    camera_chip: int
    mounted: Mounting
    gravity: int
    battery: int
    has_time_of_flight: bool


EPUCK1 = Build(False, 0x3030, "quarter-turn", 16384, 2500, False)
"""The classic one, with an analog accelerometer."""

EPUCK1_HW13 = Build(True, 0x3030, "quarter-turn", 16384, 2500, False)
"""Revision 1.3; its battery reads 2560 counts at 4.2 V and 2070 at 3.4 V (firmware)."""

EPUCK2 = Build(False, 0x8030, "upright", -16384, 3400, True)
"""Its battery reads 3440 counts at 4.2 V and 2785 at 3.4 V (firmware)."""

EEPROM = 0xFFF7
"""Identity word whose low two bits say that a PO3030 is mounted a quarter turn (protocol.md, 3.2)."""

QUIET = (2048, 12)
"""Microphone in a quiet room: the converter's middle, and a few counts peak to peak."""

MICROPHONE_RATE = 16384  # Samples a second of each microphone, into a ring of 100 (protocol.md, 5.6).

WHITE_FLOOR = 900
"""Ground sensor over white paper: 1000 counts when touching, 300 at 16 mm (Webots); between the two, near the floor."""

# The time-of-flight sensor's published calibration, true m -> read mm (Webots' table of the VL53L0X).
_TIME_OF_FLIGHT = (
    (0.0, 19.8),
    (0.05, 58.5),
    (0.1, 111.0),
    (0.2, 218.9),
    (0.5, 531.9),
    (1.0, 1052.0),
    (1.7, 1780.5),
    (2.0, 2000.0),
)


class SimulatedHardware:
    """One robot of a world, as its firmware sees it (:class:`~elib.emulator.hardware.Hardware`)."""

    def __init__(
        self,
        world: World,
        robot_index: int = 0,
        *,
        build: Build = EPUCK1,
        mounted: Mounting | None = None,
        switched_on: float = 0.0,
    ) -> None:
        """Take over one robot of *world*.

        Args:
            world: Shared by all robots in it.
            robot_index: Which one, 0 for the first.
            build: Which kind of robot.
            mounted: How its camera sits, if not as usual for the build.
            switched_on: When that was, s of the world's time: the zero of :meth:`advance`.

        Raises:
            ArgumentError: There is no such robot in the world, or no such mounting.
        """
        count = world.robots
        if not 0 <= robot_index < count:
            raise ArgumentError(
                f"there is no robot {robot_index} in world {world.scene.name!r}; it has {count}, counted from 0",
                hint="load the world with robots=N",
            )
        self.hw13 = build.hw13
        self.eeprom = EEPROM
        self.camera_chip = build.camera_chip
        self.floor_present = world.scene.model.ground_module
        self.mounted: Mounting = build.mounted if mounted is None else mounted
        if self.mounted not in _MOUNTINGS:
            raise ArgumentError(
                f"a camera cannot be mounted {self.mounted!r}", hint=f"choose one of {', '.join(_MOUNTINGS)}"
            )
        self.world = world
        self.robot_index = robot_index
        self._build = build
        self._switched_on = switched_on
        self._now = switched_on
        self._sound = 0

    def advance(self, time: float) -> None:
        """Let the world run to the last whole tick at or before *time*, s since the robot was switched on."""
        self._now = max(self._now, self._switched_on + time)
        self.world.run_to(self._now)

    def drive(self, left: float, right: float) -> None:
        """Turn the wheels at these step rates from the time of the last :meth:`advance` on, steps/s."""
        self.world.drive(self.robot_index, left * METRES_PER_STEP, right * METRES_PER_STEP, at=self._now)

    def show(self, lights: Lights) -> None:
        """Set all lamps."""
        red = Colour(255, 40, 30)
        ring = [red if lit else Colour(0, 0, 0) for lit in lights.ring]
        for k in range(4):
            parts = lights.rgb[3 * k : 3 * k + 3]
            if any(parts):
                ring[2 * k + 1] = Colour(*((part * 255 + 50) // 100 for part in parts))
        self.world.show(self.robot_index, Lamps(tuple(ring), bool(lights.body), bool(lights.front)))

    def play_sound(self, number: int) -> None:
        """Start sound 1..5, or fall silent with 0. The world carries no sound yet."""
        self._sound = number

    def selector(self) -> int:
        """Return 3: the position in which every firmware talks over Bluetooth."""
        return 3

    def infrared(self) -> tuple[int, int, int]:
        """Return what is there before anybody points a remote control at the robot (protocol.md, 2.1)."""
        return (0 if self._build.has_time_of_flight else 2), 0, 0

    def reflected_light(self) -> Sequence[int]:
        """Return ambient minus lit reading of the eight infrared sensors, counts, 0..4095, higher is nearer."""
        return self.world.proximity(self.robot_index)

    def ambient_light(self) -> Sequence[int]:
        """Return the eight readings with the emitters off, counts, 0..4095, higher is darker."""
        return self.world.ambient_light(self.robot_index)

    def acceleration(self) -> Sequence[int]:
        """Return the analog accelerometer of a level robot: zero at 2048, 1 g is 800 counts (firmware's comments)."""
        return 2048, 2048, 2848

    def inertial_acceleration(self) -> Sequence[int]:
        """Return the digital accelerometer of a level robot, 16384 counts per g."""
        return 0, 0, self._build.gravity

    def rotation(self) -> Sequence[int]:
        """Return zeros: the gyroscope is not modelled yet."""
        return 0, 0, 0

    def magnetic_field(self) -> Sequence[float]:
        """Return a mid-European field, microtesla: 20 horizontal, 44 down. It does not turn with the robot yet."""
        return 20.0, 0.0, -44.0

    def temperature(self) -> int:
        """Return the inertial chip's temperature, degrees C."""
        return 25

    def ground(self) -> Sequence[int]:
        """Return three ground and two cliff sensors over a white floor, counts."""
        return (WHITE_FLOOR,) * 5

    def ground_ambient(self) -> Sequence[int]:
        """Return the same five with their emitters off: hardly any light under the robot, counts."""
        return (15,) * 5

    def microphones(self) -> Sequence[tuple[int, int]]:
        """Return (base level, peak-to-peak volume) of each of four microphones in a quiet room, counts."""
        return (QUIET,) * 4

    def microphone_index(self) -> int:
        """Return the slot of the sample ring written next, 0..99: it goes round 164 times a second."""
        return int((self._now - self._switched_on) * MICROPHONE_RATE) % 100

    def battery(self) -> int:
        """Return the raw reading of a nearly full battery, counts."""
        return self._build.battery

    def battery_is_low(self) -> bool:
        """Return False: the battery is charged."""
        return False

    def distance(self) -> int:
        """Return the time-of-flight distance straight ahead, mm, with the sensor's own bias; 0 without the sensor."""
        if not self._build.has_time_of_flight:
            return 0
        return round(_reading(self.world.distance(self.robot_index)))

    def button_is_pressed(self) -> bool:
        """Return False: nobody touches the robot."""
        return False

    def has_sd_card(self) -> bool:
        """Return False: the slot is empty."""
        return False

    def picture(self, window: CameraWindow) -> bytes:
        """Take a picture: rows of pixels as the chip delivers them.

        Args:
            window: What the firmware asked of the chip; each pixel is sampled at the centre of its zoom x zoom square.

        Returns:
            Mode 0: one luminance byte a pixel. Mode 1: RGB565, high byte first. Mode 2: luminance and, alternating,
            blue and red difference.
        """
        across = [window.x + (k + 0.5) * window.zoom - SENSOR_WIDTH / 2 for k in range(window.width)]
        down = [window.y + (k + 0.5) * window.zoom - SENSOR_HEIGHT / 2 for k in range(window.height)]
        back_across = [-offset for offset in across]
        back_down = [-offset for offset in down]
        # For a chip turned a quarter, its rows are the picture's columns. It delivers row by row all the same.
        match self.mounted:
            case "upright":
                pixels = self.world.picture(self.robot_index, across, back_down)
            case "half-turn":
                pixels = self.world.picture(self.robot_index, back_across, down)
            case "quarter-turn":
                pixels = self.world.picture(self.robot_index, down, across).transpose(1, 0, 2)
            case _:
                pixels = self.world.picture(self.robot_index, back_down, back_across).transpose(1, 0, 2)
        return _encode(pixels, window.mode)


def _reading(true: float) -> float:
    """Return what the time-of-flight sensor reads, mm, at a *true* distance, m."""
    for (near, near_read), (far, far_read) in pairwise(_TIME_OF_FLIGHT):
        if true <= far:
            return near_read + (far_read - near_read) * (true - near) / (far - near)
    return _TIME_OF_FLIGHT[-1][1]


def _encode(pixels: NDArray[np.uint8], mode: int) -> bytes:
    red, green, blue = (pixels[:, :, k].astype("uint16") for k in range(3))
    if mode == 1:
        return bytes((((red & 0xF8) << 8) | ((green & 0xFC) << 3) | (blue >> 3)).astype(">u2").tobytes())
    luminance = (77 * red + 150 * green + 29 * blue) >> 8  # Rec. 601, in 256ths.
    if mode == 0:
        return bytes(luminance.astype("uint8").tobytes())
    level = luminance.astype("int32")
    difference = 128 + ((blue.astype("int32") - level) * 144 >> 8)
    difference[:, 1::2] = (128 + ((red.astype("int32") - level) * 183 >> 8))[:, 1::2]
    return bytes(((level << 8) | difference.clip(0, 255)).astype(">u2").tobytes())
