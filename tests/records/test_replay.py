"""A recording as a robot: the same answers at the same times, the first difference named, going on from anywhere."""

# clock: simulated, but for two runs of another speed, in which every time is that of the recording
from __future__ import annotations

import asyncio
import math
import random
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

import pytest

import elib
from elib.base.errors import ArgumentError, LinkBusy, LinkLost, ReplayDiffers, SimulationError, Unsupported
from elib.base.extras import install
from elib.base.timebase import new_loop
from elib.behaviours import BehaviourStyle, RunContext, RunResult, behaviours, find, play
from elib.link.protocol.profiles import PROFILES
from elib.link.session import Called, TraceEvent
from elib.link.transport import open_transport
from elib.records.reader import read_recording
from elib.records.state import state_at
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.sim_transport import SimTransport
from elib.simulator.physics import World
from elib.testing import simulation_of, world_of
from elib.testing.inside import transport_of
from lanes import short
from shared import with_fault

T = TypeVar("T")
SIM = "sim://arena?speed=max&seed=3"


def recorded(path: Path, main: Callable[[Epuck], Awaitable[T]], url: str = SIM) -> T:
    """Run a program, and record it from its first command to its last."""

    async def program(robot: Epuck) -> T:
        robot.record(path)
        return await main(robot)

    return run_on(url, program)


def replay(path: Path, *keys: str) -> str:
    return f"replay://{path}?{'&'.join(('speed=max', *keys))}"


async def wander(robot: Epuck) -> list[object]:
    """Look and drive, and return all that was heard and when."""
    heard: list[object] = []
    for turn in range(20):
        near = await robot.proximity()
        heard += [(near.time, tuple(near))]
        await robot.set_speed(0.3, 0.3 if near.front_left < 200 else -0.3)
        if turn % 5 == 0:
            heard += [tuple(await robot.encoders()), (await robot.image()).raw]
        await asyncio.sleep(0.1)
    return heard


def test_a_replayed_program_hears_the_recorded_answers_at_the_recorded_times(path: Path) -> None:
    origins: list[str] = []

    async def look(robot: Epuck) -> list[object]:
        heard = await wander(robot)
        origins.append((await robot.proximity()).origin)
        return heard

    first = recorded(path, look)
    assert run_on(replay(path), look) == first
    assert origins == ["simulator", "replay"], "replayed values say that they are"


@pytest.mark.parametrize("firmware", PROFILES)
def test_every_firmware_can_be_replayed(path: Path, firmware: str) -> None:
    async def ask(robot: Epuck) -> list[object]:
        await robot.set_led(3, elib.LedAction.ON)
        everything = await robot.sensors()
        return [robot.firmware, everything, (await robot.version()).text]

    first = recorded(path, ask, f"{SIM}&firmware={firmware}")
    assert first[0] == firmware
    assert run_on(replay(path), ask) == first


def played(name: str, url: str, seconds: float, record: Path | None = None) -> tuple[RunResult, list[object]]:
    """Return the result of a behaviour, and every call that it made with its time."""
    calls: list[object] = []

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        def note(time: float, event: TraceEvent) -> None:
            if isinstance(event, Called):
                calls.append((time, event.request.text))

        robots[0].trace(note)
        if record is not None:
            robots[0].record(record)

    return play(find(name), url, seconds=seconds, watch=watch), calls


@pytest.mark.parametrize(
    ("name", "seconds"),
    [
        ("avoid", 20),
        ("go-x-cm", 20),
        *(
            pytest.param(name, seconds, marks=pytest.mark.long)
            for name, seconds in (("billiard", 20), ("bull", 30), ("braitenberg", 20), ("go-to-light", 30))
        ),
    ],
)
def test_a_behaviour_replayed_from_its_recording_takes_the_same_decisions(
    path: Path, name: str, seconds: float
) -> None:
    live, calls = played(name, f"{find(name).url.partition('?')[0]}?speed=max&seed=5", seconds, path)
    again, calls_again = played(name, replay(path), seconds)
    assert len(calls) > 50
    assert calls_again == calls
    assert (again.states, again.duration, again.reason) == (live.states, live.duration, live.reason)


DRIVING = [each for each in behaviours().values() if each.style in (BehaviourStyle.ASYNC, BehaviourStyle.BLOCKING)]


