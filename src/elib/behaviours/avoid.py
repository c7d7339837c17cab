"""Wander without hitting anything: obstacle avoidance like that of Braitenberg's vehicles."""

from __future__ import annotations

from typing import Annotated

from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, react
from elib.link.protocol.values import Proximity, Wheels
from elib.robot.aio import Epuck

Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 1.0, scale=1000)]

STANDING = Wheels(0.0, 0.0)
BLOCKED = 300
"""Counts of a front sensor from which the robot would hit the obstacle: it is 2 to 2.5 cm away (e-puck.md, 3)."""
FREE = 110
"""Counts below which a turn on the spot ends: nothing is within 3.5 cm. Lower than BLOCKED, to avoid oscillation."""
NOISE = 25
"""Counts that are ignored: eight standard deviations of the noise, because the open air is learned from it, too."""
SLOWING = 850
"""Weighted counts of one side at which the wheel of the other side stands."""
SPIN = 0.35
"""Wheel speed of a turn on the spot, rev/s: 1.7 rad/s, 6 degrees between two readings over Bluetooth."""


def avoid(near: Proximity, before: Wheels = STANDING, *, cruise: float = 0.6) -> Wheels:
    """Return the speeds that lead away from what is near.

    Obstacles on one side slow the wheel of the other side, so the robot turns away. With something right in front it
    turns on the spot, and keeps the direction of that turn until the way is free: in a corner the nearer side changes
    with every turn, so a robot that always turned away from it would never leave.

    Args:
        near: Readings of the infrared sensors, without what they read in the open
            (:class:`~elib.behaviours.OpenAir`).
        before: The speeds that this controller returned last.
        cruise: Speed on free ground, rev/s.
    """
    from_left = _occupation(near.front_left, near.diagonal_left, near.left)
    from_right = _occupation(near.front_right, near.diagonal_right, near.right)
    ahead = max(near.front_left, near.front_right)
    corner = max(near.diagonal_left, near.diagonal_right)
    is_turning = before.left * before.right < 0
    if is_turning and max(ahead, corner // 2) > FREE:
        return before
    if max(ahead, corner // 2) > BLOCKED:
        # A tie goes to the right. Either side is good, but without a choice the robot would stand in front of a wall.
        side = 1 if from_left >= from_right else -1
        return Wheels(side * SPIN, -side * SPIN)
    return Wheels(
        cruise * max(0.0, 1 - from_right / SLOWING),
        cruise * max(0.0, 1 - from_left / SLOWING),
    )


def _occupation(front: int, diagonal: int, side: int) -> float:
    """Return how much one side is occupied, in weighted counts; what is beside the robot counts least."""
    front, diagonal, side = (max(0, count - NOISE) for count in (front, diagonal, side))
    return 1.5 * front + diagonal + 0.3 * side


@behaviour(group="vehicles")
async def wander(robot: Epuck, run: RunContext, *, cruise: Cruise = 0.6) -> None:
    """Wander without hitting anything.

    Args:
        robot: The robot to drive.
        run: The run.
        cruise: Speed on free ground.
    """
    wheels, open_air = STANDING, OpenAir()

    async def step(view: Epuck) -> None:
        nonlocal wheels
        before, wheels = wheels, STANDING  # after a lost answer the robot stands
        wheels = avoid(open_air(await view.proximity()), before, cruise=cruise)
        run.state("turning" if wheels.left * wheels.right < 0 else "roaming")
        await view.set_speed(wheels.left, wheels.right)

    await react(robot, step)
