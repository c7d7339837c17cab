"""A course of episodes: the kernels that begin, run and judge the episodes of many worlds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

from elib.base.body import METRES_PER_STEP
from elib.simulator.physics.defects import damage
from elib.simulator.physics.elementary import angle
from elib.simulator.physics.engine import call, kernel, opened, phase
from elib.simulator.physics.motion import turn_wheels
from elib.simulator.physics.neighbours import list_near
from elib.simulator.physics.noise import BROKEN, bits, numbered_key, uniform
from elib.simulator.physics.packing import restore, world_at
from elib.simulator.physics.records import Records
from elib.simulator.physics.sensors import sense
from elib.simulator.physics.simulation import Law, advance
from elib.simulator.physics.spawning import spawn

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Judge: TypeAlias = Any
"""A function of the kept course and the number of a world (:mod:`elib.simulator.physics.judging`)."""

Kept: TypeAlias = Any
"""A course in the short form in which kernels take it (:meth:`~elib.simulator.physics.engine.Engine.kept`)."""

# Channels of an episode's key, beyond those of a robot for good (elib.simulator.physics.noise).
SCENE: Final = 8192
START: Final = 8193
DRAW: Final = 8194  # +0..8

DEFECTS: Final = 9
"""The row of a course's ranges that says how probable a defect is; those that may be drawn follow it."""


class Course(NamedTuple):
    """All that the kernels of episodes work on."""

    worlds: Any  # Of type Packed; interpreted, of type Listed.
    originals: Any  # The same of each scene, as it was laid out.
    starts: Any  # (scenes, sets, robots, 4): x, y, m, cosine and sine of the heading.
    # (scenes, 10 + defects, 4): the lowest and the highest value of what is drawn; how probable it is that something is
    # broken in a robot; and a row for each thing that may be (elib.simulator.physics.defects).
    ranges: Any
    episodes: Any  # One record a world.
    memory: Any  # (worlds, robots, n): what the controllers remember.
    remembered: Any  # (worlds, n): what the functions of the task remember.
    fresh: Any  # (n,): that at the beginning of an episode.
    earned: NDArray[np.float64]  # (worlds, robots): what the robots earned in the last call.
    observed: NDArray[np.float64]  # (worlds, robots, n): what the robots observe.
    # (worlds, robots, 8): x, y, m; heading, rad; 1 if the robot touches something; energy; points; zones; and what is
    # broken in it, -1 for nothing.
    places: NDArray[np.float64]
    progress: NDArray[np.float64]  # (worlds, 2): 1 if the task has ended the episode; ticks since it began.
    period: int  # Ticks between two decisions.
    ticks: int  # Of a full episode.
    top_speed: float  # Of a wheel, m/s.
    sensors: int  # What the controllers see (elib.simulator.physics.sensors.chosen).
    reward_sensors: int  # What the rewards see.


@kernel
def drawn(course: Course, scene: int, key: int, k: int) -> float:
    """Return what an episode with this key draws as its value number *k*."""
    low: float = course.ranges[scene][k][0]
    high: float = course.ranges[scene][k][1]
    return low + (high - low) * uniform(key, DRAW + k)


@phase
def begin(course: Course, w: int, key: int) -> None:
    """Begin an episode of world *w*: the key decides its scene, its starts, its noise and all that is drawn."""
    scene = bits(key, SCENE) % len(course.starts)
    restore(course.worlds, course.originals, w, scene)
    world = world_at(course.worlds, w)
    setting = world.setting[0]
    setting.motor_noise = drawn(course, scene, key, 0)
    setting.sensor_noise = drawn(course, scene, key, 1)
    setting.wheel_spread = drawn(course, scene, key, 2)
    setting.axle_spread = drawn(course, scene, key, 3)
    setting.gain_spread = drawn(course, scene, key, 4)
    setting.offset_spread = drawn(course, scene, key, 5)
    setting.ambient = drawn(course, scene, key, 6)
    setting.spread = drawn(course, scene, key, 7)
    episode = course.episodes[w]
    episode.scene = scene
    episode.delay = int(drawn(course, scene, key, 8) / setting.step + 0.5)
    episode.is_over = 0
    episode.tick = 0
    sets, ranges = course.starts[scene], course.ranges[scene]
    spawn(world, sets[bits(key, START) % len(sets)], key)
    list_near(world)
    for i in range(len(world.robots)):
        robot = world.robots[i]
        course.places[w][i][7] = -1.0
        if uniform(robot.key, BROKEN) < ranges[DEFECTS][0]:
            number = bits(robot.key, BROKEN + 1) % (len(ranges) - DEFECTS - 1)
            course.places[w][i][7] = number
            damage(robot, ranges[DEFECTS + 1 + number])
        for n in range(len(course.memory[w][i])):
            course.memory[w][i][n] = 0.0
    for n in range(len(course.fresh)):
        course.remembered[w][n] = course.fresh[n]


@kernel
def begin_next(course: Course, w: int) -> None:
    """Begin the next episode of world *w*, whose key is made of that of the first one."""
    episode = course.episodes[w]
    episode.begun += 1
    begin(course, w, numbered_key(episode.key, episode.begun))


@phase
def sense_robots(world: Records, sensors: int) -> None:
    """Let all robots of one world read these sensors."""
    setting = world.setting[0]
    for i in range(len(world.robots)):
        world.views[i].time = setting.tick * setting.step
        sense(world, i, sensors)


