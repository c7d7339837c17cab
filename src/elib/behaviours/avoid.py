"""Wander without hitting anything: the obstacle avoidance after Braitenberg's vehicles."""

from __future__ import annotations

from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.protocol.values import Proximity, Wheels
from elib.robot.aio import Epuck

Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 1.0, scale=1000)]

STANDING = Wheels(0.0, 0.0)
BLOCKED = 450
"""Counts of a front sensor at which driving on would end in a collision: 2 to 2.5 cm away (robot-model, 2.3)."""
FREE = 160
"""Counts below which a turn on the spot ends: nothing within 4 cm. Lower than BLOCKED, or the robot would dither."""
NOISE = 40
"""Counts that mean nothing: four standard deviations of the sensor in the dark (Enki's model)."""
SLOWING = 1200
"""Counts of weighted pressure that take a wheel's whole cruising speed."""
SPIN = 0.35
"""Wheel speed of a turn on the spot, rev/s: 1.7 rad/s, 6 degrees between two readings over Bluetooth."""


def avoid(near: Proximity, before: Wheels = STANDING, *, cruise: float = 0.6) -> Wheels:
    """Return the speeds that lead away from what is near.

    Each side's obstacles slow the wheel of the other side, so the robot bends away. With something right in front it
    turns on the spot, and keeps the direction it began with until the way is free: in a corner the nearer side changes
    with every turn, and a robot that followed it would nod for ever.

    Args:
        near: What the infrared sensors see.
        before: The speeds this law returned last.
        cruise: Speed on free ground, rev/s.
    """
    from_left = _pressure(near.front_left, near.diagonal_left, near.left)
    from_right = _pressure(near.front_right, near.diagonal_right, near.right)
    ahead = max(near.front_left, near.front_right)
    corner = max(near.diagonal_left, near.diagonal_right)
    is_turning = before.left * before.right < 0
    if is_turning and max(ahead, corner // 2) > FREE:
        return before
    if max(ahead, corner // 2) > BLOCKED:
        # A tie goes to the right: any choice is good, none would be a robot that stares at a wall.
        side = 1 if from_left >= from_right else -1
        return Wheels(side * SPIN, -side * SPIN)
    return Wheels(
        cruise * max(0.0, 1 - from_right / SLOWING),
        cruise * max(0.0, 1 - from_left / SLOWING),
    )


def _pressure(front: int, diagonal: int, side: int) -> float:
    """Return how strongly one side is occupied; what is beside the robot matters least."""
    return 1.5 * _seen(front) + _seen(diagonal) + 0.3 * _seen(side)


def _seen(count: int) -> int:
    return max(0, count - NOISE)


@behaviour
async def wander(robot: Epuck, run: RunContext, *, cruise: Cruise = 0.6) -> None:
    """Wander without hitting anything.

    Args:
        robot: The robot to drive.
        run: Where it performs.
        cruise: Speed on free ground.
    """
    wheels = STANDING

    async def step(eyes: Epuck) -> None:
        nonlocal wheels
        before, wheels = wheels, STANDING  # after a lost answer it stands
        wheels = avoid(await eyes.proximity(), before, cruise=cruise)
        run.state("turning" if wheels.left * wheels.right < 0 else "roaming")
        await eyes.set_speed(wheels.left, wheels.right)

    await react(robot, step)
