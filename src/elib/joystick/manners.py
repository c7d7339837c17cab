"""How the panel treats a robot: its greeting, its parting, and how long a turn of the stick and a stop may take."""

from __future__ import annotations

import math
from collections.abc import Callable

from elib.protocol.actuators import ALL
from elib.protocol.quantities import CameraMode
from elib.robot.aio import Epuck

PATIENCE = 1.0
"""s that a turn of the stick is waited for at most."""
LEAST_PATIENCE, TRIPS = 0.2, 4
"""s, and round trips, that the answer to a turn of the stick is waited for; the more of both counts."""
STANDING_TIME, LONGEST_STANDING_TIME = 0.4, 2.0
"""s that a stop may take, then it is repeated; on a slow link some round trips, and the second at most."""
CAMERA = (40, 40, 8, CameraMode.GREY)
"""Width, height, zoom and mode at the beginning."""


async def greet(robot: Epuck) -> float:
    """Begin as the joystick of 2011 did: stop, set the camera, all lamps off.

    Returns:
        The robot's fastest wheel speed, rev/s.

    Raises:
        ElibError: The robot did not do it.
    """
    await robot.stop()
    await robot.set_camera(*CAMERA)
    await robot.set_led(ALL, 0)
    await robot.set_body_led(0)
    await robot.set_front_led(0)
    return robot.context.profile.ranges.get("wheel_speed", (-1.0, 1.0))[1]


async def part(robot: Epuck, complain: Callable[[str], object]) -> bool:
    """Stop *robot* and close its link.

    Args:
        robot: An open robot.
        complain: Called with what went wrong.

    Returns:
        Whether it has confirmed that it stands.
    """
    error = await robot.stop_and_close()
    if error is not None:
        complain(error.message)
    return error is None


async def drive(robot: Epuck, left: float, right: float) -> None:
    """Set the wheels, rev/s."""
    trip = robot.statistics.median
    # A lost answer holds up the stop behind it for as long as it is waited for.
    patience = LEAST_PATIENCE if math.isnan(trip) else max(LEAST_PATIENCE, min(PATIENCE, TRIPS * trip))
    await robot.within(patience).set_speed(left, right)


async def stop(robot: Epuck) -> None:
    """Stop the robot, past all that waits."""
    trip = robot.statistics.median
    patience = STANDING_TIME if math.isnan(trip) else max(STANDING_TIME, TRIPS * trip)
    await robot.within(min(patience, LONGEST_STANDING_TIME)).stop()


__all__ = ["drive", "greet", "part", "stop"]
