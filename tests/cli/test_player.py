"""The player of recordings: how its place moves with time and keys."""

from __future__ import annotations

import pytest

from elib.base.pose import Pose
from elib.cli.player import Player, keys_of
from elib.records.timeline import Moment

MOMENTS = [
    Moment(0.0, "state", "searching"),
    Moment(1.0, "call", "set_speed(0.1, 0.2)  ok", speed=(0.1, 0.2), pose=Pose(1, 2)),
    Moment(2.0, "call", "proximity()  ok", readings={"proximity": (1, 2, 3, 4, 5, 6, 7, 8)}),
    Moment(15.0, "state", "found"),
]


def player(**more: object) -> Player:
    return Player(MOMENTS, 20.0, **more)  # type: ignore[arg-type]


def test_what_happened_at_the_very_beginning_is_played() -> None:
    assert [moment.text for moment in player().advance(0.01)] == ["searching"]


def test_time_that_passes_brings_what_happened_in_it() -> None:
    playing = player()
    playing.advance(0.5)
    assert [moment.time for moment in playing.advance(1.6)] == [1.0, 2.0]
    assert playing.time == pytest.approx(2.1)


def test_the_speed_scales_a_persons_time() -> None:
    playing = player(speed=4.0)
    playing.advance(0.5)
    assert playing.time == pytest.approx(2.0)
    playing.press("+")
    assert playing.speed == 8
    playing.press("-")
    assert playing.speed == 4


def test_the_space_bar_pauses_and_goes_on() -> None:
    playing = player()
    playing.press(" ")
    assert playing.advance(5) == ()
    assert playing.time == 0
    playing.press(" ")
    assert len(playing.advance(5)) == 3


def test_the_end_stops_it_and_the_space_bar_begins_again() -> None:
    playing = player()
    playing.advance(100)
    assert (playing.time, playing.is_playing) == (20.0, False)
    playing.press(" ")
    assert (playing.time, playing.is_playing) == (0.0, True)


def test_the_arrows_step_from_moment_to_moment_and_pause() -> None:
    playing = player()
    assert [moment.text for moment in playing.press("right")] == ["searching"]
    assert [moment.text for moment in playing.press("right")] == ["set_speed(0.1, 0.2)  ok"]
    assert not playing.is_playing
    assert playing.time == 1.0
    playing.press("right")
    assert [moment.time for moment in playing.press("left")] == [1.0]
    playing.press("end")
    assert playing.press("right") == ()


def test_after_a_jump_the_arrow_goes_back_to_the_moment_before() -> None:
    playing = player()
    playing.jump(10)
    assert [moment.time for moment in playing.press("left")] == [2.0]
    assert [moment.time for moment in playing.press("left")] == [1.0]
    playing.press("end")
    assert [moment.time for moment in playing.press("left")] == [15.0]


def test_the_scene_goes_on_and_is_made_again_after_a_jump_back() -> None:
    playing = player()
    playing.advance(3)
    assert playing.robot.near
    playing.advance(13)
    assert (playing.robot.state, bool(playing.robot.near)) == ("found", True)
    playing.jump(1.5)
    assert (playing.robot.state, playing.robot.near) == ("searching", ())


@pytest.mark.parametrize(("keys", "time"), [("]", 10), ("]]", 20), ("][", 0), ("g12.5\n", 12.5), ("g9\x7f3\r", 3)])
def test_jumps_and_typed_times_go_to_their_time(keys: str, time: float) -> None:
    playing = player()
    for key in keys:
        playing.press(key)
    assert playing.time == time


@pytest.mark.parametrize("keys", ["g\x1b", "gx\n", "g..\n"])
def test_text_that_is_not_a_time_is_ignored(keys: str) -> None:
    playing = player()
    for key in keys:
        playing.press(key)
    assert (playing.time, playing.prompt, playing.is_over) == (0.0, None, False)


def test_the_scene_is_what_was_last_known() -> None:
    playing = player()
    playing.jump(10)
    scene = playing.robot
    assert (scene.state, scene.speed, scene.near[7], scene.pose) == ("searching", (0.1, 0.2), 8, Pose(1, 2))
    playing.jump(0.5)
    assert (playing.robot.speed, playing.robot.near) == ((0.0, 0.0), ())


def test_q_ends_it() -> None:
    playing = player()
    playing.press("q")
    assert playing.is_over


def test_what_terminals_send_becomes_keys() -> None:
    assert keys_of("a \x1b[C\x1b[D\x1bOD\x1b[5~") == ["a", " ", "right", "left", "left", "["]
    assert keys_of("\x1b[1;5Cq") == ["q"]
    assert keys_of("\x1b") == ["\x1b"]
