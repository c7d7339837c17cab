"""The tasks that come with elib: what they pay, what a robot must do to solve them, and that both engines agree."""

import copy
import importlib
import math
import random
import statistics
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from elib import Controller, World
from elib.learn import Episodes, Randomisation, Task, all_tasks
from elib.learn.catalogue import variable_of
from elib.learn.tasks import maze
from lanes import few_and_many, short

TASKS = all_tasks()

RANGES = {
    "avoid": (-1.0, 1.0),
    "phototaxis": (0.0, 1.0),
    "line-following": (-1.0, 1.0),
    "wall-following": (-1.0, 1.0),
    "maze": (-0.01, 1.01),
    "coverage": (0.0, 0.01),
    "homing": (-1.0, 1.0),
    "find-and-avoid": (-0.11, 1.01),
    "t-maze": (-0.01, 1.01),
    "foraging": (0.0, 1.0),
    "aggregation": (0.0, 1.0),
    "dispersion": (0.0, 1.0),
    "box-pushing": (-0.03, 0.03),
    "soccer": (-0.05, 1.05),
}
"""What a tick can pay."""

FULL = 776.0
"""steps/s. The top speed of all tasks, 0.1 m/s."""


def drive(robot: Any, speed: float, turn: float) -> None:
    """Drive at a part of the top speed, and turn to the left by a part of it."""
    robot.left = FULL * min(max(speed - turn, -1.0), 1.0)
    robot.right = FULL * min(max(speed + turn, -1.0), 1.0)


def stand(robot: Any, parameters: Any, memory: Any) -> None:
    robot.left = robot.right = 0.0


def keep_off(robot: Any, parameters: Any, memory: Any) -> None:
    near = robot.proximity
    left, right = near[7] + 0.7 * near[6] + 0.1 * near[5], near[0] + 0.7 * near[1] + 0.1 * near[2]
    slow = (left + right) / 1400 if left + right > 40 else 0.0
    drive(robot, 1.0 - slow, -slow if left > right else slow)


def go_to_light(robot: Any, parameters: Any, memory: Any) -> None:
    light = robot.ambient_light
    brightest = min(range(8), key=lambda s: light[s])
    if brightest in (0, 7):
        drive(robot, 0.9, (light[0] - light[7]) / 2000)
    else:
        drive(robot, 0.0, -0.6 if brightest < 4 else 0.6)


def follow_line(robot: Any, parameters: Any, memory: Any) -> None:
    left, middle, right = (max(0.0, (900 - count) / 500) for count in robot.ground[:3])
    if max(left, middle, right) > 0.2:
        memory[0] = left - right
        drive(robot, 0.9, 0.5 * (left - right))
    else:
        drive(robot, 0.2, 0.4 if memory[0] > 0 else -0.4)


def follow_wall(robot: Any, parameters: Any, memory: Any) -> None:
    near = robot.proximity
    if near[0] + near[7] > 250 or near[1] > 700:
        memory[0] = 1.0
        drive(robot, 0.15, 0.45)
    elif memory[0] or near[2] >= 60:
        memory[0] = 1.0
        away = 0.05 * (parameters[0] - math.sqrt(near[2]))
        drive(robot, 1.0 - abs(away) / 2, -away / 2)
    else:
        drive(robot, 1.0, 0.0)


def aggregate(robot: Any, parameters: Any, memory: Any) -> None:
    robot.left, robot.right = (FULL, -FULL) if robot.distance < 1.0 else (-0.7 * FULL, -FULL)


def leave(robot: Any, parameters: Any, memory: Any) -> None:
    near = [math.sqrt(count) if count > 90 else 0.0 for count in robot.proximity]
    ahead = -0.955 * (near[0] + near[7]) - 0.696 * (near[1] + near[6]) + 0.879 * (near[3] + near[4])
    aside = 0.296 * (near[0] - near[7]) + 0.718 * (near[1] - near[6]) + near[2] - near[5] + 0.477 * (near[3] - near[4])
    memory[0] -= 1
    if any(near):
        memory[0] = 20
        turn = 0.5 if aside > 0 else -0.5
        drive(robot, 0.0 if ahead < 0.3 * abs(aside) else 0.5, turn)
    elif memory[0] > 0:
        drive(robot, 1.0, 0.0)
    else:
        drive(robot, 0.0, 0.06)


def bounce(robot: Any, parameters: Any, memory: Any) -> None:
    near = robot.proximity
    if memory[0] > 0.0:
        memory[0] -= 1.0
    elif near[0] + near[7] > 150 or near[1] > 200 or near[6] > 200:
        memory[0] = 12.0
    drive(robot, 0.0 if memory[0] > 0.0 else 1.0, 0.5 if memory[0] > 0.0 else 0.0)


def go_home(robot: Any, parameters: Any, memory: Any) -> None:
    """Drive about, then to the lamp; where the floor is black a little farther, turn round, and again."""
    memory[0] += 0.1  # s
    if memory[0] > 2.0 and robot.ground[1] < 720:
        memory[0] = -2.2
    if -1.5 <= memory[0] < 0.0:
        drive(robot, 0.0, 0.5)
    elif 0.0 <= memory[0] < parameters[0]:
        keep_off(robot, parameters, memory)
    else:
        to_lamp(robot, parameters, memory)


def to_lamp(robot: Any, parameters: Any, memory: Any, sign: float = 1.0) -> None:
    """Drive to the lamp; away from it if *sign* is -1."""
    light = [4095.0 - count for count in robot.ambient_light]
    angles = [math.radians(angle) for angle in (-17, -49, -90, -150, 150, 90, 49, 17)]
    ahead, left = (
        sum((each - min(light)) * way(a) for each, a in zip(light, angles, strict=True)) for way in (math.cos, math.sin)
    )
    turn = math.atan2(sign * left, sign * ahead)
    drive(robot, 1.0 if abs(turn) < 0.8 else 0.1, 0.35 * turn)


def find(robot: Any, parameters: Any, memory: Any, sign: float = 1.0) -> None:
    """Drive to the lamp, and past what is near for a second."""
    near = robot.proximity
    right, left = near[0] + near[1] + 0.5 * near[2], near[7] + near[6] + 0.5 * near[5]
    away = -1.0 if left > right else 1.0
    memory[0] = 10.0 if left + right > 150 else memory[0] - 1.0
    if near[0] + near[7] > 150:
        drive(robot, 0.1, 0.5 * away)
    elif memory[0] == 10.0:
        drive(robot, 0.7, 0.25 * away)
    elif memory[0] > 0.0:
        drive(robot, 0.8, 0.0)
    else:
        to_lamp(robot, parameters, memory, sign)


def forage(robot: Any, parameters: Any, memory: Any) -> None:
    """Drive to the lamp from the black field to the white nest, and away from it back."""
    if robot.ground[1] < 450:
        memory[1] = 1.0
    elif robot.ground[1] > 800:
        memory[1] = 0.0
    find(robot, parameters, memory, 1.0 if memory[1] else -1.0)


def remember(robot: Any, parameters: Any, memory: Any) -> None:
    """Drive in the middle, and at the wall ahead turn to the side on which it has been bright; now, if *parameters*."""
    light, near = robot.ambient_light, robot.proximity
    if parameters[0]:
        memory[0] = sum(light[2:4]) - sum(light[4:6])
    elif min(light) < 3500:
        memory[0] += sum(light[:3]) - sum(light[5:])
    memory[1] -= 1.0
    if memory[1] > 0.0:
        drive(robot, 0.0, 0.5 if memory[0] > 0.0 else -0.5)
        return
    if memory[1] < -15.0 and min(near[0], near[7]) > 60:
        memory[1] = 9.0
    aside = near[0] + near[1] + 0.3 * near[2] - near[7] - near[6] - 0.3 * near[5]
    drive(robot, 0.8, 0.4 * min(max(aside / 300, -1.0), 1.0))


SENSIBLE: dict[str, tuple[Callable[..., None], float]] = {
    "avoid": (keep_off, 0.0),
    "phototaxis": (go_to_light, 0.0),
    "line-following": (follow_line, 0.0),
    "wall-following": (follow_wall, 25.0),
    "maze": (follow_wall, 15.0),
    "coverage": (bounce, 0.0),
    "homing": (go_home, 8.0),
    "find-and-avoid": (find, 0.0),
    "t-maze": (remember, 0.0),
    "foraging": (forage, 0.0),
    "aggregation": (aggregate, 0.0),
    "dispersion": (leave, 0.0),
    "box-pushing": (go_to_light, 0.0),
}
"""What solves a task, with the one parameter of it. For soccer no simple law is known that does."""


def played(task: Task, function: Callable[..., None], parameter: float = 0.0, seed: int = 1) -> float:
    """Return the fitness of an episode."""
    controller = Controller(function, [parameter], sensors=task.sensors, memory=2)
    scores = Episodes(task, engine="interpreted").play(controller, [[parameter]], [seed])
    return float(scores.fitness[0, 0])


