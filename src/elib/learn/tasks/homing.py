"""Drive on for as long as possible with a battery that lasts 20 s, and come back to the charger in time.

The worlds are rooms with a lamp over the charger in one of the four corners. The charger is black: the ground sensors,
3 cm ahead of the robot's middle, see it. A robot whose middle is on it is charged at once, and an empty battery ends
the episode. The robot starts anywhere. One that never finds the charger earns less than a third; to be solved, an
episode needs 0.6. A robot does not see its battery; environments show its energy beside the sensors.
"""

from __future__ import annotations

from dataclasses import replace

from elib.learn.rooms import ROBOTS, TOP_SPEED, forward_speed, nearness, room
from elib.simulator.physics import Energy, EpuckModel, Light, Scene, Stripe, Zone
from elib.simulator.physics.observing import Channel, Observation
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

LASTS = 20.0
"""s. How long a full battery lasts."""

WIDTH = 0.6
DEPTH = 0.54
"""m. The room of the paper, and its charger, are as much larger as an e-puck is wider than a Khepera."""

RADIUS = 0.11
"""m. Of the quarter of a disc that is the charger."""


def reward(world: Records, i: int) -> float:
    """Return V (1 - n), -1..1, and 0 on the charger: fast forward, and far from everything.

    V is the mean speed of the wheels as a part of the top speed, and n the highest of the eight infrared readings as a
    part of the full scale.
    """
    if world.robots[i].zones != 0:
        return 0.0
    return forward_speed(world.robots[i]) * (1.0 - nearness(world, i))


def is_over(world: Records) -> bool:
    """Return whether the battery is empty."""
    return world.robots[0].energy <= 0.0


def energy(world: Records, i: int, k: int) -> float:
    """Return what is left of the energy, 0..1."""
    return world.robots[i].energy


def with_charger(x: float, y: float) -> Scene:
    """Return a room with a charger and its lamp in a corner."""
    return replace(
        room(0, width=WIDTH, depth=DEPTH),
        name=f"charger {x:g}, {y:g}",
        energy=Energy(1 / LASTS),
        zones=(Zone("charger", x, y, radius=RADIUS, energy=100.0),),
        paint=(Stripe(((x, y), (x + 0.001, y)), width=2 * RADIUS),),
        lights=(Light(abs(x - 0.02), abs(y - 0.02), height=0.05, intensity=1.5),),
        model=EpuckModel(ground_module=True),
    )


TASK = Task(
    name="homing",
    summary="Drive about, and come back to the charger before the battery is empty.",
    source="Floreano and Mondada 1996, Evolution of homing navigation in a real mobile robot, IEEE Transactions on "
    "Systems, Man and Cybernetics, Part B 26(3); here a robot that stands on the charger earns nothing",
    scenes=tuple(with_charger(x, y) for x in (0.0, WIDTH) for y in (0.0, DEPTH)),
    sensors=("proximity", "ambient_light", "ground"),
    reward=reward,
    reward_sensors=("proximity",),
    is_over=is_over,
    observe=(Observation([Channel("energy", "", 0.0, 1.0)], energy),),
    solved=0.6,
    top_speed=TOP_SPEED,
    randomisation=ROBOTS,
)
