"""Follow a ball of one colour with the camera, at a distance, and search for it if it is out of sight."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from elib.base.body import AXLE, WHEEL_CIRCUMFERENCE, camera_view
from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, react
from elib.behaviours._run.loop import SETUP_TIMEOUT
from elib.behaviours.avoid import STANDING, avoid
from elib.behaviours.braitenberg import add_avoidance
from elib.link.protocol.colours import Hue
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import Proximity, Wheels
from elib.robot.aio import Epuck


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
are not. It takes 0.13 s over the wire; the e-puck2 needs twice as many columns and shows half as many rows."""
FEWEST = 0.015
"""Share of the strip that a ball takes at least; less may be noise."""
TURNING, NEARING = 1.5, 0.8
"""Gains: rad/s for each rad that the ball is aside, and m/s for each m that it is too far away."""
MAX_CORRECTION = 0.5
"""Part of the error that is corrected until the next picture, at most: the robot never turns past the ball on a slow
link."""
MAX_TURN = camera_view(COLUMNS, ZOOM) / 2
"""Largest turn from one picture to the next while the robot searches for the ball: half of the angle of view."""
SPIN = 0.25
"""Largest wheel speed of a turn on the spot, rev/s."""
DETOUR = 2.0
"""s that the robot drives past an obstacle before it looks for the ball again: 6 cm."""
WANDERING = 3.0
"""s that the robot wanders if it has made a whole turn without seeing the ball."""
PERIOD = 0.2
"""s between two pictures if the link is quick."""


def find_ball(picture: Image, hue: Hue = Hue.ORANGE, *, diameter: float = 0.065) -> Ball | None:
    """Return the position of the largest ball of a colour along the horizon of a picture, or None if there is none.

    Args:
        picture: In colour.
        hue: Hue of the ball.
        diameter: Diameter of the ball, m; with its apparent width, it gives the distance.
    """
    half = max(ROWS * ZOOM // picture.zoom, ROWS) // 2
    middle = picture.height // 2
    found = picture.blobs(hue, smallest=FEWEST, rows=slice(max(0, middle - half), middle + half))
    if not found:
        return None
    blob = found[0]
    is_cut = (blob.left == 0) != (blob.right == picture.width - 1)
    return Ball(picture.bearing(blob.left - 0.5) - blob.width / 2, diameter / 2 / math.sin(blob.width / 2), is_cut)


def approach(ball: Ball, *, distance: float = 0.15, cruise: float = 0.6, gap: float = PERIOD) -> Wheels:
    """Return the speeds that turn the robot to a ball and bring it to a distance from it, backwards if necessary.

    Args:
        ball: The position of the ball.
        distance: Distance at which to follow, m.
        cruise: Largest speed of the wheels, rev/s.
        gap: Time until the next picture, s.
    """
    # Of a ball that is cut off about half is seen: at 9 cm, nearly as wide as the picture, it is never seen whole.
    bearing = 2 * ball.bearing if ball.is_cut else ball.bearing
    turn = min(TURNING, MAX_CORRECTION / gap) * bearing * AXLE / 2 / WHEEL_CIRCUMFERENCE
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
    wheels, pictured, open_air = STANDING, robot.time, OpenAir()
    side, turned, wanders_until = 1.0, 0.0, -math.inf

    async def set_up(view: Epuck) -> bool:
        await view.set_camera(COLUMNS, ROWS, ZOOM, CameraMode.COLOUR)
        zoom = (await view.image()).zoom
        if zoom != ZOOM:  # the e-puck2 takes 8 as 4; twice the bytes would not come within a step's timeout
            await view.set_camera(COLUMNS * ZOOM // zoom, ROWS * zoom // ZOOM, ZOOM, CameraMode.COLOUR)
        return True

    async def step(view: Epuck) -> None:
        nonlocal wheels
        before, wheels = wheels, STANDING  # after a lost answer the robot stands
        near = open_air(await view.proximity())
        if robot.time < wanders_until:
            wheels = avoid(near, before, cruise=min(cruise, SPIN))
        else:
            wheels = await choose_speeds(view, near, before)
        await view.set_speed(wheels.left, wheels.right)

    async def choose_speeds(view: Epuck, near: Proximity, before: Wheels) -> Wheels:
        nonlocal pictured, side, turned, wanders_until
        picture = await view.image()
        gap, pictured = max(PERIOD, robot.time - pictured), robot.time
        ball = find_ball(picture, colour, diameter=diameter)
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