def test_fourteen_tasks_come_with_elib() -> None:
    assert set(TASKS) == set(RANGES)
    for task in TASKS.values():
        assert task.summary
        assert task.source
        assert task.step == 1 / 40
        assert task.period == 0.1


@pytest.mark.parametrize("name", RANGES)
def test_every_world_has_room_for_the_robots_and_a_tick_pays_within_its_range(name: str) -> None:
    task, draw = TASKS[name], random.Random(name)
    low, high = RANGES[name]
    for seed, scene in enumerate(task.scenes):
        assert scene.model.ground_module or "ground" not in task.sensors
        assert scene.lights or "ambient_light" not in task.sensors
        assert scene.sounds or "microphones" not in task.sensors
        world = World(scene, robots=task.robots, seed=seed)
        starts = dict(task.memory) | {name: [start] * task.robots for name, start in task.robot_memory.items()}
        memory = [SimpleNamespace(**copy.deepcopy(starts))] if starts else []
        assert len(world.poses) == task.robots
        for tick in range(80 if seed < 4 else 0):
            if tick % 16 == 0:
                for robot in range(task.robots):
                    world.set_wheel_speeds(robot, draw.uniform(-0.1, 0.1), draw.uniform(-0.1, 0.1))
            world.step()
            for sensor in task.reward_sensors:
                world.readings(sensor)
            for robot in range(task.robots):
                assert low <= task.reward(world.records, robot, *memory) <= high


@pytest.mark.parametrize("name", SENSIBLE)
def test_a_sensible_robot_solves_it_and_one_that_stands_does_not(name: str) -> None:
    task = TASKS[name]
    function, parameter = SENSIBLE[name]
    seeds = (1, 2, 3) if name == "dispersion" else (1,)  # where robots that are drawn badly bring it down
    if task.robots > 1 and task.solved <= 1.0:  # foraging is solved by several deliveries
        task = replace(task, seconds=task.seconds / 2)
    assert statistics.fmean(played(task, function, parameter, seed) for seed in seeds) >= task.solved
    assert played(replace(task, seconds=2.0), stand) < task.solved


@pytest.mark.parametrize("name", ["coverage", "homing"])
def test_driving_in_circles_does_not_solve_it(name: str) -> None:
    def circle(robot: Any, parameters: Any, memory: Any) -> None:
        robot.left, robot.right = 0.6 * FULL, FULL

    scores = [played(TASKS[name], circle, seed=seed) for seed in (1, 2)]
    assert max(scores) < TASKS[name].solved / 2


def test_a_target_pays_one_and_the_way_to_it_and_a_touch_ends_the_search_and_costs_a_tenth() -> None:
    def straight_on(robot: Any, parameters: Any, memory: Any) -> None:
        robot.left = robot.right = FULL

    task = TASKS["find-and-avoid"]
    behind_a_box = replace(task, scenes=task.scenes[:1], randomisation=Randomisation(spread=(0.0, 0.0)))
    far, at_the_wall = math.hypot(0.52, 0.5), math.hypot(0.663 - 0.61, 0.5)
    assert played(behind_a_box, straight_on) == pytest.approx((far - at_the_wall) / 1.3 - 0.1, abs=0.003)
    assert played(behind_a_box, find) == pytest.approx(1.0 + (far - 0.12) / 1.3, abs=0.003)


@few_and_many(5, 10)
def test_who_drives_straight_to_the_lamp_often_touches_what_stands_before_it(examples: int) -> None:
    seeds = range(1, 1 + examples)
    scores = {each: [played(TASKS["find-and-avoid"], each, seed=seed) for seed in seeds] for each in (to_lamp, find)}
    solved = {each: sum(score >= 1.0 for score in found) for each, found in scores.items()}
    assert solved[to_lamp] <= 0.5 * examples
    assert solved[find] >= 0.9 * examples


def test_who_has_forgotten_the_lamp_leaves_the_t_maze_at_the_right_end_in_one_half_of_the_episodes() -> None:
    remembering, looking = (
        [played(TASKS["t-maze"], remember, now, seed) for seed in range(1, 21)] for now in (0.0, 1.0)
    )
    assert sum(score > 1.0 for score in remembering) >= 18
    assert 5 <= sum(score > 1.0 for score in looking) <= 15
    assert all(score < 0.7 or 1.9 < score < 2.4 for score in (*remembering, *looking))  # one end or the other


@pytest.mark.parametrize("way", short([bounce, find], find))
def test_who_does_not_use_the_lamp_or_does_not_leave_it_delivers_little(way: Callable[..., None]) -> None:
    scores = [played(TASKS["foraging"], way, seed=seed) for seed in (1, 2)]
    assert max(scores) < TASKS["foraging"].solved / 2
    assert all(4 * score == round(4 * score) for score in scores)  # whole deliveries of four robots


@pytest.mark.parametrize("name", ["avoid", "line-following", "wall-following"])
def test_shaking_on_one_spot_earns_nothing(name: str) -> None:
    def shake(robot: Any, parameters: Any, memory: Any) -> None:
        memory[0] = 1.0 if memory[0] == 0.0 else 0.0
        robot.left = robot.right = FULL if memory[0] else -FULL

    assert abs(played(replace(TASKS[name], seconds=20.0), shake)) < 0.02


def test_robots_that_drive_at_the_ball_score_more_than_robots_that_stand() -> None:
    def go_on(robot: Any, parameters: Any, memory: Any) -> None:
        robot.left = robot.right = FULL

    for function, seconds, least, most in ((stand, 1.0, 0.0, 0.0), (go_on, 15.0, 0.1, 2.0)):
        soccer = Episodes(replace(TASKS["soccer"], seconds=seconds), engine="interpreted")
        assert least <= soccer.play(Controller(function, [0.0]), [[0.0]], [1, 2, 3]).fitness.max() <= most


def test_one_robot_alone_does_not_bring_the_box_to_the_lamp() -> None:
    alone = Episodes(replace(TASKS["box-pushing"], robots=1), engine="interpreted")
    controller = Controller(go_to_light, [0.0], sensors=alone.task.sensors)
    assert alone.play(controller, [[0.0]], [1, 2, 3]).fitness.max() < 0.5


def test_the_way_through_the_maze_is_the_same_in_its_mirror_images() -> None:
    lengths = set()
    for scene in maze.TASK.scenes:
        world = World(scene)
        lengths.add(round(maze.way_left(world.records, world.poses[0].x, world.poses[0].y), 9))
        goal = scene.sounds[0]
        assert maze.way_left(world.records, goal.x, goal.y) == pytest.approx(0.0, abs=1e-9)
    assert len(lengths) == 1
    assert 1.2 * math.sqrt(2) < lengths.pop() < maze.MAX_WAY


def test_the_way_through_the_maze_gets_longer_by_less_than_a_step_is_long() -> None:
    """Where two cells meet there is no jump for a robot in the middle of the door."""
    world = World(maze.MAZE.__class__(1.4, 1.4, sounds=maze.TASK.scenes[0].sounds))
    for (x, y, rest), (cell_x, cell_y) in zip(
        maze.WAYS, ((0.2 * (cell % 7) + 0.1, 0.2 * (cell // 7) + 0.1) for cell in range(49)), strict=True
    ):
        before = maze.way_left(world.records, x + 0.01 * (cell_x - x), y + 0.01 * (cell_y - y))
        after = maze.way_left(world.records, x - 0.01 * (cell_x - x), y - 0.01 * (cell_y - y))
        assert abs(before - rest) < 0.002
        assert abs(after - before) < 0.005


@pytest.mark.parametrize("name", short(RANGES, "avoid"))
def test_both_engines_pay_the_same_to_the_last_bit(name: str) -> None:
    task, draw = TASKS[name], random.Random(name)
    both = [Episodes(task, 2, seed=3, engine="interpreted"), Episodes(task, 2, seed=3, engine="compiled")]
    for _ in range(20):
        speeds = [[(draw.uniform(-0.1, 0.1), draw.uniform(-0.1, 0.1)) for _ in range(task.robots)] for _ in both]
        paid = [(episodes.step(speeds).tolist(), episodes.is_over.tolist()) for episodes in both]
        assert paid[0] == paid[1]


def test_the_file_of_each_task_says_what_solves_it() -> None:
    for task in TASKS.values():
        about = importlib.import_module(task.reward.__module__).__doc__ or ""
        assert "solved" in about or "earns" in about


def test_the_file_of_a_task_may_have_data_classes_and_the_name_of_a_module(tmp_path: Path) -> None:
    for name in ("json.py", "mine.py"):
        (tmp_path / name).write_text(
            "from __future__ import annotations\nimport dataclasses\nimport json\n"
            "@dataclasses.dataclass\nclass Point:\n    x: float = 0.5\nTASK = json.dumps(Point().x)\n"
        )
        before = {**sys.modules}
        assert variable_of(tmp_path / name, "TASK") == "0.5"
        assert sys.modules == before  # so that what is sent to other processes is sent by value