@kernel
def observe(observer: Judge, kept: Kept, course: Course, world: Records, w: int) -> None:
    """Write what there is to see of world *w* into the course."""
    sense_robots(world, course.sensors)
    call(observer, (kept, w))
    course.progress[w][0] = course.episodes[w].is_over
    course.progress[w][1] = course.episodes[w].tick
    for i in range(len(world.robots)):
        robot, place = world.robots[i], course.places[w][i]
        place[0] = robot.x
        place[1] = robot.y
        place[2] = angle(robot.heading_x, robot.heading_y)
        place[3] = 1.0 if robot.touched >= 0 else 0.0
        place[4] = robot.energy
        place[5] = robot.score
        place[6] = robot.zones


@kernel
def run_period(judge: Judge, kept: Kept, course: Course, world: Records, w: int) -> None:
    """Let all robots of world *w* do what their views say, until the next decision or the end of the episode."""
    episode = course.episodes[w]
    for tick in range(course.period + 1):
        if tick == episode.delay:
            for i in range(len(world.robots)):
                turn_wheels(world, i)
        if tick == course.period:
            return
        advance(world, 1)
        episode.tick += 1
        for i in range(len(world.robots)):
            sense(world, i, course.reward_sensors)
        call(judge, (kept, w))
        if episode.is_over:
            return


@kernel
def wanted(speed: float, top_speed: float) -> float:
    """Return how a wheel is to turn, steps/s; what is not a number stands for 0."""
    if speed > top_speed:
        return top_speed / METRES_PER_STEP
    if speed >= -top_speed:
        return speed / METRES_PER_STEP
    return -top_speed / METRES_PER_STEP if speed < -top_speed else 0.0


@kernel
def step_worlds(
    judge: Judge, observer: Judge, kept: Kept, first: int, end: int, actions: Any, begins_again: int
) -> None:
    """Let worlds first..end - 1 pass a period (:func:`step_opened`)."""
    step_opened(judge, observer, kept, opened(kept), first, end, actions, begins_again)


# With the course as an argument, kernels run a fifth faster than where they open it themselves.
@phase
def step_opened(
    judge: Judge, observer: Judge, kept: Kept, course: Course, first: int, end: int, actions: Any, begins_again: int
) -> None:
    """Let worlds first..end - 1 pass a period with these actions; begin those again that had ended, if asked to.

    An action is the speeds of the wheels of each robot of each world, m/s: (worlds, robots, 2).
    """
    for w in range(first, end):
        episode = course.episodes[w]
        world = world_at(course.worlds, w)
        for i in range(len(world.robots)):
            course.earned[w][i] = 0.0
        if episode.is_over == 0 and episode.tick < course.ticks:
            for i in range(len(world.robots)):
                world.views[i].left = wanted(actions[w][i][0], course.top_speed)
                world.views[i].right = wanted(actions[w][i][1], course.top_speed)
            run_period(judge, kept, course, world, w)
        elif begins_again:
            begin_next(course, w)
            world = world_at(course.worlds, w)
        observe(observer, kept, course, world, w)


@kernel
def begin_worlds(observer: Judge, kept: Kept, chosen: Any, are_next: int) -> None:
    """Begin the first episodes of the keys of these worlds, or the next ones."""
    course = opened(kept)
    for n in range(len(chosen)):
        w = chosen[n]
        if are_next:
            begin_next(course, w)
        else:
            course.episodes[w].begun = 0
            begin(course, w, course.episodes[w].key)
        observe(observer, kept, course, world_at(course.worlds, w), w)


@kernel
def play_episodes(law: Law, judge: Judge, kept: Kept, w: int, rows: Any, games: Any, fitness: Any, steps: Any) -> None:
    """Let every individual play every episode in world *w* (:func:`play_opened`)."""
    play_opened(law, judge, kept, opened(kept), w, rows, games, fitness, steps)


@phase
def play_opened(
    law: Law, judge: Judge, kept: Kept, course: Course, w: int, rows: Any, games: Any, fitness: Any, steps: Any
) -> None:
    """Let every individual play every episode in world *w*.

    Args:
        law: The control function.
        judge: What the robots earn, and whether an episode is over.
        kept: All worlds.
        course: The same.
        w: The world to play in.
        rows: Parameters, one row an individual.
        games: The episodes, of which only the keys are looked at.
        fitness: Out, (individuals, episodes).
        steps: Out, (individuals, episodes, 2): steps of the left and right motor, mean over the robots.
    """
    for p in range(len(rows)):
        for n in range(len(games)):
            begin(course, w, games[n].key)
            world = world_at(course.worlds, w)
            count = len(world.robots)
            for i in range(count):
                course.earned[w][i] = 0.0
            while course.episodes[w].is_over == 0 and course.episodes[w].tick < course.ticks:
                sense_robots(world, course.sensors)
                for i in range(count):
                    world.views[i].left = 0.0
                    world.views[i].right = 0.0
                call(law, (world.views, 0, count, rows[p : p + 1], course.memory[w]))
                run_period(judge, kept, course, world, w)
            fitness[p][n] = 0.0
            steps[p][n][0] = 0.0
            steps[p][n][1] = 0.0
            for i in range(count):
                fitness[p][n] += course.earned[w][i] / count
                steps[p][n][0] += world.robots[i].left_steps / count
                steps[p][n][1] += world.robots[i].right_steps / count
