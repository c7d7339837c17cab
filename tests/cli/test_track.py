"""Paths: the true one, and the one that follows from the encoders."""

# clock: simulated

from __future__ import annotations

import asyncio

import pytest

from elib.cli.track import Track, clearance
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.physics import Box, Cylinder, Pose, RobotView, Snapshot, Wall
from elib.simulator.physics.body import RADIUS
from elib.studies.drive import length, simulation_of
from elib.testing import link_of
from elib.testing import simulation_of as simulation_in


def alone_at(x: float, y: float, **things: object) -> Snapshot:
    return Snapshot("test", 0, 0.0, 1.0, 1.0, robots=(RobotView(Pose(x, y)),), **things)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("snapshot", "distance"),
    [
        (alone_at(0.5, 0.5), 0.5),
        (alone_at(0.5, 0.1), 0.1),
        (alone_at(0.5, 0.5, walls=(Wall(0.2, 0.6, 0.8, 0.6),)), 0.1),
        (alone_at(0.5, 0.5, walls=(Wall(0.7, 0.5, 0.9, 0.5),)), 0.2),
        (alone_at(0.5, 0.5, boxes=(Box(0.7, 0.5, 0.2, 0.4),)), 0.1),
        (alone_at(0.5, 0.5, cylinders=(Cylinder(0.5, 0.8, 0.1),)), 0.2),
    ],
)
def test_clearance_is_the_distance_of_the_body_from_the_nearest_thing(snapshot: Snapshot, distance: float) -> None:
    assert clearance(snapshot) == pytest.approx(distance - RADIUS)


def test_clearance_counts_other_robots_and_is_never_negative() -> None:
    robots = (RobotView(Pose(0.5, 0.5)), RobotView(Pose(0.6, 0.5)))
    assert clearance(Snapshot("test", 0, 0.0, 1.0, 1.0, robots=robots)) == pytest.approx(0.1 - 2 * RADIUS)
    assert clearance(alone_at(0.01, 0.5)) == 0


async def _round(robot: Epuck, track: Track, seconds: float) -> None:
    await robot.set_speed(0.5, 0.3)
    for _ in range(round(seconds / track.period)):
        await track.sample()
        await asyncio.sleep(track.period)
    await track.sample()
    await robot.stop()


def test_the_encoders_tell_the_true_path_where_nothing_is_in_the_way() -> None:
    async def main(robot: Epuck) -> tuple[list[Pose], list[Pose]]:
        true = Track(robot, *simulation_of(robot))
        assert true.is_true
        await true.sample()
        told = Track(robot)
        await _round(robot, told, 6)
        await true.sample()
        return true.poses, told.poses

    true, told = run_on("sim://square?speed=max", main)
    # The robot looks along x at the start of this world, as odometry supposes.
    moved = (true[-1].x - true[0].x, true[-1].y - true[0].y)
    assert (told[-1].x, told[-1].y) == pytest.approx(moved, abs=0.002)
    assert told[-1].heading == pytest.approx(true[-1].heading, abs=0.02)


def test_the_counters_may_wrap_and_an_answer_may_be_lost_without_losing_way() -> None:
    async def main(robot: Epuck) -> tuple[Track, float]:
        await robot.set_encoders(32700, -32700)
        track, true = Track(robot), Track(robot, *simulation_of(robot))
        await track.sample()
        await robot.set_speed(0.5, -0.5)
        await asyncio.sleep(0.5)
        link_of(robot).lose_next_reply()
        await track.sample()
        await asyncio.sleep(0.1)
        await robot.stop()
        await track.sample()
        await true.sample()
        return track, true.poses[0].heading

    track, heading = run_on("sim://square?speed=max", main)
    assert len(track.poses) == 3  # pose() asks again
    assert length(track.poses) == pytest.approx(0, abs=1e-6)
    assert abs(heading) > 1
    assert track.poses[-1].heading == pytest.approx(heading, abs=0.02)


def test_a_path_of_unknown_surroundings_is_drawn_on_a_floor_that_holds_it() -> None:
    async def main(robot: Epuck) -> Track:
        track = Track(robot)
        await _round(robot, track, 10)
        return track

    track = run_on("sim://square?speed=max", main)
    snapshot, trail = track.floor()
    assert all(0 <= pose.x <= snapshot.width and 0 <= pose.y <= snapshot.depth for pose in trail)
    assert snapshot.robots[0].pose == trail[-1]
    assert length(trail) == pytest.approx(length(track.poses))


def test_a_robot_of_constant_readings_has_no_world_and_is_tracked_by_its_encoders() -> None:
    async def main(robot: Epuck) -> bool:
        simulation_in(robot).world = None
        return Track(robot, *simulation_of(robot)).is_true

    assert run_on("sim://square?speed=max", main) is False
