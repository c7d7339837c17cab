"""What Python tells a person about a command: its help, its signature, and the errors of wrong calls."""

import copy
import gc
import inspect
import math
import pydoc
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import elib
from elib.link.protocol.commands import SPECS
from elib.link.protocol.profiles import PROFILES, rule
from elib.robot.actions import Actions
from elib.robot.swarms.group import Group
from elib.testing import simulated

SIM = "sim://square?speed=max"


@pytest.fixture(scope="module")
def robot():
    with elib.connect(SIM) as robot:
        yield robot


def test_the_help_of_a_command_has_every_argument_with_unit_and_range(robot: elib.BlockingEpuck) -> None:
    shown = pydoc.plain(pydoc.render_doc(robot.set_led))
    assert "set_led(n: int, action: LedAction | int | bool | str) -> None" in shown
    assert "Switch ring LED *n*" in shown
    assert "n: a whole number from 0 to 8" in shown
    assert "action: one of OFF, ON, TOGGLE" in shown
    for spec in SPECS.values():
        doc = inspect.getdoc(getattr(robot, spec.name))
        assert doc is not None
        assert doc.startswith(spec.doc)
        assert [f"{each.name}: {rule(each.quantity)}" for each in spec.parameters if each.name not in doc] == []


def test_no_signature_has_a_name_in_quotes_or_one_that_only_elib_knows(robot: elib.BlockingEpuck) -> None:
    assert str(inspect.signature(robot.set_speed)) == "(left: float, right: float, *, clip: bool = False) -> None"
    assert str(inspect.signature(robot.drive)) == "(distance: float, *, speed: float = 0.064) -> Pose"
    assert "proximity() -> Proximity of" in repr(robot.proximity)
    for name in [*SPECS, *(name for name in dir(Actions) if not name.startswith("_"))]:
        shown = str(inspect.signature(getattr(robot, name)))
        assert "'" not in shown.replace("family: str = '16h5'", ""), "a text in quotes is none"
        assert "v." not in shown


@pytest.mark.parametrize(
    ("args", "kwargs", "message"),
    [
        ((1,), {}, "set_speed(left, right) needs right: a number from -1 to 1 rev/s"),
        ((), {"right": 1}, "set_speed(left, right) needs left: a number from -1 to 1 rev/s"),
        ((), {}, "set_speed(left, right) needs left: a number from -1 to 1 rev/s"),
        ((0.1, 0.2, 0.3), {}, "set_speed(left, right) takes no further argument 0.3"),
        ((0.1,), {"rihgt": 0.2}, "set_speed(left, right) has no argument 'rihgt'"),
        ((0.1,), {"left": 0.2, "right": 0.2}, "set_speed(): multiple values for argument 'left'"),
    ],
)
def test_a_wrong_number_of_arguments_is_told_what_is_missing_or_too_many(
    args: tuple[float, ...], kwargs: dict[str, float], message: str, robot: elib.BlockingEpuck
) -> None:
    with pytest.raises(elib.ArgumentError) as caught:
        robot.set_speed(*args, **kwargs)
    assert caught.value.message == message


@pytest.mark.parametrize(
    ("call", "message", "hint"),
    [
        (lambda on: on.drive(), "drive(distance) needs distance: a number from -5 to 5 m", ""),
        (
            lambda on: on.drive(0.1, 0.05),
            "drive(distance) takes no further argument 0.05",
            "write it with its name: speed=...",
        ),
        (lambda on: on.turn(agle=1), "turn(angle) has no argument 'agle'", "did you mean angle?"),
        (lambda on: on.go_to(), "go_to(x, y, heading) needs x: a number from -5 to 5 m", ""),
        (lambda on: on.sleep(), "sleep(seconds) needs seconds: a number from 0 to 3600 s", ""),
        (lambda on: on.text(), "text(command) needs command", ""),
        (lambda on: on.sensors(1), "sensors() takes no further argument 1", ""),
        (lambda on: on.tags(), "tags(size) needs size: a number from 0.005 to 1 m", ""),
        (lambda on: on.drive("x"), "distance is 'x'; it must be a number from -5 to 5 m", ""),
        (
            lambda on: on.drive(0.1, speed=9),
            "speed is 9 m/s; it must be a number from 0.001 to 0.128805 m/s",
            "did you mean 0.09 (9 cm/s) or 0.009 (9 mm/s)?",
        ),
        (lambda on: on.go_to(0.1, np.zeros(2)), "y is array([0., 0.]); it must be a number from -5 to 5 m", ""),
        (lambda on: on.sleep(-1), "seconds is -1 s; it must be a number from 0 to 3600 s", ""),
    ],
)
def test_a_call_of_several_commands_is_told_the_same_in_every_style(
    call: Callable[[Any], object], message: str, hint: str, robot: elib.BlockingEpuck
) -> None:
    for style in (robot, robot.begin, robot.callback(), robot.robot):
        with pytest.raises(elib.ArgumentError) as caught:
            call(style)
        assert (caught.value.message, caught.value.hint) == (message, hint)


