"""What a program that learns may observe beside the sensors: the goal, neighbours, encoders, colours, or its own.

An :class:`Observation` is a function that is called as ``function(world, i, k)``, for robot i and each of its numbers
k; or as ``function(world, i, k, memory)`` in a task with a memory. Like a reward it is plain Python that Numba
compiles, and it must change nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from math import inf, pi, sqrt
from typing import Any, Final, NamedTuple

from elib.base.body import CHIP, FOCAL, LENS
from elib.base.errors import ArgumentError
from elib.base.rules import Number, Whole
from elib.simulator.physics.elementary import angle
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.floor import HOLE_MARK
from elib.simulator.physics.optics import ABOVE
from elib.simulator.physics.raycast import MISSED, hit_disc
from elib.simulator.physics.records import SIZE, Records, Robot, SensorView
from elib.simulator.physics.sensors.ground import PLACE_X, PLACE_Y, floor_at

SENSED: Final[dict[str, Callable[[Any, int], float]]] = {
    "proximity": lambda robot, s: robot.proximity[s],
    "ambient_light": lambda robot, s: robot.ambient_light[s],
    "ground": lambda robot, s: robot.ground[s],
    "microphones": lambda robot, s: robot.microphones[s],
    "distance": lambda robot, s: robot.distance,
    "acceleration": lambda robot, s: robot.acceleration[s],
    "rotation": lambda robot, s: robot.rotation,
}
"""Number *s* of each sensor: compiled code finds no names at run time."""


def numbers_of(sensor: str) -> int:
    """Return how many numbers a sensor has."""
    return next(int(each.metadata.get(SIZE, 1)) for each in fields(SensorView) if each.name == sensor)


class Channel(NamedTuple):
    """One number of an observation or an action, and its range: what lies beyond is cut off."""

    name: str  # such as proximity_front_right
    unit: str = ""
    low: float = -inf
    high: float = inf


@dataclass(frozen=True)
class Observation:
    """Numbers that an environment shows beside the readings of a task's sensors.

    Example:
        >>> def ahead(world, i, k):
        ...     return world.setting[0].width - world.robots[i].x
        >>> to_the_right = Observation([Channel("to_the_right", "m", 0.0, 2.0)], ahead)

    Attributes:
        channels: Name, unit and range of each number.
        function: Returns number k of robot i, of ``(world, i, k)`` or ``(world, i, k, memory)``.
    """

    channels: Sequence[Any]
    function: Callable[..., float]

    def __post_init__(self) -> None:
        made = tuple(Channel(*each) for each in self.channels)
        object.__setattr__(self, "channels", made)
        if not made or not callable(self.function):
            raise ArgumentError(
                "an observation needs channels and a function",
                hint='such as Observation([Channel("speed", "m/s", -0.13, 0.13)], function)',
            )


@kernel
def bearing(robot: Robot, x: float, y: float) -> float:
    """Return in which direction from a robot (x, y) lies, rad: 0 ahead, positive to the left."""
    dx = x - robot.x
    dy = y - robot.y
    return angle(dx * robot.heading_x + dy * robot.heading_y, dy * robot.heading_x - dx * robot.heading_y)


@kernel
def range_to(robot: Robot, x: float, y: float) -> float:
    """Return how far the middle of a robot is from (x, y), m."""
    dx = x - robot.x
    dy = y - robot.y
    return sqrt(dx * dx + dy * dy)


def _polar(name: str, reach: float) -> list[Channel]:
    return [Channel(f"{name}_distance", "m", 0.0, reach), Channel(f"{name}_bearing", "rad", -pi, pi)]


def goal(
    x: float = 0.0, y: float = 0.0, *, lamp: int | None = None, thing: int | None = None, reach: float = 3.0
) -> Observation:
    """Return how far the goal is, and in which direction: 0 ahead, positive to the left.

    Args:
        x: Where it is, m.
        y: The same.
        lamp: Instead, the lamp of this number is the goal.
        thing: Instead, the thing of this number that can be pushed.
        reach: The longest distance that is told, m.
    """
    x, y = (Number(unit="m").require(each, "the goal") for each in (x, y))
    place: Callable[[Any], Any] = lambda world: Place(x, y)  # noqa: E731
    lamp, thing = (
        None if each is None else Whole(0).require(each, name, "the goal's ")
        for name, each in (("lamp", lamp), ("thing", thing))
    )
    if lamp is not None:
        place = lambda world: world.lamps[lamp]  # noqa: E731
    elif thing is not None:
        place = lambda world: world.things[thing]  # noqa: E731

    def seen(world: Records, i: int, k: int) -> float:
        robot, there = world.robots[i], place(world)
        return range_to(robot, there.x, there.y) if k == 0 else bearing(robot, there.x, there.y)

    return Observation(_polar("goal", reach), seen)


class Place(NamedTuple):
    """A place, m."""

    x: float
    y: float


@kernel
def nearest(world: Records, i: int, rank: int, reach: float) -> int:
    """Return the number of the robot that is nearest to robot *i* but for *rank* others; -1 if none within *reach*."""
    robot = world.robots[i]
    for j in range(len(world.robots)):
        far = range_to(robot, world.robots[j].x, world.robots[j].y)
        if j == i or far >= reach:
            continue
        nearer = 0
        for other in range(len(world.robots)):
            if other != i and other != j:
                its = range_to(robot, world.robots[other].x, world.robots[other].y)
                nearer += its < far or (its == far and other < j)
        if nearer == rank:
            return j
    return -1


def neighbours(count: int = 1, *, reach: float = 1.0) -> Observation:
    """Return range and bearing of the nearest robots, the nearest first, whatever stands between.

    Args:
        count: How many.
        reach: What is farther is not seen, m: its range is *reach* then, and its bearing 0.
    """
    numbers = range(1, Whole(1, 100).require(count, "count") + 1)

    def seen(world: Records, i: int, k: int) -> float:
        robot = world.robots[i]
        j = nearest(world, i, k // 2, reach)
        if j < 0:
            return reach if k % 2 == 0 else 0.0
        other = world.robots[j]
        return range_to(robot, other.x, other.y) if k % 2 == 0 else bearing(robot, other.x, other.y)

    return Observation([each for number in numbers for each in _polar(f"neighbour_{number}", reach)], seen)


def encoders() -> Observation:
    """Return the steps of both motors since the episode began, as the robot counts them: from 32767 on to -32768."""

    def counted(world: Records, i: int, k: int) -> float:
        robot = world.robots[i]
        steps = int(robot.left_steps if k == 0 else robot.right_steps)
        return float((steps + 32768) % 65536 - 32768)

    return Observation([Channel(f"encoder_{side}", "steps", -32768, 32767) for side in ("left", "right")], counted)


def ground_colours() -> Observation:
    """Return red, green and blue of the floor under the left, the middle and the right ground sensor, 0..255."""

    def colour(world: Records, i: int, k: int) -> float:
        robot, x, y = world.robots[i], PLACE_X[k // 3], PLACE_Y[k // 3]
        at_x = robot.x + robot.heading_x * x - robot.heading_y * y
        at_y = robot.y + robot.heading_y * x + robot.heading_x * y
        packed = floor_at(world, at_x, at_y) % HOLE_MARK
        return float((packed >> (16 - 8 * (k % 3))) % 256)

    names = [f"floor_{side}_{part}" for side in ("left", "middle", "right") for part in ("red", "green", "blue")]
    return Observation([Channel(name, "", 0, 255) for name in names], colour)


def camera_row(columns: int = 16) -> Observation:
    """Return how bright what the camera meets is, 0..255, in a row of *columns* at the lens's height, left to right.

    It is the mean of red, green and blue of the nearest wall, box, cylinder or robot, without noise; 0 for nothing.
    """
    columns = Whole(1, 100).require(columns, "columns")
    widest = CHIP[0] / 2 / FOCAL

    def bright(world: Records, i: int, k: int) -> float:
        return brightness_ahead(world, i, widest * (1.0 - (2.0 * k + 1.0) / columns))

    return Observation([Channel(f"camera_{k}", "", 0, 255) for k in range(columns)], bright)


ROBOT_GREY: Final = 128.0
"""Brightness of another robot in a row of the camera."""


@kernel
def brightness_ahead(world: Records, i: int, aside: float) -> float:
    """Return how bright is what a ray from the camera of robot *i* meets, *aside* m to the left for each m ahead."""
    robot = world.robots[i]
    x = robot.x + robot.heading_x * LENS
    y = robot.y + robot.heading_y * LENS
    long = sqrt(1.0 + aside * aside)
    along_x = (robot.heading_x - aside * robot.heading_y) / long
    along_y = (robot.heading_y + aside * robot.heading_x) / long
    first, found = MISSED, 0.0
    for k in range(len(world.walls)):
        wall = world.walls[k]
        across = along_x * wall.tangent_y - along_y * wall.tangent_x
        if wall.height > ABOVE and across != 0.0:
            dx = wall.x - x
            dy = wall.y - y
            far = (dx * wall.tangent_y - dy * wall.tangent_x) / across
            at = (dx * along_y - dy * along_x) / across
            if 0.0 < far < first and 0.0 <= at <= wall.length:
                first, found = far, grey(wall.colour)
    for k in range(len(world.discs)):
        disc = world.discs[k]
        far = ray_to(disc.x - x, disc.y - y, along_x, along_y, disc.radius)
        if disc.height > ABOVE and far < first:
            first, found = far, grey(disc.colour)
    for k in range(len(world.robots)):
        other = world.robots[k]
        far = ray_to(other.x - x, other.y - y, along_x, along_y, other.radius)
        if k != i and far < first:
            first, found = far, ROBOT_GREY
    return found


@kernel
def grey(colour: int) -> float:
    """Return the mean of red, green and blue, 0..255."""
    return float((colour >> 16) % 256 + (colour >> 8) % 256 + colour % 256) / 3.0


@kernel
def ray_to(dx: float, dy: float, along_x: float, along_y: float, radius: float) -> float:
    """Return how far away a ray meets a disc at (dx, dy), m."""
    return hit_disc(dx * along_x + dy * along_y, dx * dx + dy * dy - radius * radius)
