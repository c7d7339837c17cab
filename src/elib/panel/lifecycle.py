"""What the panel does with a robot: prepare it, drive it and stop it, each within a bounded time."""

from __future__ import annotations

import math

from elib.link.protocol.actuators import ALL
from elib.link.protocol.quantities import CameraMode
from elib.robot.aio import Epuck

PATIENCE = 1.0
"""s that the answer to a command is waited for on a link that is not slow."""
MIN_PATIENCE, TRIPS = 0.2, 4
"""s, and round trips, that the answer to a move of the stick is waited for; the longer of both counts."""
Camera = tuple[int, int, int, CameraMode]
"""Width, height, zoom and mode."""
CAMERA: Camera = (40, 40, 8, CameraMode.GREY)
"""The camera of a robot whose pictures are taken only on request."""
STOP_DELAY = 0.1
"""s that a live picture may hold up a stop at most."""
CAPTURE_TIME = 0.022
"""s from the request until the robot begins to send a picture (docs/reference/wire-protocol.md, 5.13)."""
BITS_PER_BYTE, HEADER = 10, 3
"""Of the serial line; bytes before the pixels of a picture."""
CHIP_WIDTH = 480
"""Pixels of the camera chip across an upright picture: the e-puck1's chip lies on its side."""
MIN_QUARTER, MAX_QUARTER = 3, 10
"""Quarters of a live picture's width, pixels: 12 x 9, which still shows where a wall ends, to 40 x 30."""


def live_camera(baud: int, zooms: tuple[int, ...] | None) -> Camera | None:
    """Return the settings of a live colour camera that holds up no stop for longer than :data:`STOP_DELAY`.

    A stop overtakes all that waits, but a robot that sends a picture hears nothing until the picture has left. A pixel
    in colour is two bytes, and a byte takes 87 us at 115,200 baud: 24 x 18 pixels leave within 0.098 s. A larger
    picture, 40 x 40, would take 0.30 s. On a line that is too slow for any there is none.

    Args:
        baud: Speed of the robot's line, bit/s; 0 for a line that takes no time.
        zooms: The zoom factors that work; None if every factor works.
    """
    quarter = MAX_QUARTER
    if baud:
        pixels = ((STOP_DELAY - CAPTURE_TIME) * baud / BITS_PER_BYTE - HEADER) / 2
        quarter = min(MAX_QUARTER, math.isqrt(int(pixels / 12)))  # 4 wide and 3 high
    if quarter < MIN_QUARTER:
        return None
    # The widest view: all of the chip's width, by a factor that the driver can divide by 4.
    zoom = max(zooms) if zooms else CHIP_WIDTH // (4 * quarter) // 4 * 4
    return 4 * quarter, 3 * quarter, zoom, CameraMode.COLOUR


def patience(robot: Epuck) -> float:
    """Return how long to wait for the answer to a command, s.

    On a slow link that is longer than for a stop alone, because the line may have to come into sync first.
    """
    return max(PATIENCE, 1.5 * robot.session.stopping_time)


async def prepare(robot: Epuck, camera: Camera = CAMERA) -> float:
    """Begin as the joystick of 2011 did: stop, set the camera, switch all lamps off.

    Return the highest speed of the robot's wheels, rev/s. Over Wi-Fi a camera has no settings.
    """
    patient = robot.within(patience(robot))
    await patient.stop()
    if "set_camera" not in robot.context.profile.absent:
        await patient.set_camera(*camera)
    await patient.set_led(ALL, 0)
    await patient.set_body_led(0)
    await patient.set_front_led(0)
    return robot.context.profile.ranges.get("wheel_speed", (-1.0, 1.0))[1]


async def drive(robot: Epuck, left: float, right: float) -> None:
    """Set the wheels, rev/s."""
    trip = robot.statistics.median
    # While a lost answer is waited for, newer speeds wait, too.
    longest = MIN_PATIENCE if math.isnan(trip) else max(MIN_PATIENCE, TRIPS * trip)
    await robot.within(min(longest, robot.session.stopping_time)).set_speed(left, right)


async def stop(robot: Epuck) -> None:
    """Stop the robot, past all commands that wait."""
    await robot.within(patience(robot)).stop()
