"""The e-puck's body in numbers: wheels, axle, step rates, and where its infrared sensors and microphones are.

Sources are gathered in e-puck.md: e-puck.org, the thesis of 2011 and the firmware.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, TypeVar

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray

Count = TypeVar("Count", int, float, "NDArray[float64]")

WHEEL_DIAMETER: Final = 0.041
"""m. e-puck.org, the thesis and ARGoS; one motor step of 1/1000 turn is 0.1288 mm."""

AXLE: Final = 0.053
"""Distance of the wheels' contact points, m. e-puck.org; the firmware's own 1300 steps a turn on the spot
give 53.3 mm."""

WHEEL_SPREAD: Final = 0.005
"""Relative standard deviation of the radii of real robots' wheels: 0.003 to 0.005 in the thesis of 2011; four robots in
which errors of time take part had 0.03 (measured-robots: motion.track_calibration)."""

AXLE_SPREAD: Final = 0.007
"""The same of their axles (measured-robots: motion.steps_for_a_turn_on_the_spot)."""

STEPS_PER_REVOLUTION: Final = 1000
"""Motor steps for one turn of a wheel: 20 steps a turn of the motor, times the gear's 50 (wire-protocol.md, 5.1)."""

METRES_PER_STEP: Final = math.pi * WHEEL_DIAMETER / STEPS_PER_REVOLUTION
"""0.1288 mm of the nominal wheel's rim."""

WHEEL_CIRCUMFERENCE: Final = STEPS_PER_REVOLUTION * METRES_PER_STEP
"""m that a wheel rolls in one turn."""

FASTEST: Final = 1000
"""steps/s. The e-puck1's firmware clips there (wire-protocol.md, 5.1)."""

FASTEST_2: Final = 1100
"""steps/s. The e-puck2's firmware clips there (wire-protocol.md, 5.1)."""

MOTOR_TIMER: Final = 100.03e-6
"""s. A tick of the e-puck1's motor timer, nominally 0.1 ms (wire-protocol.md, 5.1)."""

MOTOR_FREQUENCY: Final = 100_000
"""Hz. The e-puck2's motor timer; it makes two microsteps a step (wire-protocol.md, 5.1)."""

RADIUS: Final = 0.037
"""Collision radius, m. Webots and Enki agree; the printed 35 mm leaves out the ring."""

SENSOR_RADIUS: Final = 0.035
"""Distance of the infrared sensors from the axis, m: on the edge of the base plate (Player, epuck_ros2)."""

SENSOR_DIRECTIONS: Final = tuple(
    math.radians(angle) for angle in (-17.2, -45.9, -90.0, -151.5, 151.5, 90.0, 45.9, 17.2)
)
"""Where the eight infrared sensors look, clockwise from the front right, rad from straight ahead, positive to the left.
Webots' directions, which agree with Enki's and Player's within 4 degrees (side and front) and 10 degrees (rear); left
and right are mirrored (e-puck.md, 2)."""

CHIP: Final = (640, 480)
"""Columns and rows of the camera's chip (wire-protocol.md, 5.8)."""

FOCAL: Final = CHIP[0] / 2 / math.tan(math.radians(47.0) / 2)
"""Focal length of the camera, pixels of its chip: its 640 columns see 47 degrees, give or take 2
(measured-robots: camera.focal_length)."""

LENS: Final = 0.030
"""m from the axle ahead to the lens of the camera (Webots)."""

GROUND_SENSORS: Final = ((0.030, 0.009), (0.030, 0.0), (0.030, -0.009), (0.022, 0.026), (0.022, -0.026))
"""Places of the ground sensors left, centre and right (ARGoS, epuck_ros2), then of the cliff sensors left and right, m,
x forward and y to the left. No source gives those of the latter: under the edge of the body at 50 degrees, so that they
meet the edge of a table before a wheel does."""

MICROPHONES: Final = ((0.0084, -0.0303), (0.0084, 0.0303), (-0.0231, 0.0), (0.0319, 0.0038))
"""Places of the microphones right, left, rear and front, m, x forward and y to the left: those of the e-puck2's board
(EPFL's course MICRO-315). The e-puck1 has the first three, at about the same places (e-puck.md, 7)."""

MICROPHONE_DIRECTIONS: Final = tuple(math.atan2(y, x) for x, y in MICROPHONES)
"""Where they face, away from the middle of the robot, rad from straight ahead, positive to the left."""

MICROPHONE_RATE: Final = 16384
"""Samples a second that an e-puck1 takes of each microphone (wire-protocol.md, 5.6)."""


def camera_view(columns: int, zoom: int) -> float:
    """Return the angle that a picture shows from left to right, rad: 24.5 degrees in 40 columns at zoom 8.

    Args:
        columns: How many columns the picture has.
        zoom: Pixels of the chip for one of the picture.
    """
    return 2 * math.atan(columns * zoom / 2 / FOCAL)


def wrapped(count: Count, bits: int = 16) -> Count:
    """Return *count*, or a difference of two counts, as a signed counter holds it: -32768 to 32767 with 16 bits.

    Args:
        count: A number, or an array of numbers.
        bits: Width of the counter.
    """
    half = 1 << (bits - 1)
    return (count + half) % (2 * half) - half


def step_period(speed: int, generation: int) -> int:
    """Return how many ticks of the motor's timer pass between two steps, on the e-puck2 between two microsteps.

    Args:
        speed: As the motor's driver accepted it, steps/s, not 0.
        generation: 1, or 2 for the e-puck2.
    """
    if generation == 1:
        return 10_000 // abs(speed)
    return MOTOR_FREQUENCY // (2 * abs(speed))


def step_rate(speed: float, generation: int) -> float:
    """Return the step rate that the firmware makes of a wanted speed, steps/s.

    e-puck1: clipped to 1000 and stepped every int(10000 / speed) ticks of 100.03 us, so 600 becomes 625 and 900
    becomes 909 (less 0.03 %). e-puck2: clipped to 1100, a half step every int(100000 / (2 speed)) ticks of 10 us.

    Args:
        speed: As asked for, steps/s; the fraction is cut off, as in the command. What is not a number stands for 0.
        generation: 1, or 2 for the e-puck2.
    """
    if not abs(speed) >= 1.0:
        return 0.0
    period = step_period(int(min(abs(speed), FASTEST if generation == 1 else FASTEST_2)), generation)
    rate = 1.0 / (period * MOTOR_TIMER) if generation == 1 else MOTOR_FREQUENCY / (2 * period)
    return rate if speed > 0.0 else -rate