@pytest.mark.parametrize("name", short([each.name for each in DRIVING], "go-x-cm", "follow-ball"))
def test_a_behaviour_is_replayed_in_real_time_too_over_any_link(
    tmp_path: Path, path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)  # some of them leave files
    seed = random.Random(name).getrandbits(32)
    world = find(name).url.partition("?")[0]
    live, calls = played(name, f"{world}?speed=max&seed={seed}&latency=0.02&loss=0.02", 10, path)
    again, calls_again = played(name, f"replay://{path}?speed=50", 10)  # real time, but fifty times as fast
    assert calls_again == calls
    assert (again.states, again.reason) == (live.states, live.reason)


def test_a_replay_that_ends_elsewhere_than_its_recording_does_not_say_that_the_robot_may_be_moving(
    path: Path,
) -> None:
    played("avoid", SIM, 5, path)
    again, _ = played("avoid", replay(path), 3.33)
    assert (again.reason, again.duration) == ("time", pytest.approx(3.33))
    with pytest.raises(ReplayDiffers) as caught:
        played("avoid", replay(path), 10)
    assert "may still be moving" not in str(caught.value)
    with pytest.raises(ReplayDiffers) as caught:
        played("billiard", replay(path), 5)
    assert "may still be moving" not in str(caught.value)


@pytest.mark.parametrize("faults", ["loss=0.1", "latency=0.15&jitter=0.02", "fault=half-answers"])
def test_link_faults_are_replayed_too(path: Path, faults: str) -> None:
    live, calls = played("avoid", f"{SIM}&{faults}", 20, path)
    again, calls_again = played("avoid", replay(path), 20)
    assert calls_again == calls
    assert again.statistics == live.statistics


def cut(folder: Path) -> str:
    return with_fault(folder, 'kind = "cut"\nfrom = 3\nuntil = 5\n', SIM)


def test_a_link_that_was_lost_is_lost_and_comes_back_when_it_came_back(tmp_path: Path, path: Path) -> None:
    live, calls = played("billiard", cut(tmp_path), 12, path)
    again, calls_again = played("billiard", replay(path), 12)
    assert any(entry.data["event"] == "back" for entry in read_recording(path).entries("/notes"))
    assert calls_again == calls
    assert (again.states, again.duration) == (live.states, live.duration)


def test_a_program_that_was_lost_is_lost_again_at_the_same_time(tmp_path: Path, path: Path) -> None:
    async def until_lost(robot: Epuck) -> tuple[float, str]:
        try:
            while True:
                await robot.proximity()
                await asyncio.sleep(0.1)
        except LinkLost as error:
            return robot.time, error.message.partition(" (as recorded")[0]

    live = recorded(path, until_lost, cut(tmp_path))
    assert live[0] == pytest.approx(3, abs=0.3)
    again = run_on(replay(path), until_lost)
    assert again[0] == live[0]
    assert "the link was cut at 3 s" in again[1]
    assert "the link was cut at 3 s" in live[1]


def test_the_first_difference_is_named(path: Path) -> None:
    async def drive(robot: Epuck) -> None:
        await robot.proximity()
        await robot.set_speed(0.1, 0.1)

    async def drive_otherwise(robot: Epuck) -> None:
        await robot.proximity()
        await robot.set_speed(0.1, 0.2)

    recorded(path, drive)
    with pytest.raises(
        ReplayDiffers, match=r"it sent 'D,100,200' where 'D,100,100' was sent for set_speed\(0.1, 0.1\)"
    ):
        run_on(replay(path), drive_otherwise)


def test_a_reconnecting_program_that_differs_is_told_at_once(path: Path) -> None:
    recorded(path, lambda robot: robot.proximity())

    async def other() -> float:
        async with elib.reconnecting(replay(path)) as robot:
            with pytest.raises(ReplayDiffers, match="it sent 'A' where 'N'"):
                await robot.accelerometer()
            return robot.time

    with asyncio.Runner(loop_factory=lambda: new_loop("max")) as runner:
        assert runner.run(other()) < 2


def test_a_program_that_goes_on_for_longer_is_told_that_the_recording_is_over(path: Path) -> None:
    async def short(robot: Epuck) -> None:
        with robot.record(path):
            await robot.proximity()

    run_on(SIM, short)

    async def longer(robot: Epuck) -> None:
        await robot.proximity()
        await robot.proximity()

    with pytest.raises(ReplayDiffers, match=r"the recording is over at 0\.\d+ s, and the program sent 'N'"):
        run_on(replay(path), longer)


