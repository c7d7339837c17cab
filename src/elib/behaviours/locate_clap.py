"""Turn towards a sound, whose direction follows from how loud it is at each microphone.

A bare e-puck hears directions only roughly: to some 20 degrees half a metre away, and often not at all a metre away
(:attr:`elib.Microphones.direction`). Where the microphones do not tell, the robot stays and says so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.link.protocol.values import UNCLEAR, locate_sound
from elib.robot.aio import Epuck

Threshold = Annotated[int, Quantity("threshold", "counts", 15, 2000)]

READINGS = 10
"""Readings of one sound that are averaged: the noise of its direction is then a third. What remains is that the
microphones are not equally loud."""
STRAIGHT = math.radians(20)
"""Directions up to this are in front. It is three times the noise of the direction, or the robot would never rest."""
SAME_SOUND = 1.0
"""s after a turn within which a sound is still the same, and the turn was too far or too short. Near the source, each
microphone's own distance from it counts, and the direction seems further aside than it is; so the robot corrects half
of the error."""
SILENCE = 5.0
"""s without a sound after which the user is told."""
PERIOD = 0.05
"""s between two readings if the link is quick. Each covers only the last 6 to 10 ms, so a single clap may fall between
two of them; its echo in a room lasts longer (e-puck.md, 7)."""


@behaviour(world="beeper", reconnects=True, group="vehicles")
async def listen(robot: Epuck, run: RunContext, *, threshold: Threshold = 30) -> None:
    """Listen, and turn towards any sound: a clap, a voice, a beeper.

    Args:
        robot: The robot to turn. It listens while it stands, because its motors are loud.
        run: The run.
        threshold: Least volume of a sound. A quiet room reads 0 to 12.
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
        sound = locate_sound([sum(each) / len(heard) for each in zip(*heard, strict=True)])
        heard.clear()
        quiet_since = robot.time
        said = f"a sound of {sound.volume:.0f} counts"
        if sound.error > UNCLEAR:
            if run.current_state != "unclear":
                run.say(f"{said}, but the microphones do not tell from where: go nearer")
            run.state("unclear")
            return
        if abs(sound.bearing) > STRAIGHT:
            run.state("turning")
            aside, degrees = "left" if sound.bearing > 0 else "right", abs(math.degrees(sound.bearing))
            run.say(f"{said}, {degrees:.0f} degrees to the {aside}, right to {math.degrees(sound.error):.0f}")
            is_same = robot.time - turned_at < SAME_SOUND
            await robot.turn(sound.bearing / 2 if is_same else sound.bearing)
            turned_at = robot.time
        run.state("facing")

    run.state("listening")
    await react(robot, step, period=PERIOD)
