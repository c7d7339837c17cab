"""Locating a clap: what the behaviour hears, says and does."""

from __future__ import annotations

from elib.base.pose import Pose
from elib.behaviours import RunContext, find, play
from elib.robot.aio import Epuck
from elib.simulator.physics import Sound as Source
from elib.simulator.physics import World
from elib.testing.inside import transport_of


def test_in_a_quiet_room_it_says_once_that_there_is_nothing_to_hear() -> None:
    outcome = play(find("locate-clap"), "sim://square?speed=max", seconds=20)
    assert outcome.messages == (outcome.messages[0],)
    assert outcome.messages[0].startswith("no sound: ")
    assert [name for _, name in outcome.states] == ["listening"]


def test_a_sound_below_the_threshold_is_ignored() -> None:
    outcome = play(find("locate-clap"), "sim://beeper?speed=max", seconds=8, options={"threshold": 1000})
    assert "a sound has 1000 or more" in outcome.messages[0]


def test_it_says_what_it_heard_and_where_before_it_turns_there() -> None:
    outcome = play(find("locate-clap"), "sim://beeper?firmware=epuck2&speed=max", seconds=8)
    states = [name for _, name in outcome.states]
    assert states[0] == "listening"
    assert states[1] in ("turning", "unclear")
    assert any("degrees to the" in message for message in outcome.messages)


def test_the_gallerys_beeper_beeps_all_the_time_and_is_heard_everywhere() -> None:
    world = World.load("beeper", seed=1)
    source = world.scene.sounds[0]
    assert isinstance(source, Source)
    for x, y in ((0.05, 0.05), (1.15, 0.05), (0.05, 0.85), (1.15, 0.85)):
        world.move_robot(0, Pose(x, y))
        world.step()
        assert max(world.microphones(0)) > 60


def test_beside_the_source_where_its_direction_is_inexact_it_still_comes_to_rest() -> None:
    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        transport = transport_of(robots[0])
        assert transport.simulation.world is not None
        source = transport.simulation.world.scene.sounds[0]
        transport.simulation.world.move_robot(0, Pose(source.x - 0.05, source.y, 2.0))

    outcome = play(find("locate-clap"), "sim://beeper?speed=max", seconds=20, watch=watch)
    assert outcome.states[-1][1] == "facing"
    assert outcome.states[-1][0] < 8
