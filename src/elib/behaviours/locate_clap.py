"""Turn towards a sound: where it comes from follows from how loud each microphone hears it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.robot.aio import Epuck


class Sound(NamedTuple):
    """What was heard.

    Attributes:
        bearing: Where it comes from, rad, positive to the left.
        volume: How loud it is in the middle of the robot, counts peak to peak.
    """

    bearing: float
    volume: float


Threshold = Annotated[int, Quantity("threshold", "counts", 15, 2000)]

FACING = tuple(math.atan2(y, x) for x, y in ((8.4, -30.3), (8.4, 30.3), (-23.1, 0.0), (31.9, 3.8)))
"""Where the microphones face, right, left, rear and, on the e-puck2, front: away from the middle of the robot, by their
places on its board, mm (EPFL's course MICRO-315; robot-model, 2.7). The e-puck1's three lie about there."""
READINGS = 5
"""Readings of one sound that are added up: the noise of its direction is then less than half."""
STRAIGHT = math.radians(10)
"""What comes from no further aside is in front. More than the noise of the direction, or the robot would never rest."""
SAME = 1.0
"""s after a turn within which what is heard is the same sound still, and the turn was too far or too short. Beside the
source the microphones' own distances from it count, and the direction seems further aside than it is: so the robot
makes good half of what is wrong."""
SILENCE = 5.0
"""s without a sound after which the robot says that there is none."""
PERIOD = 0.05
"""s between two readings where the link is quick. Each tells of the last 6 to 10 ms alone, so a single clap may fall
between two of them; its echo in a room lasts longer (robot-model, 2.7)."""


def locate(volumes: Sequence[float]) -> Sound:
    """Return where a sound comes from, given how loud three or four microphones hear it, counts.

    Whatever a body's shade may be, to the first order a microphone that faces the source hears the most, and the
    others less with the cosine of the angle: v = volume + c cos(bearing - facing). Least squares give what fits best.

    Args:
        volumes: Right, left, rear and perhaps front, counts peak to peak, the noise of the room among it.
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


@behaviour(world="beeper", reconnects=True)
async def listen(robot: Epuck, run: RunContext, *, threshold: Threshold = 30) -> None:
    """Listen, and turn towards whatever is heard: a clap, a voice, a beeper.

    Args:
        robot: The robot to turn. It listens while it stands, for its motors are loud.
        run: Where it performs.
        threshold: Volume from which a sound counts. A quiet room reads 6 to 17.
    """
    heard: list[Sequence[int]] = []
    quiet_since, turned_at = robot.time, -math.inf

    async def step(eyes: Epuck) -> None:
        nonlocal quiet_since, turned_at
        volumes = await eyes.microphones()
        if max(volumes) >= threshold:
            heard.append(volumes)
            if len(heard) < READINGS:
                return
        elif not heard:
            if robot.time - quiet_since > SILENCE:
                run.say(f"nothing to hear: {max(volumes)} counts at most, and {threshold} would be a sound")
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
            is_same = robot.time - turned_at < SAME
            await robot.turn(sound.bearing / 2 if is_same else sound.bearing)
            turned_at = robot.time
        run.state("facing")

    run.state("listening")
    await react(robot, step, period=PERIOD)
