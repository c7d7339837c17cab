"""Find the way through a maze to a goal that beeps.

The worlds are the world ``maze`` and its three mirror images, so that a sequence of turns learned by heart is of no
use. The robot starts in the corner opposite to the goal. It is solved if the robot reaches the goal in time. The way is
2.3 times as long as the straight line: a robot that follows the sound ends in a dead end. One that keeps a hand on the
wall finds it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Final

from elib.learn.rooms import ROBOTS, distance, gallery
from elib.simulator.physics import Patch, Pose, Scene, Sound, Wall
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

CELLS: Final = 7
"""Cells along each side of the maze."""

CELL: Final = 0.2
"""Side of a cell, m."""

SIDE: Final = 1.4
"""Side of the maze, m."""

GOAL: Final = 1.3
"""x and y of the goal, m, as the maze lies in its file."""

REACHED: Final = 0.1
"""m from the goal. There the robot has found it."""


def ways(scene: Scene) -> list[tuple[float, float, float]]:
    """Return for each cell, row by row, where the way to the goal leaves it, and how far it is from there.

    Both are in metres: x, y, and the length of the way.
    """
    last = CELLS * CELLS - 1
    found = {last: (GOAL, GOAL, 0.0)}
    waiting = deque([last])
    while waiting:
        cell = waiting.popleft()
        x, y, rest = found[cell]
        for right, up in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            column, row = cell % CELLS + right, cell // CELLS + up
            door_x, door_y = (column + 0.5 - right / 2) * CELL, (row + 0.5 - up / 2) * CELL
            is_inside = 0 <= column < CELLS and 0 <= row < CELLS
            is_open = all(wall.distance(door_x, door_y) > CELL / 4 for wall in scene.walls)
            if is_inside and is_open and row * CELLS + column not in found:
                found[row * CELLS + column] = door_x, door_y, rest + distance(x, y, door_x, door_y)
                waiting.append(row * CELLS + column)
    return [found[cell] for cell in range(CELLS * CELLS)]


MAZE = gallery("maze")
WAYS = ways(MAZE)
DOOR_X: Final = tuple(x for x, _, _ in WAYS)
DOOR_Y: Final = tuple(y for _, y, _ in WAYS)
REST: Final = tuple(rest for _, _, rest in WAYS)
MAX_WAY: Final = REST[0] + CELL
"""m. No start is farther from the goal."""


def way_left(world: Records, x: float, y: float) -> float:
    """Return how long the shortest way from (x, y) to the goal is, m.

    The mazes are mirror images of each other: the place of the goal says which one this is.
    """
    if world.tones[0].x < 0.5 * SIDE:
        x = SIDE - x
    if world.tones[0].y < 0.5 * SIDE:
        y = SIDE - y
    column = min(max(int(x / CELL), 0), CELLS - 1)
    row = min(max(int(y / CELL), 0), CELLS - 1)
    cell = row * CELLS + column
    return REST[cell] + distance(x, y, DOOR_X[cell], DOOR_Y[cell])


def is_over(world: Records) -> bool:
    """Return whether the robot has reached the goal."""
    dx = world.robots[0].x - world.tones[0].x
    dy = world.robots[0].y - world.tones[0].y
    return dx * dx + dy * dy < REACHED * REACHED


def reward(world: Records, i: int) -> float:
    """Return by how much of the longest way the robot came nearer to the goal, and 1 more when it reaches it.

    All together that is below 1 until the goal is reached, and above 1 then. The way is the shortest one that the walls
    leave, not the straight line, which leads into dead ends.
    """
    robot = world.robots[i]
    nearer = way_left(world, robot.before_x, robot.before_y) - way_left(world, robot.x, robot.y)
    return nearer / MAX_WAY + (1.0 if is_over(world) else 0.0)


def mirrored(is_across: bool, is_along: bool, heading: float) -> Scene:
    """Return the maze, or a mirror image of it, with the robot in the corner opposite to the goal."""

    def place(x: float, y: float, width: float = 0.0, depth: float = 0.0) -> tuple[float, float]:
        return (round(SIDE - x - width, 6) if is_across else x), (round(SIDE - y - depth, 6) if is_along else y)

    def mirror(patch: Patch) -> Patch:
        x, y = place(patch.x, patch.y, patch.width, patch.depth)
        return replace(patch, x=x, y=y)

    walls = tuple(Wall(*place(wall.x1, wall.y1), *place(wall.x2, wall.y2)) for wall in MAZE.walls)
    return replace(
        MAZE,
        walls=walls,
        starts=(Pose(*place(0.1, 0.1), heading),),
        paint=tuple(mirror(paint) for paint in MAZE.paint if isinstance(paint, Patch)),
        sounds=(Sound(*place(GOAL, GOAL), volume=4000.0, name="goal"),),
    )


TASK = Task(
    name="maze",
    summary="Find the way through a maze to a goal that beeps.",
    source="Lehman and Stanley 2011, Abandoning objectives, Evolutionary Computation 19(2) (a robot that senses "
    "walls and the direction of the goal); here the way is measured through the corridors",
    scenes=tuple(
        mirrored(is_across, is_along, heading)
        for is_across in (False, True)
        for is_along in (False, True)
        for heading in (0.8, -2.3)
    ),
    sensors=("proximity", "microphones"),
    reward=reward,
    is_over=is_over,
    fitness="sum",
    solved=1.0,
    seconds=180.0,
    randomisation=ROBOTS,
)
