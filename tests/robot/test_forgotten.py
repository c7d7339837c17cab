"""A robot that the program no longer refers to: it stands still, and its port is free."""

import asyncio
import gc
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from served import served_from_a_thread

import elib
from elib.base.errors import LinkBusy
from elib.testing import emulator_of
from shared import PATIENCE, until, wait_until

MAX, REAL = "sim://square?speed=max&firmware=btcom-2.0", "sim://square?baud=0"


def driving(url: str) -> tuple[elib.BlockingEpuck, Callable[[], list[int]]]:
    """Open a robot, let it drive, and return it and a function that tells the speeds of its wheels."""
    robot = elib.connect(url)
    robot.set_speed(0.5, 0.5)
    motors = emulator_of(robot).firmware.motors
    return robot, lambda: [motor.speed for motor in motors]


@pytest.fixture(params=[MAX, REAL])
def url(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(autouse=True, scope="module")
def quick_collections() -> Iterator[None]:
    """Let a collection look only at what these tests have made: looking at everything takes long."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


def test_a_robot_stops_when_the_last_reference_to_it_is_dropped(url: str) -> None:
    robot, wheels = driving(url)
    assert wheels() == [500, 500]
    del robot
    assert wheels() == [0, 0]


def test_a_robot_in_a_circle_of_references_stops_when_that_is_collected(url: str) -> None:
    robot, wheels = driving(url)
    circle: list[Any] = [robot]
    circle.append(circle)
    del robot, circle
    gc.collect()
    assert wheels() == [0, 0]


@pytest.mark.parametrize(
    "part",
    [
        lambda robot: robot.within(1),
        lambda robot: robot.begin,
        lambda robot: robot.begin.within(1),
        lambda robot: robot.begin.sleep(60),
        lambda robot: robot.callback(),
        lambda robot: robot.events,
        lambda robot: robot.watch("selector"),
        lambda robot: robot.selector,
    ],
)
def test_a_robot_goes_on_while_any_part_of_it_is_referred_to(
    url: str, part: Callable[[elib.BlockingEpuck], Any]
) -> None:
    robot, wheels = driving(url)
    kept = part(robot)
    del robot
    gc.collect()
    assert wheels() == [500, 500]
    del kept
    gc.collect()
    assert wheels() == [0, 0]


def test_a_robot_goes_on_while_a_callback_is_pending_and_stops_after_it(url: str) -> None:
    called = threading.Event()
    seen: list[list[int]] = []

    def begin() -> Callable[[], list[int]]:
        robot, wheels = driving(url)
        robot.callback(lambda value, state: (seen.append(wheels()), called.set())).sleep(0.2)
        return wheels

    wheels = begin()
    assert called.wait(PATIENCE)
    assert seen == [[500, 500]]

    def stands() -> bool:
        gc.collect()  # an event loop's futures refer to each other in circles
        return wheels() == [0, 0]

    wait_until(stands)


def test_a_robot_that_is_dropped_in_a_running_loop_stops(url: str) -> None:
    async def cell() -> None:
        robot, wheels = driving(url)
        del robot
        await until(lambda: wheels() == [0, 0])

    asyncio.run(cell())


def test_a_dropped_robot_that_was_opened_with_keep_moving_keeps_moving(url: str) -> None:
    robot = elib.connect(url, keep_moving=True)
    robot.set_speed(0.5, 0.5)
    motors = emulator_of(robot).firmware.motors
    del robot
    assert [motor.speed for motor in motors] == [500, 500]


@pytest.mark.skipif(sys.platform == "win32", reason="needs ptys")
def test_the_port_of_a_forgotten_robot_can_be_opened_again() -> None:
    with served_from_a_thread("pty") as there:
        for _ in range(3):
            robot = elib.connect(there.url)
            robot.set_speed(0.5, 0.5)
            with pytest.raises(LinkBusy, match="close the robot object that this program made before"):
                elib.connect(there.url)
            del robot
        with elib.connect(there.url) as robot:
            robot.selector()  # what was sent before has arrived with that
            assert not there.is_turning


def test_a_closed_robot_leaves_no_thread_behind_when_it_is_dropped(url: str) -> None:
    before = set(threading.enumerate())
    robot, _ = driving(url)
    robot.close()
    del robot
    assert set(threading.enumerate()) <= before
