"""Braitenberg's vehicles 2 and 3: light on the left and on the right, two wires to the wheels, and four characters.

The wires go straight or crossed, and they excite or inhibit (V. Braitenberg, "Vehicles: Experiments in Synthetic
Psychology", MIT Press 1984). So that no vehicle rams a wall for ever, the infrared sensors slow the wheels as in
:mod:`~elib.behaviours.avoid`.
"""

from __future__ import annotations

import enum
from typing import Annotated, NamedTuple

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.behaviours.avoid import STANDING, avoid
from elib.protocol.values import AmbientLight, Proximity, Wheels
from elib.robot.aio import Epuck


class Vehicle(enum.IntEnum):
    """How the two sides of the robot are wired to its wheels."""

    FEAR = 0
    """2a, straight and exciting: turns away from the light, and hurries while it is bright."""
    AGGRESSION = 1
    """2b, crossed and exciting: turns towards the light, the faster the brighter it is, and runs it down."""
    LOVE = 2
    """3a, straight and inhibiting: turns towards the light, slows down near it and stays."""
    EXPLORER = 3
    """3b, crossed and inhibiting: likes the light, but turns away and leaves for another one."""


class Stimuli(NamedTuple):
    """How bright it is on either side: 0 as dark as the room gets, 1 in full light."""

    left: float
    right: float


Wiring = Annotated[Vehicle, Quantity("vehicle", "", 0, 3, names=Vehicle)]
Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 1.0, scale=1000)]

CREEP = 0.15
"""Part of the cruising speed that every vehicle but love keeps whatever the light: none of them is ever at rest."""
FULL_LIGHT = 1.3
"""Sensors' worth of full light on one side that count as 1: what a lamp straight ahead gives the four of them."""
LOVELY = 0.5
"""Stimulus at which a loving wheel stands still: 30 to 60 cm from a lamp, by its power."""
RESTING = 0.02
"""rev/s below which the vehicle counts as at rest."""
PERIOD = 0.1
"""s between two looks where the link is quick: three commands take longer over Bluetooth (robot-model, 2.12)."""


def stimuli(light: AmbientLight, dark: int) -> Stimuli:
    """Return how bright it is on either side, by the four sensors of each.

    Args:
        light: What the infrared sensors read of the room's light, counts; higher is darker.
        dark: Their reading in the dark, counts.
    """

    def side(*counts: int) -> float:
        bright = sum(max(0.0, 1 - count / dark) for count in counts) if dark > 0 else 0.0
        return min(1.0, bright / FULL_LIGHT)

    return Stimuli(
        side(light.front_left, light.diagonal_left, light.left, light.rear_left),
        side(light.front_right, light.diagonal_right, light.right, light.rear_right),
    )


def steer(stimulus: Stimuli, vehicle: Vehicle, *, cruise: float = 0.6) -> Wheels:
    """Return the speeds that the wiring makes of the light.

    Args:
        stimulus: How bright it is on either side.
        vehicle: The wiring.
        cruise: Speed in full light of the excited vehicles, and in the dark of the inhibited ones, rev/s.
    """
    to_left, to_right = stimulus
    if vehicle in (Vehicle.AGGRESSION, Vehicle.EXPLORER):
        to_left, to_right = to_right, to_left
    if vehicle in (Vehicle.FEAR, Vehicle.AGGRESSION):
        return Wheels(cruise * max(CREEP, to_left), cruise * max(CREEP, to_right))
    if vehicle is Vehicle.LOVE:
        return Wheels(cruise * max(0.0, 1 - to_left / LOVELY), cruise * max(0.0, 1 - to_right / LOVELY))
    return Wheels(cruise * max(CREEP, 1 - to_left), cruise * max(CREEP, 1 - to_right))


def keep_off(wheels: Wheels, near: Proximity, before: Wheels) -> Wheels:
    """Return *wheels* on free ground, and the more is near, the more what leads away from it.

    Near a wall the light must not steer, only say how fast: it would press the robot against the wall.

    Args:
        wheels: What the light asks for.
        near: What the infrared sensors see.
        before: The speeds returned last.
    """
    bend = avoid(near, before, cruise=1.0)
    if bend.left * bend.right < 0:
        return bend
    free, mean = min(bend), sum(wheels) / 2
    left, right = (mean * part + free * (wheel - mean) for wheel, part in zip(wheels, bend, strict=True))
    return Wheels(left, right)


@behaviour(world="light", reconnects=True)
async def live(robot: Epuck, run: RunContext, *, vehicle: Wiring = Vehicle.AGGRESSION, cruise: Cruise = 0.6) -> None:
    """Fear, attack, love or explore the light, as Braitenberg's vehicles 2 and 3 do.

    The darkest reading so far counts as darkness, so that it works in any room.

    Args:
        robot: The robot to drive.
        run: Where it performs.
        vehicle: How its sides are wired to its wheels.
        cruise: Speed in full light of the excited vehicles, and in the dark of the inhibited ones.
    """
    dark = 0
    wheels = STANDING

    async def step(eyes: Epuck) -> None:
        nonlocal dark, wheels
        before, wheels = wheels, STANDING  # after a lost answer it stands
        light, near = await eyes.ambient_light(), await eyes.proximity()
        dark = max(dark, *light)
        wheels = keep_off(steer(stimuli(light, dark), vehicle, cruise=cruise), near, before)
        await eyes.set_speed(wheels.left, wheels.right)
        if wheels.left * wheels.right < 0:
            run.state("turning-away")
        else:
            run.state("resting" if max(wheels) < RESTING else "driving")

    await react(robot, step, period=PERIOD)
