"""Follow a ball of one colour with the camera, at a distance, and search for it if it is out of sight."""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, Annotated, NamedTuple

from elib.base.body import AXLE, WHEEL_CIRCUMFERENCE
from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.behaviours._run.loop import SETUP_TIMEOUT
from elib.behaviours.avoid import STANDING, avoid
from elib.behaviours.braitenberg import add_avoidance
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import Proximity, Wheels
from elib.robot.aio import Epuck

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray


class Hue(enum.IntEnum):
    """Colours of balls: their hue, degrees."""

    RED = 0
    ORANGE = 27
    YELLOW = 50
    GREEN = 125
    BLUE = 215


class Ball(NamedTuple):
    """The position of a ball.

    Attributes:
        bearing: Direction as seen from the camera, rad, positive to the left.
        distance: Distance from the camera to the ball's centre, m.
        is_cut: One edge of the picture cuts the ball off: it is further to this side, and nearer, than it seems.
    """

    bearing: float
    distance: float
    is_cut: bool = False


Colour = Annotated[Hue, Quantity("colour", "", 0, 359, names=Hue)]
Gap = Annotated[float, Quantity("distance", "m", 0.1, 0.5, scale=1e6)]
Diameter = Annotated[float, Quantity("diameter", "m", 0.02, 0.25, scale=1e6)]
Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 1.0, scale=1000)]

COLUMNS, ROWS, ZOOM = 60, 12, 8
"""The picture: as wide as every firmware can take it, and a strip along the horizon, where balls are and painted floors
are not. It takes 0.13 s over the wire."""
FOCAL = 602 / ZOOM
"""Focal length, pixels of the picture: 56 degrees over 640 columns of the chip (epucklib; e-puck.md, 8)."""
TOLERANCE = 12
"""Degrees of hue by which the same colour may differ; from orange to yellow, and to red, it is twice as far."""
VIVID = 0.45
"""Saturation below which a colour is grey."""
BRIGHT = 48
"""Brightness, of 255, below which a colour is black."""
FEWEST = 4
"""Pixels that may be noise; a ball has more of them in neighbouring columns."""
TURNING, NEARING = 1.5, 0.8
"""Gains: rad/s for each rad that the ball is aside, and m/s for each m that it is too far away."""
MAX_CORRECTION = 0.5
"""Part of the error that is corrected until the next picture, at most: the robot never turns past the ball on a slow
link."""
MAX_TURN = math.radians(25)
"""Largest turn from one picture to the next while the robot searches for the ball: half of the angle of view."""
SPIN = 0.25
"""Largest wheel speed of a turn on the spot, rev/s."""
DETOUR = 2.0
"""s that the robot drives past an obstacle before it looks for the ball again: 6 cm."""
WANDERING = 3.0
"""s that the robot wanders if it has made a whole turn without seeing the ball."""
PERIOD = 0.2
"""s between two pictures if the link is quick."""


def coloured(pixels: NDArray[numpy.uint8], hue: int) -> NDArray[numpy.bool_]:
    """Return which pixels have this hue, degrees, within :data:`TOLERANCE`, and are neither grey nor black."""
    import numpy as np

    red, green, blue = (pixels[:, :, channel].astype(float) for channel in range(3))
    high, low = pixels.max(axis=2).astype(float), pixels.min(axis=2).astype(float)
    angle = np.degrees(np.arctan2(math.sqrt(3) * (green - blue), 2 * red - green - blue))
    off = np.abs((angle - hue + 180) % 360 - 180)
    found: NDArray[numpy.bool_] = (high >= BRIGHT) & (high - low >= VIVID * high) & (off <= TOLERANCE)
    return found


def find_ball(pixels: NDArray[numpy.uint8], hue: int = Hue.ORANGE, *, diameter: float = 0.065) -> Ball | None:
    """Return the position of the ball with the most pixels in a picture, or None if there is no ball.

    Args:
        pixels: A picture of shape (height, width, 3) in red, green, blue, taken at zoom 8.
        hue: Hue of the ball, degrees.
        diameter: Diameter of the ball, m; with its apparent width, it gives the distance.
    """
    counts = coloured(pixels, hue).sum(axis=0)
    width = len(counts)
    first, last = 0, -1  # of the run with most pixels
    start = most = here = 0
    for column in range(width):
        if not counts[column]:
            start, here = column + 1, 0
            continue
        here += int(counts[column])
        if here > most:
            first, last, most = start, column, here
    if most <= FEWEST:
        return None
    left, right = (math.atan((width / 2 - edge) / FOCAL) for edge in (first, last + 1))
    is_cut = (first == 0) != (last == width - 1)
    return Ball((left + right) / 2, diameter / 2 / math.sin((left - right) / 2), is_cut)