def test_leaving_a_replay_early_is_not_an_error(path: Path) -> None:
    recorded(path, wander)
    run_on(replay(path), lambda robot: robot.proximity())


@pytest.mark.parametrize("calls", [1, 2])
def test_a_recording_that_begins_late_says_so(path: Path, calls: int) -> None:
    async def late(robot: Epuck) -> None:
        for _ in range(calls):
            await robot.set_speed(0.1, 0.1)
        with robot.record(path):
            if calls == 1:
                await robot.proximity()

    run_on(SIM, late)
    with pytest.raises(ReplayDiffers) as caught:
        run_on(replay(path), lambda robot: robot.set_speed(0.1, 0.1))
    assert f"begun after {calls} calls" in caught.value.hint


def test_a_recording_whose_first_parts_are_gone_says_so(path: Path) -> None:
    async def long(robot: Epuck) -> None:
        robot.record(path, part_seconds=1, keep=2)
        await wander(robot)
        await wander(robot)

    run_on(SIM, long)
    with pytest.raises(ReplayDiffers) as caught:
        run_on(replay(path), wander)
    assert "the first parts of this recording are missing" in caught.value.hint
    with pytest.raises(ArgumentError, match=r"has \d\.\d+ s to \d+\.\d+ s of its run; 0.5 s is not in it"):
        state_at(read_recording(path), 0.5)


def test_calls_at_the_same_time_are_told_apart(path: Path) -> None:
    def both(speed: float) -> Callable[[Epuck], Awaitable[object]]:
        async def program(robot: Epuck) -> None:
            await asyncio.gather(robot.set_speed(speed, 0.1), robot.proximity())

        return program

    recorded(path, both(0.1))
    with pytest.raises(ReplayDiffers, match=r"'D,200,100' where 'D,100,100' was sent for set_speed\(0\.1, 0\.1\)"):
        run_on(replay(path), both(0.2))


def test_the_time_of_a_difference_is_that_of_the_player(path: Path) -> None:
    async def after_a_while(robot: Epuck) -> None:
        await asyncio.sleep(2)
        await robot.proximity()

    async def otherwise(robot: Epuck) -> None:
        await asyncio.sleep(2)
        await robot.encoders()

    recorded(path, after_a_while)
    with pytest.raises(ReplayDiffers, match=r"differs from its recording at 2\.000 s"):
        run_on(replay(path), otherwise)


def test_after_a_difference_the_recording_can_be_opened_again(path: Path) -> None:
    live = recorded(path, wander)

    async def several() -> None:
        for _ in range(2):
            async with elib.open(replay(path)) as robot:
                with pytest.raises(ReplayDiffers):
                    await robot.encoders()
            async with elib.open(replay(path)) as robot:
                assert len(await wander(robot)) == len(live)

    with asyncio.Runner(loop_factory=lambda: new_loop("max")) as runner:
        runner.run(several())


def test_the_blocking_style_replays_too(path: Path) -> None:
    def program(robot: elib.BlockingEpuck) -> list[object]:
        robot.set_speed(0.2, 0.2)
        robot.sleep(1)
        return [tuple(robot.encoders()), tuple(robot.begin.proximity().end())]

    with elib.connect(SIM) as robot:
        robot.record(path)
        live = program(robot)
    with elib.connect(replay(path)) as robot:
        assert program(robot) == live


def test_a_run_in_real_time_replays_in_simulated_time(path: Path) -> None:
    async def look(robot: Epuck) -> list[tuple[int, ...]]:
        seen = []
        for _ in range(20):
            seen.append(tuple(await robot.within(20).proximity()))
            await asyncio.sleep(0.05)
        return seen

    live = recorded(path, look, "sim://arena?speed=4")
    assert run_on(replay(path), look) == live


def test_one_loop_replays_a_recording_once_at_a_time(path: Path) -> None:
    recorded(path, wander)

    async def twice(robot: Epuck) -> None:
        with pytest.raises(LinkBusy, match="open already"):
            await open_transport(replay(path))

    run_on(replay(path), twice)


