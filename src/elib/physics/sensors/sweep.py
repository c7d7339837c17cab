"""All rays and readings of a robot's eight infrared sensors at once: what the compiled engine runs.

The laws are those of :mod:`elib.physics.sensors.rays` and :mod:`elib.physics.sensors.responding`; the operations are
those of :mod:`elib.physics.sensors.glance`, one by one, so that both engines agree to the last bit. Here each works on
a vector of eight, one a sensor (:mod:`elib.physics.vector`), and every sensor takes part, whether or not it looks that
way: working a ray out in vain costs nothing where it is done for eight, and a branch foreseen wrongly costs more than
all of them.
"""

from __future__ import annotations

from elib.physics.engine import inner_kernel, kernel
from elib.physics.grid import is_listed
from elib.physics.layout import (
    AGE,
    AXIS_X,
    AXIS_Y,
    BEFORE_HEADING_X,
    BEFORE_HEADING_Y,
    BEFORE_X,
    BEFORE_Y,
    BODIES,
    DISCS,
    HEAD,
    HEADING_X,
    HEADING_Y,
    IR_REACH,
    LIGHTS,
    NUMBER,
    PLACE_X,
    PLACE_Y,
    RAY_COUNT,
    ROBOT,
    ROBOTS,
    SEEN,
    SLOT,
    STEP,
    TICK,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.room import (
    AHEAD_X,
    AHEAD_Y,
    BEAM,
    BEAMS,
    BLOCK,
    DARK,
    FROM_X,
    FROM_Y,
    LIGHT,
    LIT,
    POSED,
    POSES,
    SEEING,
)
from elib.physics.sensors.beams import cast_at_discs, cast_at_walls, measure
from elib.physics.sensors.rays import ABSORBS, NOTHING
from elib.physics.sensors.readings import look_up_light, look_up_noise, reflect, respond_unlit
from elib.physics.sensors.responding import COUNT, note, respond
from elib.physics.sensors.sighting import (
    see_balls,
    see_boxes,
    see_cell_walls,
    see_listed_walls,
    see_neighbours,
    see_posts,
)
from elib.physics.vector import load, spread, store


@kernel
def sense_all(
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    lights: Floats,
    scratch: Floats,
) -> None:
    """Read the sensors of all robots into their records, once a tick."""
    count = numbers[ROBOTS]
    for first in range(0, count, BLOCK):
        last = min(first + BLOCK, count)
        _sweep(first, last, fixed, robots, bodies, walls, discs, cells, numbers, lights, scratch)


@kernel
def sense(
    robot: int,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    lights: Floats,
    scratch: Floats,
) -> None:
    """Read the sensors of one robot into its record, once a tick."""
    if numbers[HEAD + robot * NUMBER + SEEN] != numbers[TICK]:
        _sweep(robot, robot + 1, fixed, robots, bodies, walls, discs, cells, numbers, lights, scratch)


@kernel
def _sweep(
    first: int,
    last: int,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    lights: Floats,
    scratch: Floats,
) -> None:
    """Read the sensors of a block of robots, step by step for all of them.

    Each step is so short that the processor keeps it decoded, which all of them together are not.
    """
    rays = numbers[RAY_COUNT]
    nothing = 1.0 / fixed[IR_REACH]
    seen = 0
    for robot in range(first, last):
        _prepare(robot, robot - first, rays, nothing, fixed, robots, scratch)
    if is_listed(numbers):
        seen = see_listed_walls(first, last, seen, fixed, robots, walls, numbers, scratch)
    else:
        seen = see_cell_walls(first, 0, seen, fixed, robots, walls, cells, numbers, scratch)
    if numbers[BODIES] > 0:
        for robot in range(first, last):
            seen = see_boxes(robot, robot - first, seen, fixed, robots, bodies, walls, numbers, scratch)
    cast_at_walls(seen, fixed, walls, numbers, scratch)
    for b in range(last - first):
        measure(b, rays, nothing, scratch)
    seen = 0
    for robot in range(first, last):
        b = robot - first
        if numbers[DISCS] > 0:
            seen = see_posts(robot, b, seen, fixed, robots, discs, cells, numbers, scratch)
        seen = see_neighbours(robot, b, seen, fixed, robots, numbers, scratch)
        if numbers[BODIES] > 0:
            seen = see_balls(robot, b, seen, fixed, robots, bodies, discs, numbers, scratch)
    cast_at_discs(seen, fixed, numbers, scratch)
    for robot in range(first, last):
        look_up_noise(robot, robot - first, numbers)
    for b in range(last - first):
        look_up_light(b, rays, fixed, numbers, scratch)
    for b in range(last - first):
        reflect(b, rays, fixed, numbers, scratch)
    if numbers[LIGHTS] > 0:
        for robot in range(first, last):
            light = LIGHT + (robot - first) * LIT
            respond(robot, light, light + DARK, fixed, robots, walls, discs, numbers, lights, scratch)
        return
    for robot in range(first, last):
        respond_unlit(robot, robot - first, fixed, numbers, scratch)
    for robot in range(first, last):
        n = HEAD + robot * NUMBER
        if numbers[n + SEEN] != numbers[TICK]:
            note(n, numbers)


@inner_kernel
def _prepare(robot: int, b: int, rays: int, nothing: float, fixed: Floats, robots: Floats, scratch: Floats) -> None:
    """Let all rays of a robot meet nothing, and note how it stood when its sensors were sampled."""
    at = BEAMS + b * BEAM
    for k in range(at, at + rays * COUNT, COUNT):
        store(scratch, k, spread(nothing))
        store(scratch, ABSORBS + k, spread(NOTHING))
    r = robot * ROBOT
    pose = POSES + b * POSED
    heading_x = robots[r + HEADING_X]
    heading_y = robots[r + HEADING_Y]
    age = load(fixed, AGE) * (robots[r + SLOT] / fixed[STEP])
    then_x = heading_x - age * (heading_x - robots[r + BEFORE_HEADING_X])
    then_y = heading_y - age * (heading_y - robots[r + BEFORE_HEADING_Y])
    axis_x = load(fixed, AXIS_X)
    axis_y = load(fixed, AXIS_Y)
    place_x = load(fixed, PLACE_X)
    place_y = load(fixed, PLACE_Y)
    store(scratch, pose + AHEAD_X, then_x * axis_x - then_y * axis_y)
    store(scratch, pose + AHEAD_Y, then_y * axis_x + then_x * axis_y)
    store(scratch, pose + FROM_X, then_x * place_x - then_y * place_y - age * (robots[r + X] - robots[r + BEFORE_X]))
    store(scratch, pose + FROM_Y, then_y * place_x + then_x * place_y - age * (robots[r + Y] - robots[r + BEFORE_Y]))
    scratch[pose + SEEING] = 0.0
