"""The robots behind every door."""

import asyncio
import signal
import socket

import pytest
from elib_process import started

from elib.base.errors import ElibError, LinkClosed
from elib.doors.robots import connected
from elib.panel.slot import Phase
from elib.panel.watching import virtual
from elib.testing import simulated
from lanes import short
from shared import PATIENCE


@simulated
async def test_every_robot_of_a_world_is_connected_and_stands_at_the_end():
    async with connected(["sim://arena?robots=2"]) as panel:
        slots = list(panel.slots.values())
        assert [*panel.slots] == ["1", "2"]
        assert [slot.phase for slot in slots] == [Phase.CONNECTED] * 2
        assert slots[0].drive.steer("client", 1.0, 1.0)
        world = virtual(slots[0].robot).simulation.world
        start = world.pose(0)
        await asyncio.sleep(0.2)
        assert world.pose(0) != start
    assert not slots[0].drive.may_move
    assert slots[0].phase is Phase.DISCONNECTED


async def test_a_robot_that_does_not_answer_is_the_error_and_the_others_are_disconnected():
    with pytest.raises(ElibError, match="nothing-here"):
        async with connected(["sim://", "serial:///dev/nothing-here"]):
            raise AssertionError("it opened")


async def test_a_door_without_a_robot_is_refused():
    with pytest.raises(LinkClosed, match="no robot"):
        async with connected([]):
            raise AssertionError("it opened")


SERVE, FOXGLOVE, AGENT = ["serve"], ["foxglove"], ["agent", "--http", "--allow-real"]


@pytest.mark.parametrize("words", short([SERVE, FOXGLOVE, AGENT], SERVE), ids=lambda words: words[0])
@pytest.mark.parametrize("number", short([signal.SIGINT, signal.SIGTERM], signal.SIGINT))
def test_a_signal_ends_a_door_whose_robots_are_still_being_connected(words: tuple[str, ...], number: signal.Signals):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        silent.settimeout(PATIENCE)
        with started(*words, f"tcp://127.0.0.1:{silent.getsockname()[1]}", "--port", "0") as run:
            robot, _ = silent.accept()
            with robot:
                assert run.end(number) == (0 if number is signal.SIGINT else 128 + number)
            assert "no robot answered" not in run.err.rest()