def test_a_file_that_is_not_a_recording_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.mcap"
    with pytest.raises(ArgumentError, match="cannot be read"):
        run_on(replay(path), wander)
    path.write_text("hello")
    with pytest.raises(ArgumentError, match="not an MCAP file"):
        run_on(replay(path), wander)
    with pytest.raises(ArgumentError, match="fork is 'soon'"):
        run_on(replay(path, "fork=soon"), wander)


def test_what_does_not_fit_a_recording_is_refused(path: Path) -> None:
    recorded(path, wander)
    with pytest.raises(ArgumentError, match="world goes with fork"):
        run_on(replay(path, "world=square"), wander)
    for seconds in (-1.0, 1000.0):
        with pytest.raises(ArgumentError, match=r"run\.mcap is \d+\.\d+ s long"):
            run_on(replay(path, f"fork={seconds}"), wander)

    async def elsewhere() -> None:
        with pytest.raises(SimulationError, match="speed=max needs an event loop made for it"):
            await open_transport(replay(path))

    asyncio.run(elsewhere())


# -- going on from a moment --


async def tour(robot: Epuck) -> None:
    """Drive in bends with lamps on, and read now and then."""
    await robot.set_camera(40, 30, 4, elib.CameraMode.GREY)
    await robot.set_led(2, elib.LedAction.ON)
    await robot.set_body_led(elib.LedAction.ON)
    for left, right in [(0.5, 0.3), (0.2, -0.2), (0.4, 0.4), (-0.3, -0.1), (0.3, 0.5)]:
        await robot.set_speed(left, right)
        for _ in range(10):
            await robot.encoders()
            await asyncio.sleep(0.2)


def test_a_fork_goes_on_smoothly_from_every_tenth_of_a_run(path: Path) -> None:
    truth: dict[float, tuple[float, float, float]] = {}
    speeds: dict[float, tuple[float, float]] = {}

    async def watched(robot: Epuck) -> None:
        robot.record(path)
        world, began = world_of(robot), robot.time

        async def look() -> None:
            for tick in range(1, 11):
                await asyncio.sleep(began + tick * 1.03 - robot.time)
                transport = transport_of(robot)
                transport.simulation.catch_up()
                pose, motors = world.pose(0), transport.robot.emulator.firmware.motors
                truth[tick] = pose.x, pose.y, pose.heading
                speeds[tick] = motors[0].speed, motors[1].speed

        looking = asyncio.create_task(look())
        await tour(robot)
        await looking

    run_on(SIM, watched)

    async def seam(tick: int) -> None:
        transport = await open_transport(replay(path, f"fork={tick * 1.03}"))
        assert isinstance(transport, SimTransport)
        world = transport.simulation.world
        assert world is not None
        pose, motors = world.pose(0), transport.robot.emulator.firmware.motors
        x, y, heading = truth[tick]
        assert math.dist((pose.x, pose.y), (x, y)) < 0.001, tick
        assert math.remainder(pose.heading - heading, math.tau) == pytest.approx(0, abs=0.02)
        assert (motors[0].speed, motors[1].speed) == speeds[tick]
        lights = transport.robot.emulator.firmware.lights
        assert (lights.ring[2], lights.body) == (1, 1)
        await asyncio.sleep(0.1)
        transport.simulation.catch_up()
        moved = math.dist((world.pose(0).x, world.pose(0).y), (pose.x, pose.y))
        expected = abs(sum(speeds[tick])) / 2 * 0.1288e-3 * 0.1
        assert moved == pytest.approx(expected, abs=0.0015)
        await transport.close()

    with asyncio.Runner(loop_factory=lambda: new_loop("max")) as runner:
        for tick in range(1, 11):
            runner.run(seam(tick))


def test_a_fork_has_the_recorded_step_counters_and_camera(path: Path) -> None:
    recorded(path, tour)
    expected = state_at(read_recording(path), 9.0).steps

    async def read(robot: Epuck) -> tuple[elib.Steps, elib.CameraSettings]:
        return await robot.encoders(), await robot.camera()

    counted = [
        entry
        for entry in read_recording(path).entries("/readings/encoders")
        if entry.time - read_recording(path).began < 9.0
    ]
    near = counted[-1].data
    for state, then in zip(expected, (near["left"], near["right"]), strict=True):
        assert abs(state - then) <= 0.2 * 520  # the last reading was 0.2 s before at most
    steps, camera = run_on(replay(path, "fork=9"), read)
    for now, then, speed in zip(steps, expected, (300, 500), strict=True):
        assert now == pytest.approx(then + 0.206 * speed, abs=6)  # opening a link takes 0.2 s
    assert (camera.width, camera.height, camera.zoom) == (40, 30, 4)


