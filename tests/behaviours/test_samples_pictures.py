"""The samples that show pictures, in the begin style."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as Files

from elib.base.errors import LinkLost, RemoteProtocolError, ReplyTimeout
from elib.behaviours import RunContext, RunResult, find, play
from elib.behaviours._run.pictures import TRIES, draw, image_of, retry, show
from elib.link.protocol.colours import Grey, Hue, coloured
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.link.session import Called, Ended, TraceEvent
from elib.robot.aio import Epuck
from elib.testing.inside import transport_of
from shared import Terminal

SIM = "sim://red-boxes?speed=max"
NAMES = ["show-image", "show-processed-image"]
GREY = np.array([[0, 128, 255], [9, 9, 9], [255, 0, 0]], np.uint8)
RED_OVER_BLUE = np.array([[[255, 0, 0]], [[0, 0, 255]]], np.uint8)


class Late:
    """A picture that was begun and comes late, or never."""

    def __init__(self, image: Image | None) -> None:
        self._image = image

    def result(self, timeout: float | None = None) -> Image:
        raise ReplyTimeout("image() did not end within 1 s", image=self._image)

    def end(self) -> Image:
        return self.result()

    def done(self) -> bool:
        return True

    def cancel(self) -> bool:
        return False


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to keep pictures in."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    return tmp_path


@pytest.fixture
def run() -> RunContext:
    return RunContext(lambda: 0.0)


def shown_on_a_terminal(run: RunContext, pixels: NDArray[np.uint8]) -> str:
    """Return what a terminal gets."""
    with contextlib.redirect_stdout(Terminal()) as stream:
        show(run, pixels, "seen.png")
    return stream.getvalue()


def pictures(name: str, url: str = SIM) -> tuple[RunResult, list[Image]]:
    """Run *name*; return the result and the pictures that the robot sent."""
    seen: list[Image] = []

    def note(time: float, event: TraceEvent) -> None:
        if isinstance(event, Ended) and isinstance(event.value, Image):
            seen.append(event.value)

    return play(find(name), url, seconds=120, watch=lambda run, robots: robots[0].trace(note)), seen


# -- the pure parts ----------------------------------------------------------------------------------------------------


def test_a_picture_without_colours_is_drawn_by_brightness_every_second_row() -> None:
    assert draw(GREY, 80, colour=False) == " +@\n@"


def test_a_picture_in_colour_puts_two_pixels_in_a_cell_and_leaves_an_odd_one_alone() -> None:
    assert draw(RED_OVER_BLUE, 80, colour=True) == "\x1b[38;2;255;0;0m\x1b[48;2;0;0;255m▀\x1b[0m"
    assert draw(GREY[:1, :1], 80, colour=True) == "\x1b[38;2;0;0;0m▀\x1b[0m"


def test_a_picture_wider_than_the_terminal_is_thinned_out() -> None:
    drawn = draw(np.full((4, 100), 255, np.uint8), 40, colour=False)
    assert all(len(line) <= 40 for line in drawn.splitlines())


def test_a_late_picture_is_used_and_a_missing_one_is_an_error() -> None:
    image = Image(CameraMode.GREY, 1, 1, b"\0")
    assert image_of(Late(image)) is image
    with pytest.raises(ReplyTimeout):
        image_of(Late(None))


@pytest.mark.parametrize("failure", [ReplyTimeout("lost"), RemoteProtocolError("lost")])
def test_work_is_done_again_until_its_answer_comes(run: RunContext, failure: Exception) -> None:
    answers = iter([failure, failure, 7])

    def work() -> object:
        answer = next(answers)
        if isinstance(answer, Exception):
            raise answer
        return answer

    assert retry(run, work) == 7
    assert run.messages == ("lost; trying again",) * 2


def test_after_five_lost_answers_the_connection_is_called_damaged(run: RunContext) -> None:
    tries: list[int] = []

    def work() -> None:
        tries.append(1)
        raise ReplyTimeout("lost")

    with pytest.raises(LinkLost, match="no picture came in 5 tries: lost") as caught:
        retry(run, work)
    assert len(tries) == TRIES
    assert "connect again" in caught.value.hint


def test_nothing_is_tried_when_the_run_is_over(run: RunContext) -> None:
    run.finish("enter")
    assert retry(run, lambda: 7) is None


# -- showing -----------------------------------------------------------------------------------------------------------


def test_a_picture_is_kept_magnified_and_the_person_is_told_where(run: RunContext, folder: Path) -> None:
    show(run, RED_OVER_BLUE, "seen.png")
    with Files.open(folder / "seen.png") as kept:
        assert kept.size == (6, 12)
        assert np.asarray(kept)[::6, ::6].tolist() == RED_OVER_BLUE.tolist()
    assert run.messages == (f"the picture is in {folder / 'seen.png'}",)


def test_a_folder_where_no_file_can_be_written_is_reported_and_does_not_end_it(run: RunContext) -> None:
    show(run, GREY, "nowhere/seen.png")
    assert run.messages == ("the picture could not be saved in nowhere/seen.png: No such file or directory",)


def test_a_terminal_shows_the_picture_in_colour(run: RunContext) -> None:
    expected = "\r\x1b[K" + draw(RED_OVER_BLUE, 80, colour=True) + "\n"
    assert shown_on_a_terminal(run, RED_OVER_BLUE) == expected


def test_a_person_who_wants_no_colours_gets_characters(run: RunContext, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    assert shown_on_a_terminal(run, GREY).endswith(" +@\n@\n")


def test_nothing_is_drawn_where_there_is_no_terminal(run: RunContext, capsys: pytest.CaptureFixture[str]) -> None:
    show(run, GREY, "seen.png")
    assert capsys.readouterr().out == ""


def test_nothing_is_drawn_on_a_dumb_terminal(run: RunContext, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "dumb")
    assert shown_on_a_terminal(run, GREY) == ""


# -- the samples -------------------------------------------------------------------------------------------------------


def test_the_picture_shown_is_the_one_the_robot_sent(folder: Path) -> None:
    outcome, (image,) = pictures("show-image")
    with Files.open(folder / "elib-image.png") as kept:
        assert np.array_equal(np.asarray(kept)[::6, ::6], image.pixels)
    assert (image.width, image.height, image.mode) == (40, 40, CameraMode.COLOUR)
    assert outcome.messages == (f"the picture is in {folder / 'elib-image.png'}",)
    assert [state for _, state in outcome.states] == ["looking", "showing"]


def test_three_pictures_show_in_white_what_is_red(folder: Path) -> None:
    outcome, images = pictures("show-processed-image")
    assert len(images) == 3
    grey = Grey()
    for number, image in enumerate(images, 1):
        fraction = coloured(image.pixels, Hue.RED, grey).mean()
        assert fraction > 0.01
        with Files.open(folder / f"elib-red-{number}.png") as kept:
            white = np.asarray(kept)[::6, ::6]
        assert set(np.unique(white)) == {0, 255}
        assert (white == 255).mean() == pytest.approx(fraction)
        assert f"picture {number}: {fraction:.0%} of it is red" in outcome.messages


@pytest.mark.parametrize("name", NAMES)
def test_a_lost_picture_is_asked_for_again(name: str, folder: Path) -> None:
    lost: list[int] = []

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        def lose(time: float, event: TraceEvent) -> None:
            transport = transport_of(robots[0])
            if isinstance(event, Called) and event.request.is_picture and len(lost) < 2:
                lost.append(1)
                transport.robot.link.silence()
            elif isinstance(event, Ended) and event.error is not None:
                transport.robot.link.end_silence()

        robots[0].trace(lose)

    outcome = play(find(name), SIM, watch=watch)
    assert outcome.reason == "done"
    assert sum("trying again" in text for text in outcome.messages) == 2
    assert any("the picture is in" in text for text in outcome.messages)