@pytest.mark.parametrize("firmware", PROFILES)
def test_the_range_that_is_said_is_that_of_the_robots_firmware(firmware: str) -> None:
    with elib.connect(f"{SIM}&firmware={firmware}") as robot, pytest.raises(elib.ArgumentError) as caught:
        robot.set_speed(0)  # type: ignore[call-arg]  # that is the mistake
    most = "1.1" if firmware == "epuck2" else "1"
    assert caught.value.message.endswith(f"needs right: a number from -{most} to {most} rev/s")


def test_a_forgotten_await_is_named_by_its_command() -> None:
    @simulated
    async def story() -> list[str]:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            async with elib.open(SIM) as robot:
                robot.proximity()  # type: ignore[unused-coroutine]  # that is the mistake
                robot.drive(0.1)  # type: ignore[unused-coroutine]
                gc.collect()
        return [str(each.message) for each in caught]

    assert story() == [
        "coroutine 'Epuck.proximity' was never awaited",
        "coroutine 'Epuck.drive' was never awaited",
    ]


def test_to_await_a_call_on_the_begin_style_is_answered_with_what_to_do(robot: elib.BlockingEpuck) -> None:
    pending = robot.begin.proximity()
    advice = r"^begin\.proximity\(\) is under way: call \.end\(\) for its value, or use elib\.open\(\) for await$"
    with pytest.raises(TypeError, match=advice):
        pending.__await__()  # type: ignore[attr-defined]  # as await does
    with pytest.raises(TypeError, match=advice):
        max(pending)  # type: ignore[call-overload]
    with pytest.raises(AttributeError, match=advice):
        pending.front_left  # type: ignore[attr-defined]  # noqa: B018
    assert len(pending.end()) == 8


WITHOUT_BRACKETS: tuple[Callable[[Any], object], ...] = (
    lambda on: on.proximity.front_left,
    lambda on: on.image.save("picture.png"),
    lambda on: on.pose.x,
    lambda on: on.set_speed.left,
    lambda on: max(on.proximity),
    lambda on: on.proximity[0],
    lambda on: on.proximity.__await__(),  # as await does
    lambda on: on.proximity > 100,
    lambda on: 100 - on.sensors,
    lambda on: math.sqrt(on.battery),
    lambda on: round(on.drive),
    lambda on: 3 in on.ground,
    lambda on: len(on.proximity),
    lambda on: range(on.selector),
    lambda on: on.selector == 3,
    lambda on: on.selector != 3,
    lambda on: on.selector in (1, 2),
    lambda on: f"{on.temperature:.1f}",
)


@pytest.mark.parametrize(
    ("spelt", "style"),
    [
        ("robot.{}", lambda robot: robot),
        ("robot.begin.{}", lambda robot: robot.begin),
        ("robot.callback(...).{}", lambda robot: robot.callback()),
        ("await robot.{}", lambda robot: robot.robot),
        ("await robots.all.{}", lambda robot: Group([robot.robot]).all),
        ("await robots.all.collect.{}", lambda robot: Group([robot.robot]).all.collect),
    ],
)
def test_a_command_without_its_brackets_is_told_how_it_is_written(
    spelt: str, style: Callable[[elib.BlockingEpuck], object], robot: elib.BlockingEpuck
) -> None:
    calls = {"set_speed": "set_speed(left, right)", "drive": "drive(distance)"}
    for use in WITHOUT_BRACKETS:
        with pytest.raises((TypeError, AttributeError)) as caught:
            use(style(robot))
        name = str(caught.value).partition(" ")[0]
        assert str(caught.value) == f"{name} is a command: write {spelt.format(calls.get(name, f'{name}()'))}"


def test_a_command_without_its_brackets_is_still_a_function(robot: elib.BlockingEpuck) -> None:
    with pytest.warns(UserWarning, match=r"^proximity is a command: write robot\.proximity\(\); .* is always true$"):
        assert robot.proximity
    assert callable(copy.copy(robot.proximity))
    assert len({robot.proximity, robot.selector}) == 2
    assert str(robot.proximity) == f"{robot.proximity}"
    assert not hasattr(robot.proximity, "front_left")
    assert "Method in module" in pydoc.plain(pydoc.render_doc(robot.proximity))


def test_the_class_of_a_robot_called_with_a_url_names_what_opens_one() -> None:
    with pytest.raises(elib.ArgumentError, match=r"hint: async with elib\.open\('sim://'\) as robot"):
        elib.Epuck("sim://")  # type: ignore[arg-type]


def test_a_picture_that_cannot_be_saved_as_told_is_refused(robot: elib.BlockingEpuck, tmp_path: Path) -> None:
    picture = robot.image()
    for name in ("ahead", "ahead.xyz", "ahead.psd"):  # Pillow reads the last one, and does not write it
        with pytest.raises(elib.ArgumentError, match=f"a picture cannot become .*{name}'\nhint: .* .png or .jpg"):
            picture.save(tmp_path / name)
    for scale in (0, 1.5, 10**6):
        with pytest.raises(elib.ArgumentError, match=r"scale is .*it must be a whole number from 1 to 50"):
            picture.save(tmp_path / "a.png", scale=scale)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []
