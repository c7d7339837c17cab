"""Braitenberg's vehicles 2 and 3: two light sensors, two wires to the wheels, and four characters.

The wires are straight or crossed, and they excite or inhibit (V. Braitenberg, "Vehicles: Experiments in Synthetic
Psychology", MIT Press 1984). The infrared sensors slow the wheels as in :mod:`~elib.behaviours.avoid`, so that no
vehicle pushes against a wall for ever.
"""

from __future__ import annotations

import enum
from typing import Annotated, NamedTuple

from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, react
from elib.behaviours.avoid import STANDING, avoid
from elib.link.protocol.values import AmbientLight, Proximity, Wheels
from elib.robot.aio import Epuck


class Vehicle(enum.IntEnum):
    """How the sensors of the two sides are wired to the wheels."""

    FEAR = 0
    """2a, straight and exciting: turns away from the light, and drives faster where it is bright."""
    AGGRESSION = 1
    """2b, crossed and exciting: turns towards the light, and drives faster the brighter it is, until it hits it."""
    LOVE = 2
    """3a, straight and inhibiting: turns towards the light, slows down near it and stays."""
    EXPLORER = 3
    """3b, crossed and inhibiting: slows down near the light, but turns away and leaves for another one."""


class Stimuli(NamedTuple):
    """How bright it is on each side: 0 is the darkness of the room, 1 is full light."""

    left: float
    right: float


Wiring = Annotated[Vehicle, Quantity("vehicle", "", 0, 3, names=Vehicle)]
Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 1.0, scale=1000)]

CREEP = 0.15
"""Part of the cruising speed that every vehicle but LOVE keeps in any light, so that it never rests."""
FULL_LIGHT = 1.3
"""Sum of the four sensors of one side that counts as 1: what they see of a lamp straight ahead."""
LOVELY = 0.5
"""Stimulus at which a wheel of LOVE stands still: 30 to 60 cm from a lamp, which depends on its power."""
RESTING = 0.02
"""rev/s below which the vehicle counts as at rest."""
PERIOD = 0.1
"""s between two steps if the link is quick: three commands take longer over Bluetooth (wire-protocol.md, 5.13)."""


def stimuli(light: AmbientLight, dark: int) -> Stimuli:
    """Return how bright it is on each side, from its four sensors.

    Args:
        light: What the infrared sensors read of the room's light, counts; a higher count is darker.
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
        stimulus: How bright it is on each side.
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


def add_avoidance(wheels: Wheels, near: Proximity, before: Wheels) -> Wheels:
    """Return *wheels* on free ground, and near obstacles mix in the speeds that lead away from them.

    Near a wall the light must set the speed only, not the direction: it would press the robot against the wall.

    Args:
        wheels: Speeds that a controller asks for.
        near: Readings of the infrared sensors.
        before: The speeds that this function returned last.
    """
    bend = avoid(near, before, cruise=1.0)
    if bend.left * bend.right < 0:
        return bend
    free, mean = min(bend), sum(wheels) / 2
    left, right = (mean * part + free * (wheel - mean) for wheel, part in zip(wheels, bend, strict=True))
    return Wheels(left, right)


@behaviour(world="light", reconnects=True, group="vehicles")
async def drive_by_light(
    robot: Epuck, run: RunContext, *, vehicle: Wiring = Vehicle.AGGRESSION, cruise: Cruise = 0.6
) -> None:
    """Fear, attack, love or explore the light, as Braitenberg's vehicles 2 and 3 do.

    The darkest reading so far counts as darkness, so the behaviour works in any room.

    Args:
        robot: The robot to drive.
        run: The run.
        vehicle: How the sensors are wired to the wheels.
        cruise: Speed in full light of the excited vehicles, and in the dark of the inhibited ones.
    """
    dark = 0
    wheels, open_air = STANDING, OpenAir()

    async def step(view: Epuck) -> None:
        nonlocal dark, wheels
        before, wheels = wheels, STANDING  # after a lost answer the robot stands
        light, near = await view.ambient_light(), open_air(await view.proximity())
        dark = max(dark, *light)
        wheels = add_avoidance(steer(stimuli(light, dark), vehicle, cruise=cruise), near, before)
        await view.set_speed(wheels.left, wheels.right)
        if wheels.left * wheels.right < 0:
            run.state("turning-away")
        else:
            run.state("resting" if max(wheels) < RESTING else "driving")

    await react(robot, step, period=PERIOD)