def test_a_fork_has_what_was_pushed_where_it_lay(tmp_path: Path) -> None:
    path, scene = tmp_path / "run.mcap", tmp_path / "push.toml"
    scene.write_text(
        "[arena]\nsize = [1.0, 1.0]\n[[robot]]\nposition = [0.2, 0.5]\nheading = 0\n"
        "[[cylinder]]\nposition = [0.3, 0.5]\nradius = 0.02\npushable = true\nmass = 0.02\n"
    )

    async def push(robot: Epuck) -> tuple[float, float]:
        await robot.set_speed(0.5, 0.5)
        for _ in range(20):
            await robot.proximity()
            await asyncio.sleep(0.2)
        await robot.stop()
        await robot.proximity()
        post = world_of(robot).snapshot().cylinders[0]
        return post.x, post.y

    x, y = recorded(path, push, f"sim://{scene}?speed=max")
    assert x > 0.4
    scene.unlink()  # the recording holds the world
    length = read_recording(path).path(measured=True)[-1].time - read_recording(path).began

    async def find_it(robot: Epuck) -> tuple[float, float]:
        post = world_of(robot).snapshot().cylinders[0]
        return post.x, post.y

    assert run_on(replay(path, f"fork={length - 0.001}"), find_it) == pytest.approx((x, y), abs=0.02)


def test_step_counters_that_were_seldom_read_go_on_at_the_firmwares_own_rate(path: Path) -> None:
    async def spin(robot: Epuck) -> elib.Steps:
        await robot.set_speed(0.6, -0.6)
        for _ in range(20):
            await robot.proximity()
            await asyncio.sleep(0.5)
        return await robot.encoders()

    left, right = recorded(path, spin)
    length = [entry.time for entry in read_recording(path).entries("/readings/encoders")][-1] - read_recording(
        path
    ).began
    steps = state_at(read_recording(path), length - 0.002).steps
    assert steps == pytest.approx((left, right), abs=3)

    async def read(robot: Epuck) -> elib.Steps:
        return await robot.encoders()

    forked = run_on(replay(path, f"fork={length - 0.206}"), read)
    assert tuple(forked) == pytest.approx((left, right), abs=8)


def test_a_command_counts_from_when_the_robot_got_it(path: Path) -> None:
    async def turn_back(robot: Epuck) -> None:
        await robot.set_speed(0.5, 0.5)
        await asyncio.sleep(2)
        await robot.set_speed(-0.5, -0.5)
        await robot.encoders()

    recorded(path, turn_back, f"{SIM}&latency=0.15")
    told = [entry.time - read_recording(path).began for entry in read_recording(path).entries("/outcomes")][1]
    assert state_at(read_recording(path), told - 0.2).speed == (500, 500)
    assert state_at(read_recording(path), told - 0.1).speed == (-500, -500)


def test_a_robot_that_restarts_stands_from_then_on(path: Path) -> None:
    async def restart(robot: Epuck) -> None:
        await robot.set_speed(0.3, -0.2)
        await asyncio.sleep(1)
        await robot.reset()
        await robot.proximity()

    recorded(path, restart)
    done = next(entry for entry in read_recording(path).entries("/outcomes") if entry.data["command"] == "reset")
    during = state_at(read_recording(path), done.time - read_recording(path).began - done.data["round_trip"] / 2)
    assert during.speed == (0, 0)


def test_of_speeds_that_were_replaced_before_they_were_sent_the_newest_counts(path: Path) -> None:
    async def hurry(robot: Epuck) -> None:
        await asyncio.gather(robot.proximity(), robot.set_speed(0.9, 0.9), robot.set_speed(0.1, 0.1))
        await asyncio.sleep(1)
        await robot.proximity()

    recorded(path, hurry)
    assert state_at(read_recording(path), 0.5).speed == (100, 100)