def approach(ball: Ball, *, distance: float = 0.15, cruise: float = 0.6, gap: float = PERIOD) -> Wheels:
    """Return the speeds that turn the robot to a ball and bring it to a distance from it, backwards if necessary.

    Args:
        ball: The position of the ball.
        distance: Distance at which to follow, m.
        cruise: Largest speed of the wheels, rev/s.
        gap: Time until the next picture, s.
    """
    turn = min(TURNING, MAX_CORRECTION / gap) * ball.bearing * AXLE / 2 / WHEEL_CIRCUMFERENCE
    ahead = (
        min(NEARING, MAX_CORRECTION / gap)
        * (ball.distance - distance)
        / WHEEL_CIRCUMFERENCE
        * max(0.0, math.cos(2 * ball.bearing))
    )
    if ball.is_cut:
        ahead = min(0.0, ahead)
    turn = max(-cruise, min(cruise, turn))
    ahead = max(abs(turn) - cruise, min(cruise - abs(turn), ahead))
    return Wheels(ahead - turn, ahead + turn)


@behaviour(world="soccer", reconnects=True, group="vehicles")
async def follow(
    robot: Epuck,
    run: RunContext,
    *,
    colour: Colour = Hue.ORANGE,
    distance: Gap = 0.15,
    diameter: Diameter = 0.065,
    cruise: Cruise = 0.6,
) -> None:
    """Follow a ball with the camera, at a distance; if it is out of sight, look round and search for it.

    Args:
        robot: The robot to drive.
        run: The run.
        colour: Colour of the ball.
        distance: Distance at which to follow, from the camera to the ball's centre.
        diameter: Diameter of the ball.
        cruise: Largest speed of the wheels.
    """
    wheels, pictured = STANDING, robot.time
    side, turned, wanders_until = 1.0, 0.0, -math.inf

    async def set_up(view: Epuck) -> bool:
        await view.set_camera(COLUMNS, ROWS, ZOOM, CameraMode.COLOUR)
        return True

    async def step(view: Epuck) -> None:
        nonlocal wheels
        before, wheels = wheels, STANDING  # after a lost answer the robot stands
        near = await view.proximity()
        if robot.time < wanders_until:
            wheels = avoid(near, before, cruise=min(cruise, SPIN))
        else:
            wheels = await choose_speeds(view, near, before)
        await view.set_speed(wheels.left, wheels.right)

    async def choose_speeds(view: Epuck, near: Proximity, before: Wheels) -> Wheels:
        nonlocal pictured, side, turned, wanders_until
        picture = await view.image()
        gap, pictured = max(PERIOD, robot.time - pictured), robot.time
        ball = find_ball(picture.pixels, colour, diameter=diameter)
        if ball is not None:
            run.state("following")
            side, turned = math.copysign(1.0, ball.bearing), 0.0
            chosen = approach(ball, distance=distance, cruise=cruise, gap=gap)
            if min(chosen) > 0 and min(chosen := add_avoidance(chosen, near, before)) < 0:
                run.state("going-round")  # something stands in the way
                wanders_until = robot.time + DETOUR
            return chosen
        if turned < math.tau:
            run.state("looking-round")
            spin = min(SPIN, MAX_TURN / gap * AXLE / 2 / WHEEL_CIRCUMFERENCE)
            turned += gap * spin * WHEEL_CIRCUMFERENCE / (AXLE / 2)
            return Wheels(-side * spin, side * spin)
        run.say(f"nothing {colour.name.lower()} in sight")
        run.state("searching")
        wanders_until = robot.time + WANDERING
        side, turned = run.random.choice((-1.0, 1.0)), 0.0
        return STANDING

    await react(robot, set_up, min_timeout=SETUP_TIMEOUT)
    await react(robot, step, period=PERIOD)
