"""A robot's hardware in a simulated world: the only place where counts and steps become SI units, and back.

Several robots share one ``World``. It runs up to the latest time that one of them asks for. What the
world does not have is here: battery, magnetic field, temperature, and the switches that a hand moves.

The robots' accelerometers count to the left, forward and up: x and y of the analog one grow when the right or the rear
side is down (wire-protocol.md, 5.4), which agrees with the firmware's own orientation, 0 for front down and 90 degrees
for left down, and with GCtronic's ROS driver (e-puck.md, 6). The digital chips are mounted so that their firmwares
compute the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from elib.base.body import METRES_PER_STEP, MICROPHONE_RATE
from elib.base.errors import ArgumentError
from elib.base.rules import Whole
from elib.base.timeofflight import biased
from elib.link.protocol.camera import SENSOR_HEIGHT, SENSOR_WIDTH, CameraWindow
from elib.link.protocol.image import Mounting, check_mounting
from elib.link.protocol.pitch import sent_samples
from elib.link.protocol.shapes import MICROPHONES, NO_ECHO, SAMPLES
from elib.simulator.emulator.battery import FULL_VOLTS, LOW_VOLTS, BatteryCell, power_of, volts_at
from elib.simulator.emulator.build import EPUCK1, Build
from elib.simulator.emulator.hardware import Lights
from elib.simulator.emulator.robotprofile import NOMINAL_RADIUS, RobotProfile
from elib.simulator.physics import Colour, Lamps, World
from elib.simulator.physics.body import GRAVITY
from elib.simulator.physics.defects import MAGNETOMETER_AT, Defect, pace, spoiled
from elib.simulator.physics.noise import HARD_IRON, MAGNETOMETER, gauss, tick_key
from elib.simulator.physics.sensors.distance import REACH

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

EEPROM = 0xFFF7
"""Identity word whose low two bits say that a PO3030 is mounted a quarter turn (wire-protocol.md, 3.2)."""

MIDDLE = 2048
"""Middle of the 12-bit converter: a microphone in silence, and the analog accelerometer at 0 g."""

ANALOG_GRAVITY = 800
"""1 g of the analog accelerometer, counts (firmware's comments)."""

INERTIAL_GRAVITY = 16384
"""1 g of a digital accelerometer set to +-2 g, counts."""

LOUDNESS = 1000.0
"""Volume of the robot's loudspeaker at 0.1 m, counts. It is uncalibrated, as all sound is."""

NORTH, DOWN = 20.0, 44.0
"""The magnetic field of mid-Europe, microtesla: north, which is the world's y, and into the ground."""

MAGNETS = (11.0, 11.0, 200.0)
"""Spread between robots of the field of their own magnets, microtesla: forward, to the left, up (measured-robots:
magnetometer.pipuck, one robot: 5, 15 and 210)."""

FIELD_DEVIATION = 0.7
"""Noise of each axis of a typical robot, microtesla (measured-robots: magnetometer.pipuck)."""

FIELD_STEP = 0.15
"""microtesla. One count of the magnetometers of the e-puck2 (their data sheets)."""

RANGING_TIME = 0.106
"""s between two values of the distance sensor: the firmware sleeps 100 ms, and reads (measured-robots:
time_of_flight.epuck2)."""


class SimulatedHardware:
    """One robot of a world, as its firmware sees it (:class:`~elib.simulator.emulator.hardware.Hardware`)."""

    def __init__(
        self,
        world: World,
        robot_index: int = 0,
        *,
        build: Build = EPUCK1,
        mounting: Mounting | None = None,
        switched_on: float = 0.0,
        charge: float = 1.0,
        profile: RobotProfile | None = None,
    ) -> None:
        """Take over one robot of *world*.

        Args:
            world: Shared by all robots in it.
            robot_index: Index of the robot, from 0.
            build: Which kind of robot it is.
            mounting: How its camera sits, if not as usual for the build.
            switched_on: When it was switched on, s of the world's time: the zero of :meth:`advance`.
            charge: Charge of its battery at that time, 0..1.
            profile: How it differs from a nominal robot: wheels, gains and offsets of the infrared sensors. Their
                curve belongs to the world (:meth:`~elib.simulator.emulator.robotprofile.RobotProfile.model`).

        Raises:
            ArgumentError: There is no such robot in the world, no such mounting, or the charge is out of its range.
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
        self.mounting = check_mounting(mounting) or build.mounting
        self.world = world
        self.robot_index = robot_index
        self._build = build
        if profile is not None and profile.wheels is not None:
            wheels = profile.wheels
            world.set_wheels(
                robot_index, wheels.left_radius / NOMINAL_RADIUS, wheels.right_radius / NOMINAL_RADIUS, wheels.axle
            )
        if profile is not None and profile.infrared is not None:
            world.set_infrared(robot_index, profile.infrared.gains, profile.infrared.offsets)
        self._switched_on = switched_on
        self._now = switched_on
        # returns the voltage of its battery now, V, for a fault script that runs it down. Where this is None, or
        # returns None, the robot's own battery gives the voltage.
        self.volts: Callable[[], float | None] | None = None
        # field that turns with the robot: forward, to the left, up, microtesla. It adds to that of its own magnets,
        # which ideal robots do not have.
        self.hard_iron = (0.0, 0.0, 0.0)
        # what its iron makes of the world's field, seen from above: factors forward from forward, forward from left,
        # left from forward, left from left
        self.soft_iron = (1.0, 0.0, 0.0, 1.0)
        self._cell = BatteryCell(charge, switched_on)
        self._sound, self._sound_ends = 0, switched_on
        self._range: float | None = None
        self._ranges_at = switched_on
        self._rates = (0.0, 0.0)
        self._lit = 0.0
        self._position = build.selector
        self._is_pressed = False
        self._code = (0 if build.has_time_of_flight else 2), 0, 0
        world.set_slot(robot_index, build.slot)

    def advance(self, time: float) -> None:
        """Let the world run to the last whole tick at or before *time*, s since the robot was switched on."""
        self._now = max(self._now, self._switched_on + time)
        if self._build.has_time_of_flight and self._now >= self._ranges_at:
            passed = int((self._now - self._ranges_at) / RANGING_TIME)
            self.world.run_to(self._ranges_at + passed * RANGING_TIME)
            self._range = self.world.distance(self.robot_index)
            self._ranges_at += (passed + 1) * RANGING_TIME
        self.world.run_to(self._now)

    def step(self, left: float, right: float) -> None:
        """Put the wheels where whole steps have brought them; between two calls they turn evenly."""
        self.world.settle(self.robot_index, left * METRES_PER_STEP, right * METRES_PER_STEP, at=self._now)

    def drive(self, left: float, right: float) -> None:
        """Turn the wheels at these step rates from the time of the last :meth:`advance` on, steps/s."""
        # The robot's clock times its motors.
        rim = METRES_PER_STEP * pace(self.world.records.robots[self.robot_index])
        speeds = left * rim, right * rim
        self.world.set_wheel_speeds(self.robot_index, *speeds, at=self._now)
        self._rates = left, right
        self._load()

    def set_defects(self, defects: Sequence[Defect]) -> float:
        """Break these parts of the robot, and mend all others; return how fast its clock goes now."""
        self.world.set_defects(self.robot_index, defects)
        self.drive(*self._rates)
        return float(pace(self.world.records.robots[self.robot_index]))

    def show(self, lights: Lights) -> None:
        """Set all lamps."""
        red = Colour(255, 40, 30)
        ring = [red if lit else Colour(0, 0, 0) for lit in lights.ring]
        for k in range(4):
            parts = lights.rgb[3 * k : 3 * k + 3]
            if any(parts):
                ring[2 * k + 1] = Colour(*((part * 255 + 50) // 100 for part in parts))
        self.world.show(self.robot_index, Lamps(tuple(ring), bool(lights.body), bool(lights.front)))
        self._lit = sum(lights.ring) + sum(lights.rgb) / 100 + lights.body + lights.front
        self._load()

    def play_sound(self, number: int) -> None:
        """Start sound 1..5, or stop with 0; the sound is in the world until it ends."""
        self._sound = number
        self._sound_ends = self._now + self._build.sounds.get(number, 0.0)
        loudness, tone = LOUDNESS if number else 0.0, self._build.tones.get(number, 0.0)
        self.world.play(self.robot_index, loudness, until=self._sound_ends, frequency=tone)

    @property
    def sound(self) -> int:
        """The sound that can be heard now, 1..5, or 0 for silence."""
        return self._sound if self._now < self._sound_ends else 0

    def turn_selector(self, position: int) -> None:
        """Turn the rotary switch.

        Args:
            position: 0..15. The firmwares read it when they are asked, and when they start.

        Raises:
            ArgumentError: There is no such position.
        """
        self._position = Whole(0, 15).require(position, "position", "the selector's ")

    def selector(self) -> int:
        """Return the position of the rotary switch: at first 3 for Bluetooth, or 15 for Wi-Fi."""
        return self._position

    def receive(self, address: int, data: int) -> None:
        """Press a key of a remote control that points at the robot.

        Each press inverts the check bit of its code, so that two presses of a key differ from a long one (RC5).

        Args:
            address: Address of the device that the remote control is for, 0..31.
            data: Number of the key, 0..63 for the e-puck1, 0..127 for the e-puck2 (extended RC5).

        Raises:
            ArgumentError: A number is out of its range.
        """
        last = 127 if self._build.has_time_of_flight else 63
        for name, value, high in (("address", address, 31), ("data", data, last)):
            Whole(0, high).require(value, name)
        self._code = 0 if self._code[0] == 1 else 1, address, data

    def infrared(self) -> tuple[int, int, int]:
        """Return check, address and data of the last code; before the first one 2, 0, 0, e-puck2 0, 0, 0.

        (wire-protocol.md, 2.1)
        """
        return self._code

    def reflected_light(self) -> Sequence[int]:
        """Return ambient minus lit reading of the eight infrared sensors, counts, 0..4095, higher is nearer."""
        return self.world.proximity(self.robot_index)

    def ambient_light(self) -> Sequence[int]:
        """Return the eight readings with the emitters off, counts, 0..4095, higher is darker."""
        return self.world.ambient_light(self.robot_index)

    def acceleration(self) -> Sequence[int]:
        """Return the analog accelerometer: zero at 2048, 800 counts a g (firmware's comments), 0..4095."""
        forward, left, up = self.world.acceleration(self.robot_index)
        scale = ANALOG_GRAVITY / GRAVITY
        return tuple(min(max(MIDDLE + round(scale * value), 0), 4095) for value in (left, forward, up))

    def inertial_acceleration(self) -> Sequence[int]:
        """Return the digital accelerometer in the axes of its chip, 16384 counts a g, 16 bit."""
        values = self.world.acceleration(self.robot_index)
        scale = INERTIAL_GRAVITY / GRAVITY
        return tuple(_word(sign * scale * values[axis]) for sign, axis in self._build.inertial_axes)

    def rotation(self) -> Sequence[int]:
        """Return the gyroscope, counts, z positive to the left; at the end of its range it stays there.

        x and y, which lie as the accelerometer's, are noise and offsets alone, so their signs do not matter.
        """
        rates = *self.world.rocking(self.robot_index), self.world.rotation(self.robot_index)
        scale = math.degrees(self._build.counts_per_degree)
        return tuple(_word(scale * rates[axis]) for _, axis in self._build.inertial_axes)

    def inertial_zeros(self) -> tuple[Sequence[int], Sequence[int]]:
        """Return the readings of a level chip without offsets.

        Tilt and offsets were measured on robots whose firmware had calibrated at its start (measured-robots): they are
        what this leaves.
        """
        level = (0, 0, INERTIAL_GRAVITY)
        return tuple(sign * level[axis] for sign, axis in self._build.inertial_axes), (0, 0, 0)

    def magnetic_field(self) -> Sequence[float]:
        """Return the magnetic field in the robot's axes, microtesla: forward, to the left, up.

        It is measured from the start, as the ICM-20948 does; an MPU-9250 gives zeros until the firmware starts it. No
        source says how the chip's axes lie, so these are the robot's axes.
        """
        heading = self.world.pose(self.robot_index).heading
        forward, left = NORTH * math.sin(heading), NORTH * math.cos(heading)
        xx, xy, yx, yy = self.soft_iron
        bent = xx * forward + xy * left, yx * forward + yy * left, -DOWN
        records = self.world.records
        key, spread = int(records.robots[self.robot_index].key), float(records.setting[0].spread)
        now = tick_key(key, self.world.tick)
        field = []
        for axis, part in enumerate(bent):
            own = MAGNETS[axis] * gauss(key, HARD_IRON + axis) + FIELD_DEVIATION * gauss(now, MAGNETOMETER + axis)
            here, setting = records.robots[self.robot_index], records.setting[0]
            read = spoiled(setting, here, MAGNETOMETER_AT + axis, part + self.hard_iron[axis] + spread * own)
            field.append(round(read / FIELD_STEP) * FIELD_STEP)
        return field

    def temperature(self) -> int:
        """Return the inertial chip's temperature, degrees C."""
        return 25

    def ground(self) -> Sequence[int]:
        """Return three ground sensors, left, centre, right, and the left and right cliff sensor, counts, 0..1000."""
        return self.world.ground(self.robot_index)

    def ground_ambient(self) -> Sequence[int]:
        """Return the same five with their emitters off: hardly any light under the robot, counts."""
        return (15,) * 5

    def microphones(self) -> Sequence[tuple[int, int]]:
        """Return (base level, peak-to-peak volume) of the microphones right, left, rear and front, counts."""
        return tuple((MIDDLE, volume) for volume in self.world.microphones(self.robot_index))

    def microphone_index(self) -> int:
        """Return the slot of the sample ring written next, 0..99: it goes round 164 times a second."""
        return int((self._now - self._switched_on) * MICROPHONE_RATE) % SAMPLES

    def microphone_rings(self) -> Sequence[int]:
        """Return the rings of three microphones as the transmitter reads them while they are filled on, counts."""
        import numpy as np

        numbers = sent_samples((self._now - self._switched_on) * MICROPHONE_RATE, MICROPHONES, SAMPLES)
        since = round(self._switched_on * MICROPHONE_RATE)
        heard = self.world.waveform(self.robot_index, numbers + since)
        return (MIDDLE + np.rint(heard)).clip(0, 4095).astype(int).ravel().tolist()

    @property
    def voltage(self) -> float:
        """Voltage of the battery, V. It falls as motors turn and lamps are lit (``battery``), or as the world says."""
        volts = None if self.volts is None else self.volts()
        if volts is None and self.world.scene.energy is not None:
            return volts_at(self.world.energy(self.robot_index))
        return self._cell.volts(self._now) if volts is None else volts

    def battery(self) -> int:
        """Return the raw reading, counts, on the straight line that the firmware uses through 3.4 V and 4.2 V."""
        low, full = self._build.battery
        return max(0, round(low + (full - low) * (self.voltage - LOW_VOLTS) / (FULL_VOLTS - LOW_VOLTS)))

    def battery_is_low(self) -> bool:
        """Return whether it is below 3.4 V."""
        return self.voltage < LOW_VOLTS

    def distance(self) -> int:
        """Return the time-of-flight distance straight ahead, mm, with the sensor's own bias; 0 without the sensor.

        What it sees nowhere in its reach is 8190. The sensor has a new value every 0.106 s.
        """
        if not self._build.has_time_of_flight:
            return 0
        metres = self.world.distance(self.robot_index) if self._range is None else self._range
        return round(1000 * biased(metres)) if metres < REACH else NO_ECHO

    def press_button(self) -> None:
        """Hold the user button down until :meth:`release_button`."""
        self._is_pressed = True

    def release_button(self) -> None:
        """Release the user button."""
        self._is_pressed = False

    def button_is_pressed(self) -> bool:
        """Return whether the user button is held down."""
        return self._is_pressed

    def has_sd_card(self) -> bool:
        """Return False: the slot is empty."""
        return False

    def picture(self, window: CameraWindow) -> bytes:
        """Take a picture: rows of pixels as the chip delivers them.

        Args:
            window: What the firmware asked the chip for; each pixel is sampled at the centre of its zoom x zoom square.

        Returns:
            Mode 0: one luminance byte a pixel. Mode 1: RGB565, high byte first. Mode 2: luminance and, alternating,
            blue and red difference.
        """
        right, up = _offsets(window, self.mounting)
        pixels = self.world.picture(self.robot_index, right, up, generation=self._build.generation)
        if self.mounting.swaps:  # the chip delivers its own rows
            pixels = pixels.transpose(1, 0, 2)
        raw = _encode(pixels, window.mode)
        row = self.world.broken_row(self.robot_index, len(pixels))
        if row is None:
            return raw
        start, end = (k * len(raw) // len(pixels) for k in (row, row + 1))
        return raw[:start] + raw[start + 1 : end] + raw[start : start + 1] + raw[end:]

    def _load(self) -> None:
        self._cell.load(power_of(self._rates, self._lit), self._now)


def _word(counts: float) -> int:
    """Return *counts* as a chip of 16 bits gives them."""
    return min(max(round(counts), -32768), 32767)


@lru_cache(maxsize=64)
def _offsets(window: CameraWindow, mounting: Mounting) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return where the pixels of the upright picture look, sensor pixels to the right of the axis and above it."""
    across = tuple(window.x + (k + 0.5) * window.zoom - SENSOR_WIDTH / 2 for k in range(window.width))
    down = tuple(window.y + (k + 0.5) * window.zoom - SENSOR_HEIGHT / 2 for k in range(window.height))
    back_across = tuple(-offset for offset in across)
    back_down = tuple(-offset for offset in down)
    # The rows of a chip that is turned a quarter are the picture's columns.
    match mounting:
        case Mounting.UPRIGHT:
            return across, back_down
        case Mounting.HALF:
            return back_across, down
        case Mounting.QUARTER_LEFT:
            return down, across
        case _:
            return back_down, back_across


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
