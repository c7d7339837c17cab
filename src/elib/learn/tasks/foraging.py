"""Bring as much food as possible from a field to a nest, in a team of four.

A robot that enters the field has food, and one that comes into the nest with food has delivered it. The field is black
and lies along one wall. The nest is white and small, and a lamp over it shows the way from everywhere. To be solved, an
episode needs three deliveries for each robot. Robots that go to the lamp with food and away from it without make about
four, and robots that drive about and turn away from walls less than one. `elib evolve foraging` with seed 1 finds a
network that makes 3.4 and solves 85 % of new episodes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from elib.learn.rooms import ROBOTS, room
from elib.simulator.physics import Colour, EpuckModel, Light, Patch, Scene, Stripe, Zone
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

SIDE: Final = 1.4
"""m. Of the room."""

FIELD: Final = 0.4
"""m. How deep the field is, along the whole wall."""

RADIUS: Final = 0.2
"""m. Of the half of a disc that is the nest, at the wall opposite."""


AHEAD: Final = 0.04
"""m. The ground sensors are before the middle of the robot: where they see the paint, it is in the zone."""


def reward(world: Records, i: int, memory: Any) -> float:
    """Return 1 for a delivery, and 0 otherwise."""
    zones = world.robots[i].zones
    if zones == 1:
        memory.food[i] = 1.0
    elif zones == 2 and memory.food[i] > 0.0:
        memory.food[i] = 0.0
        return 1.0
    return 0.0


def with_nest(x: float) -> Scene:
    """Return a grey room with a black field, and a white nest with its lamp at the wall opposite."""
    return replace(
        room(0, width=SIDE, depth=SIDE),
        name=f"nest {x:g}",
        floor=Colour(128, 128, 128),
        zones=(
            Zone("field", 0.5 * SIDE, SIDE - 0.5 * (FIELD + AHEAD), width=SIDE, depth=FIELD + AHEAD),
            Zone("nest", x, 0.0, radius=RADIUS + AHEAD),
        ),
        paint=(
            Patch(0.0, SIDE - FIELD, SIDE, FIELD, Colour(0, 0, 0)),
            Stripe(((x, 0.0), (x + 0.001, 0.0)), width=2 * RADIUS, colour=Colour(255, 255, 255)),
        ),
        lights=(Light(x, 0.02, height=0.4, intensity=2.5, name="nest"),),
        model=EpuckModel(ground_module=True),
    )


TASK = Task(
    name="foraging",
    summary="Bring food from a field to a nest, as a team.",
    source="Francesca, Brambilla, Brutschy, Trianni and Birattari 2014, AutoMoDe: a novel approach to the automatic "
    "design of control software for robot swarms, Swarm Intelligence 8(2) (20 e-pucks, black sources, a white nest "
    "with a light behind it; the number of items is the fitness)",
    scenes=tuple(with_nest(x) for x in (0.3, 0.7, 1.1)),
    sensors=("proximity", "ambient_light", "ground"),
    reward=reward,
    robot_memory={"food": 0.0},
    robots=4,
    fitness="sum",
    solved=3.0,
    seconds=120.0,
    randomisation=ROBOTS,
)
