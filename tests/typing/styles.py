"""What a type checker sees of one row through each style. Checked by mypy; never run."""

from typing import Any, assert_type

import numpy
from numpy.typing import NDArray

import elib


async def the_async_style_gives_coroutines() -> None:
    async with elib.open("sim://") as robot:
        assert_type(await robot.proximity(), elib.Proximity)
        assert_type(await robot.set_speed(0.5, 0.5), None)
        assert_type(await robot.within(0.2).image(), elib.Image)
        assert_type(await robot.sensors(), elib.Sensors)
        assert_type(await robot.neighbours(), tuple[elib.Neighbour, ...])
        assert_type(await robot.text("V"), str)
        assert_type(await robot.i2c_scan(), list[int])
        await robot.set_led(8, elib.LedAction.TOGGLE)
        await robot.set_speed("fast", 0)  # type: ignore[arg-type]
        await robot.set_speed(0.5)  # type: ignore[call-arg]


def the_blocking_style_gives_values() -> None:
    with elib.connect("sim://") as robot:
        assert_type(robot.proximity(), elib.Proximity)
        assert_type(robot.proximity().front_right, int)
        assert_type(robot.proximity()[0], int)
        assert_type(robot.speed().left, float)
        assert_type(robot.microphone_samples(), NDArray[numpy.int16])
        assert_type(robot.within(1).battery().volts, float | None)
        assert_type(robot.sensors(), elib.Sensors)
        assert_type(robot.neighbours(), tuple[elib.Neighbour, ...])
        assert_type(robot.send_message(b"hi"), None)
        assert_type(robot.microphones().direction, float | None)
        assert_type(robot.text("V"), str)
        robot.set_speed(left=0.5, rihgt=0.5)  # type: ignore[call-arg]
        robot.set_led(0, "on")
        robot.set_camera(mode="grey")
        robot.set_obstacle_avoidance("on")
        robot.set_proximity_rate("slow")
        robot.set_speed(1.7, 0.2, clip=True)
        robot.proximity.front_left  # type: ignore[attr-defined]  # noqa: B018
        robot.begin.proximity().front_left  # type: ignore[attr-defined]  # noqa: B018


def the_begin_style_gives_futures() -> None:
    with elib.connect("sim://") as robot:
        assert_type(robot.begin.proximity(), elib.Pending[elib.Proximity])
        assert_type(robot.begin.proximity().end(), elib.Proximity)
        assert_type(robot.begin.within(1).image().result(), elib.Image)
        assert_type(robot.begin.sensors().end(), elib.Sensors)
        images = [robot.begin.image()]
        assert_type(
            elib.wait(images, first=True), tuple[list[elib.Pending[elib.Image]], list[elib.Pending[elib.Image]]]
        )


def a_name_that_is_not_there_is_a_mistake() -> None:
    elib.conect("sim://")  # type: ignore[attr-defined]
    elib.WhateverName  # type: ignore[attr-defined]  # noqa: B018


def a_command_cannot_be_assigned_to() -> None:
    with elib.connect("sim://") as robot:
        robot.speed = 0.5  # type: ignore[assignment]


def what_a_call_on_the_begin_style_gives_is_the_type_that_is_exported() -> None:
    with elib.connect("sim://") as robot:
        pending: elib.Pending[elib.Image] = robot.begin.image()
        pending.add_done_callback(lambda call: print(call.end().width, call.name, call.state))
        several: list[elib.Pending[None]] = [robot.begin.set_led(n, True) for n in range(8)]
        moved: elib.Pending[elib.Pose] = robot.begin.drive(0.1)
        print(several, moved.done(), moved.exception())
        wrong: elib.Pending[elib.Image] = robot.begin.proximity()  # type: ignore[assignment]
        print(wrong)


def the_callback_style_gives_nothing_and_types_its_callback() -> None:
    def on_reply(value: elib.Proximity, state: Any) -> None: ...

    def on_error(error: elib.ElibError, state: Any) -> None: ...

    with elib.connect("sim://") as robot:
        robot.callback(on_reply, on_error, 1).proximity()
        robot.callback(on_reply, on_error).selector()  # type: ignore[arg-type]


def a_lambda_as_a_callback_may_use_its_value_as_it_likes() -> None:
    with elib.connect("sim://") as robot:
        robot.callback(lambda near, state: print(state, near.front_right), print, "right:").proximity()
        robot.callback(lambda value, state: None).within(1).set_speed(0.5, 0.5)
        robot.callback(None, lambda error, state: print(error.message, state)).selector()
        robot.callback().sleep(1)


def a_lambda_on_a_begun_call_knows_the_type_of_the_reading() -> None:
    with elib.connect("sim://") as robot:
        robot.begin.proximity().add_done_callback(lambda call: assert_type(call.end(), elib.Proximity))
        robot.begin.proximity().add_done_callback(lambda call: print(call.end().rigth))  # type: ignore[attr-defined]


async def the_names_of_behaviours_are_there_flat() -> None:
    @elib.behaviour(world="light")
    async def stand(robot: elib.Epuck, run: elib.RunContext) -> None:
        run.state("standing")
        await elib.react(robot, elib.Epuck.stop)

    assert_type(elib.play(stand, seconds=1).reason, str)
    assert_type(elib.connect_async("sim://"), elib.Epuck)


def the_class_itself_gives_the_row() -> None:
    assert_type(elib.Epuck.proximity.spec.letter, str)