@pytest.mark.parametrize("what", ["where the robot began", "beside it", "a wall", "a box less"])
@pytest.mark.parametrize("is_recorded", [False, True])
def test_a_fork_has_the_boxes_and_walls_that_a_hand_has_put_in(path: Path, what: str, *, is_recorded: bool) -> None:
    async def change(robot: elib.Epuck) -> tuple[int, int]:
        control = Control(simulation_of(robot))
        x, y = control.snapshot().robots[0].pose.x, control.snapshot().robots[0].pose.y
        if is_recorded:
            robot.record(path)
            await robot.sleep(0.2)
            await robot.proximity()
        if what == "where the robot began":
            control.move_robot(0, x + 0.2, y)
            control.add_box(x, y)
        elif what == "beside it":
            control.add_box(x + 0.3, y)
        elif what == "a wall":
            control.add_wall(x + 0.2, y, x + 0.2, y + 0.1)
        else:
            control.remove_box(0)
        if not is_recorded:
            robot.record(path)
        await robot.sleep(0.5)
        await robot.proximity()
        await robot.sleep(0.3)
        await robot.proximity()
        now = control.snapshot()
        return len(now.boxes), len(now.walls)

    async def look(robot: elib.Epuck) -> tuple[int, int]:
        now = Control(simulation_of(robot)).snapshot()
        return len(now.boxes), len(now.walls)

    there = run_on("sim://arena?speed=max", change)
    assert run_on(replay(path, "fork=0.8"), look) == there


def test_a_fork_without_measured_poses_goes_on_by_the_step_counters(tmp_path: Path) -> None:
    first, path = tmp_path / "first.mcap", tmp_path / "run.mcap"
    recorded(first, tour)
    recorded(path, tour, replay(first))  # a recording of a replay knows of no world
    state = state_at(read_recording(path), 5.0)
    assert not state.is_measured
    truth = state_at(read_recording(first), 5.0).pose

    async def place(robot: Epuck) -> tuple[float, float, float]:
        pose = world_of(robot).pose(0)
        return pose.x, pose.y, pose.heading

    # The same start, and the robot drives on for the fifth of a second that opening takes.
    x, y, heading = run_on(replay(path, "fork=5.0", "world=arena"), place)
    assert math.dist((x, y), (truth.x, truth.y)) < 0.03
    assert abs(math.remainder(heading - truth.heading, math.tau)) < 0.4
    start = World.load("arena").poses[0]
    assert math.dist((x, y), (start.x, start.y)) > 0.05


def test_a_place_outside_the_world_is_moved_inside_and_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    first, path = tmp_path / "first.mcap", tmp_path / "run.mcap"

    async def far(robot: Epuck) -> None:
        await robot.set_speed(1, 1)
        for _ in range(40):
            await robot.encoders()
            await asyncio.sleep(0.5)

    recorded(first, far)
    recorded(path, far, replay(first))

    async def place(robot: Epuck) -> tuple[float, float]:
        pose = world_of(robot).pose(0)
        return pose.x, pose.y

    x, y = run_on(replay(path, "fork=19"), place)
    assert 0 < x < 1
    assert 0 < y < 1
    assert "is not free in this world" in caplog.text


def test_a_fork_keeps_the_robots_profile_and_its_link(tmp_path: Path) -> None:
    path, profile = tmp_path / "run.mcap", tmp_path / "odd.toml"
    profile.write_text("[wheels]\nleft_radius = 0.0240\nright_radius = 0.0190\n")
    url = f"{SIM}&profile={profile}&latency=0.05"
    recorded(path, tour, url)
    profile.unlink()

    async def look(robot: Epuck) -> tuple[float, float]:
        before = robot.time
        await robot.proximity()
        trip = robot.time - before
        await robot.set_speed(0.4, 0.4)
        world = world_of(robot)
        began = world.pose(0).heading
        await robot.sleep(1)
        await robot.proximity()
        return trip, math.remainder(world.pose(0).heading - began, math.tau)

    trip, turned = run_on(replay(path, "fork=0.5"), look)
    assert trip > 0.1
    assert turned < -0.2  # its left wheel is the larger one


def test_without_mcap_a_replay_says_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib.util

    real = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *more: None if name == "mcap" else real(name, *more))
    with pytest.raises(Unsupported, match="mcap") as caught:
        run_on(replay(tmp_path / "run.mcap"), wander)
    assert install("record") in caught.value.hint
