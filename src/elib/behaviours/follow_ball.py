"""Follow a ball of one colour with the camera, at a distance; look for it where it is out of sight."""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, Annotated, NamedTuple

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.behaviours._run.loop import SETUP_TIMEOUT
from elib.behaviours.avoid import STANDING, avoid
from elib.behaviours.braitenberg import keep_off
from elib.body import AXLE, METRES_PER_STEP, STEPS_PER_REVOLUTION
from elib.protocol.quantities import CameraMode
from elib.protocol.values import Proximity, Wheels
from elib.robot.aio import Epuck

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray


class Hue(enum.IntEnum):
    """Colours of balls, by their hue in degrees."""

    RED = 0
    ORANGE = 27
    YELLOW = 50
    GREEN = 125
    BLUE = 215


class Ball(NamedTuple):
    """Where a ball is.

    Attributes:
        bearing: From where the robot looks, rad, positive to the left.
        distance: From the camera to its middle, m.
        is_cut: It reaches beyond the picture on one side: it is further aside, and nearer.
    """

    bearing: float
    distance: float
    is_cut: bool = False


Colour = Annotated[Hue, Quantity("colour", "", 0, 359, names=Hue)]
Gap = Annotated[float, Quantity("distance", "m", 0.1, 0.5, scale=1e6)]
Diameter = Annotated[float, Quantity("diameter", "m", 0.02, 0.25, scale=1e6)]
Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 1.0, scale=1000)]

COLUMNS, ROWS, ZOOM = 60, 12, 8
"""The picture: as wide as every firmware's camera takes it, and a strip along the horizon, where balls are and painted
floors are not. It takes 0.13 s over the wire."""
FOCAL = 602 / ZOOM
"""Focal length, pixels of the picture: 56 degrees over 640 columns of the chip (epucklib; robot-model, 2.8)."""
TOLERANCE = 12
"""Degrees of hue that are still the same colour: from orange to yellow, and to red, it is twice as far."""
VIVID = 0.45
"""Saturation below which a colour is grey."""
BRIGHT = 48
"""Brightness, of 255, below which a colour is black."""
FEWEST = 4
"""Pixels that may be noise: at least more of them, on top of each other or side by side, are a ball."""
TURNING, NEARING = 1.5, 0.8
"""Speeds for what is wrong: rad/s for each rad that the ball lies aside, m/s for each m that it is too far."""
HASTE = 0.5
"""Part of what is wrong that is made good until the next picture, at most: no ball is turned past on a slow link."""
LOOK = math.radians(25)
"""Furthest turn from one picture to the next while the robot looks for the ball: half of what the picture shows."""
SPIN = 0.25
"""Wheel speed at most of a turn on the spot, rev/s."""
DETOUR = 2.0
"""s that the robot drives on past something in its way before it looks for the ball again: 6 cm."""
WALK = 3.0
"""s that the robot wanders on if it has turned right round without seeing the ball."""
RIM = STEPS_PER_REVOLUTION * METRES_PER_STEP
"""m that a wheel rolls in one turn."""
PERIOD = 0.2
"""s between two pictures where the link is quick."""


def coloured(pixels: NDArray[numpy.uint8], hue: int) -> NDArray[numpy.bool_]:
    """Return which pixels have a hue, degrees, give or take :data:`TOLERANCE`, and are neither grey nor black."""
    import numpy as np

    red, green, blue = (pixels[:, :, channel].astype(float) for channel in range(3))
    high, low = pixels.max(axis=2).astype(float), pixels.min(axis=2).astype(float)
    angle = np.degrees(np.arctan2(math.sqrt(3) * (green - blue), 2 * red - green - blue))
    off = np.abs((angle - hue + 180) % 360 - 180)
    found: NDArray[numpy.bool_] = (high >= BRIGHT) & (high - low >= VIVID * high) & (off <= TOLERANCE)
    return found


def find_ball(pixels: NDArray[numpy.uint8], hue: int = Hue.ORANGE, *, diameter: float = 0.065) -> Ball | None:
    """Return where the ball is that takes most columns of a picture, or None where there is none.

    Args:
        pixels: A picture of shape (height, width, 3) in red, green, blue, taken at zoom 8.
        hue: Of the ball, degrees.
        diameter: Of the ball, m: its distance follows from how wide it seems.
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
    """Return the speeds that turn the robot to a ball and bring it to a distance from it, backwards if need be.

    Args:
        ball: Where it is.
        distance: At which to follow it, m.
        cruise: Speed of the wheels at most, rev/s.
        gap: Until the next picture, s.
    """
    turn = min(TURNING, HASTE / gap) * ball.bearing * AXLE / 2 / RIM
    ahead = min(NEARING, HASTE / gap) * (ball.distance - distance) / RIM * max(0.0, math.cos(2 * ball.bearing))
    if ball.is_cut:
        ahead = min(0.0, ahead)
    turn = max(-cruise, min(cruise, turn))
    ahead = max(abs(turn) - cruise, min(cruise - abs(turn), ahead))
    return Wheels(ahead - turn, ahead + turn)


@behaviour(world="soccer", reconnects=True)
async def follow(
    robot: Epuck,
    run: RunContext,
    *,
    colour: Colour = Hue.ORANGE,
    distance: Gap = 0.15,
    diameter: Diameter = 0.065,
    cruise: Cruise = 0.6,
) -> None:
    """Follow a ball with the camera, at a distance; where it is out of sight, look round and search for it.

    Args:
        robot: The robot to drive.
        run: Where it performs.
        colour: Of the ball.
        distance: At which to follow it, from the camera to its middle.
        diameter: Of the ball.
        cruise: Speed of the wheels at most.
    """
    wheels, looked = STANDING, robot.time
    side, turned, walks_until = 1.0, 0.0, -math.inf

    async def set_up(eyes: Epuck) -> bool:
        await eyes.set_camera(COLUMNS, ROWS, ZOOM, CameraMode.COLOUR)
        return True

    async def step(eyes: Epuck) -> None:
        nonlocal wheels
        before, wheels = wheels, STANDING  # after a lost answer it stands
        near = await eyes.proximity()
        if robot.time < walks_until:
            wheels = avoid(near, before, cruise=min(cruise, SPIN))
        else:
            wheels = await look(eyes, near, before)
        await eyes.set_speed(wheels.left, wheels.right)

    async def look(eyes: Epuck, near: Proximity, before: Wheels) -> Wheels:
        nonlocal looked, side, turned, walks_until
        picture = await eyes.image()
        gap, looked = max(PERIOD, robot.time - looked), robot.time
        ball = find_ball(picture.pixels, colour, diameter=diameter)
        if ball is not None:
            run.state("following")
            side, turned = math.copysign(1.0, ball.bearing), 0.0
            chosen = approach(ball, distance=distance, cruise=cruise, gap=gap)
            if min(chosen) > 0 and min(chosen := keep_off(chosen, near, before)) < 0:
                run.state("going-round")  # something stands in the way
                walks_until = robot.time + DETOUR
            return chosen
        if turned < math.tau:
            run.state("looking-round")
            spin = min(SPIN, LOOK / gap * AXLE / 2 / RIM)
            turned += gap * spin * RIM / (AXLE / 2)
            return Wheels(-side * spin, side * spin)
        run.say(f"nothing {colour.name.lower()} in sight")
        run.state("searching")
        walks_until = robot.time + WALK
        side, turned = run.random.choice((-1.0, 1.0)), 0.0
        return STANDING

    await react(robot, set_up, min_timeout=SETUP_TIMEOUT)
    await react(robot, step, period=PERIOD)
