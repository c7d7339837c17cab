"""Turn towards a sound, whose direction follows from how loud it is at each microphone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.robot.aio import Epuck


class Sound(NamedTuple):
    """A sound.

    Attributes:
        bearing: Direction from which it comes, rad, positive to the left.
        volume: How loud it is at the robot's centre, counts peak to peak.
    """

    bearing: float
    volume: float


Threshold = Annotated[int, Quantity("threshold", "counts", 15, 2000)]

FACING = tuple(math.atan2(y, x) for x, y in ((8.4, -30.3), (8.4, 30.3), (-23.1, 0.0), (31.9, 3.8)))
"""Directions in which the microphones face, right, left, rear and, on the e-puck2, front: away from the robot's centre.
From their positions on the board, mm (EPFL's course MICRO-315; e-puck.md, 7); those of the e-puck1 are about the
same."""
READINGS = 5
"""Readings of one sound that are averaged: the noise of its direction is then less than half."""
STRAIGHT = math.radians(10)
"""Directions up to this are in front. It is more than the noise of the direction, or the robot would never rest."""
SAME_SOUND = 1.0
"""s after a turn within which a sound is still the same, and the turn was too far or too short. Near the source, each
microphone's own distance from it counts, and the direction seems further aside than it is; so the robot corrects half
of the error."""
SILENCE = 5.0
"""s without a sound after which the user is told."""
PERIOD = 0.05
"""s between two readings if the link is quick. Each covers only the last 6 to 10 ms, so a single clap may fall between
two of them; its echo in a room lasts longer (e-puck.md, 7)."""


def locate(volumes: Sequence[float]) -> Sound:
    """Return the sound that three or four microphones hear.

    To the first order, a microphone that faces the source hears the most, and the others less with the cosine of the
    angle: v = volume + c cos(bearing - facing), whatever the exact shadow of the body is. Least squares give the best
    fit.

    Args:
        volumes: Right, left, rear and perhaps front, counts peak to peak, with the noise of the room.
    """
    towards = [(math.cos(angle), math.sin(angle)) for angle in FACING[: len(volumes)]]
    count = len(towards)
    mean_x, mean_y = (sum(axis) / count for axis in zip(*towards, strict=True))
    mean = sum(volumes) / count
    xx = xy = yy = xv = yv = 0.0
    for volume, (x, y) in zip(volumes, towards, strict=True):
        dx, dy, dv = x - mean_x, y - mean_y, volume - mean
        xx, xy, yy, xv, yv = xx + dx * dx, xy + dx * dy, yy + dy * dy, xv + dx * dv, yv + dy * dv
    determinant = xx * yy - xy * xy
    ahead, leftward = (yy * xv - xy * yv) / determinant, (xx * yv - xy * xv) / determinant
    return Sound(math.atan2(leftward, ahead), mean - ahead * mean_x - leftward * mean_y)


@behaviour(world="beeper", reconnects=True, group="vehicles")
async def listen(robot: Epuck, run: RunContext, *, threshold: Threshold = 30) -> None:
    """Listen, and turn towards any sound: a clap, a voice, a beeper.

    Args:
        robot: The robot to turn. It listens while it stands, because its motors are loud.
        run: The run.
        threshold: Least volume of a sound. A quiet room reads 6 to 17.
    """
    heard: list[Sequence[int]] = []
    quiet_since, turned_at = robot.time, -math.inf

    async def step(view: Epuck) -> None:
        nonlocal quiet_since, turned_at
        volumes = await view.microphones()
        if max(volumes) >= threshold:
            heard.append(volumes)
            if len(heard) < READINGS:
                return
        elif not heard:
            if robot.time - quiet_since > SILENCE:
                run.say(f"no sound: at most {max(volumes)} counts, and a sound has {threshold} or more")
                run.state("listening")
                quiet_since = math.inf
            return
        sound = locate([sum(each) / len(heard) for each in zip(*heard, strict=True)])
        heard.clear()
        quiet_since = robot.time
        if abs(sound.bearing) > STRAIGHT:
            run.state("turning")
            aside = "left" if sound.bearing > 0 else "right"
            run.say(
                f"a sound of {sound.volume:.0f} counts, {abs(math.degrees(sound.bearing)):.0f} degrees to the {aside}"
            )
            is_same = robot.time - turned_at < SAME_SOUND
            await robot.turn(sound.bearing / 2 if is_same else sound.bearing)
            turned_at = robot.time
        run.state("facing")

    run.state("listening")
    await react(robot, step, period=PERIOD)
