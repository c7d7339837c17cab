"""``robot.watch()``: one poller, any number of readers, in simulated time against the emulator."""

import asyncio
import copy
import dataclasses
import itertools
import pickle
from collections import Counter

import pytest

import elib
from elib.base.errors import ArgumentError, ElibError, LinkClosed, LinkError, LinkLost, ReplyTimeout, Unsupported
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.profiles import PROFILES
from elib.link.session import Ended, TraceEvent, Wrote
from elib.robot.polling import polls
from elib.robot.snapshot import WATCHABLE, Readings, Snapshot
from elib.robot.telemetry import FIRST_TIME, Watch
from elib.testing import link_of, simulated
from shared import inside


def url(firmware: str = "asercom-1.2.2", **keys: object) -> str:
    return f"sim://square?speed=max&firmware={firmware}" + "".join(f"&{key}={value}" for key, value in keys.items())


class Wire:
    """What was sent to the robot, and how long its calls took."""

    def __init__(self, robot: elib.Epuck) -> None:
        self.writes: list[tuple[float, bytes]] = []
        self.ended: Counter[str] = Counter()
        self.most_unanswered = 0
        self._robot = robot
        robot.trace(self._note)

    def _note(self, time: float, event: TraceEvent) -> None:
        self.most_unanswered = max(self.most_unanswered, self._robot.session.unanswered)
        if isinstance(event, Wrote):
            self.writes.append((time, event.data))
        elif isinstance(event, Ended):
            self.ended[event.request.name] += 1


async def take(watch: Watch, count: int) -> list[Snapshot]:
    found = []
    async with watch:
        async for snapshot in watch:
            found.append(snapshot)
            if len(found) == count:
                break
    return found


def polling_tasks() -> list[str]:
    return [task.get_name() for task in asyncio.all_tasks() if "telemetry" in task.get_name()]


# -- what a reader gets ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("firmware", sorted(PROFILES))
@simulated
async def test_without_names_a_watcher_gets_every_reading_the_firmware_has(firmware: str) -> None:
    async with elib.open(url(firmware)) as robot:
        await robot.set_speed(0.1, -0.1)
        (snapshot,) = await take(robot.watch(), 1)
        sensors = await robot.sensors()
        there = [name for name in WATCHABLE[:-1] if getattr(sensors, name) is not None and name not in ("proximity",)]
        assert [name for name in snapshot.readings if name != "proximity"] == there
        for name, reading in snapshot.readings.items():
            assert type(reading) is type(getattr(sensors, name)), name
        assert snapshot.speed == (0.1, -0.1)
        assert snapshot.origin == "simulator"


@inside(elib.open, url())
async def test_a_snapshot_gives_its_readings_by_name_with_their_times(robot: elib.Epuck) -> None:
    (snapshot,) = await take(robot.watch("proximity", "battery", "proximity"), 1)
    assert list(snapshot.readings) == ["proximity", "battery"]
    assert snapshot.proximity is snapshot.readings["proximity"]
    assert snapshot.age("proximity") == snapshot.time - snapshot.proximity.time == 0
    assert snapshot.age("battery", robot.time + 2) == pytest.approx(2)
    assert (snapshot.sequence, snapshot.dropped, snapshot.error) == (0, 0, None)
    with pytest.raises(dataclasses.FrozenInstanceError):
        snapshot.time = 0.0  # type: ignore[misc]


@inside(elib.open, url())
async def test_a_reading_that_is_not_watched_says_so(robot: elib.Epuck) -> None:
    (snapshot,) = await take(robot.watch("proximity"), 1)
    with pytest.raises(AttributeError, match=r"ground is not watched; this snapshot has proximity: robot\.watch"):
        _ = snapshot.ground
    with pytest.raises(AttributeError, match="no attribute 'proximty'"):
        _ = snapshot.proximty  # type: ignore[attr-defined]
    with pytest.raises(ArgumentError, match="'ground' is not watched"):
        snapshot.age("ground")


@inside(elib.open, url())
async def test_a_snapshot_can_be_copied_and_sent_to_another_process(robot: elib.Epuck) -> None:
    (snapshot,) = await take(robot.watch("proximity", "image"), 1)
    for other in (copy.copy(snapshot), copy.deepcopy(snapshot), pickle.loads(pickle.dumps(snapshot))):
        assert other.proximity == snapshot.proximity
        assert other.image == snapshot.image
        assert other.time == snapshot.time


def test_the_typed_names_are_those_that_can_be_watched() -> None:
    import ast
    import inspect

    tree = ast.parse(inspect.getsource(Readings))
    typed = [node.target.id for node in ast.walk(tree) if isinstance(node, ast.AnnAssign)]  # type: ignore[union-attr]
    assert sorted(typed) == sorted(WATCHABLE)


@pytest.mark.parametrize(
    ("names", "rate", "error", "message"),
    [
        (("proximty",), 20, ArgumentError, "did you mean 'proximity'"),
        ((7,), 20, ArgumentError, "no reading 7 to watch"),
        (("version",), 20, ArgumentError, "no reading 'version'"),
        (("distance",), 20, Unsupported, "distance cannot be watched: it does not exist on asercom-1.2.2"),
        ((), 0, ArgumentError, "rate is 0 Hz; it must be a number from 0.001 to 1000"),
        ((), 1001, ArgumentError, "rate is 1001"),
        ((), float("nan"), ArgumentError, "rate is nan"),
        ((), True, ArgumentError, "rate is true"),
        ((), "fast", ArgumentError, "rate is 'fast'"),
    ],
)
@inside(elib.open, url())
async def test_a_wrong_watch_is_refused_where_it_is_made(
    robot: elib.Epuck, names: tuple[str, ...], rate: float, error: type[ElibError], message: str
) -> None:
    with pytest.raises(error, match=message):
        robot.watch(*names, rate=rate)
    assert polling_tasks() == []


# -- one poller --------------------------------------------------------------------------------------------------------


@inside(elib.open, url(latency=0.005))
async def test_there_is_one_request_on_the_wire_per_poll_however_many_readers(robot: elib.Epuck) -> None:
    wire = Wire(robot)
    names = ("proximity", "ambient_light", "encoders", "selector", "battery")
    began = robot.time
    readers = [asyncio.create_task(take(robot.watch(name, rate=20), 21)) for name in names * 4]
    await asyncio.gather(*readers)
    assert robot.time - began == pytest.approx(1.0, abs=0.05)
    assert len(wire.writes) == 21
    assert wire.most_unanswered == 1
    assert {data for _, data in wire.writes} == {wire.writes[0][1]}


@inside(elib.open, url())
async def test_every_reader_keeps_its_own_rate_and_polls_are_no_more_than_the_highest(robot: elib.Epuck) -> None:
    wire = Wire(robot)
    counts: dict[float, int] = {}

    async def count(rate: float, delay: float) -> None:
        await robot.sleep(delay)
        seen = 0
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(10), robot.watch("proximity", rate=rate) as snapshots:
                async for snapshot in snapshots:
                    assert snapshot.dropped == 0
                    seen += 1
        counts[rate] = seen

    await asyncio.gather(count(20, 0), count(12, 0.013), count(7, 0.029), count(0.5, 0.031))
    for rate, seen in counts.items():
        assert abs(seen - rate * 10) <= 1, rate
    assert len(wire.writes) <= 20 * 10.05 + 4


@inside(elib.open, url())
async def test_a_poll_asks_only_for_what_its_readers_want_then(robot: elib.Epuck) -> None:
    wire = Wire(robot)
    fast = asyncio.create_task(take(robot.watch("proximity", rate=20), 41))
    await take(robot.watch("encoders", rate=1), 3)
    await fast
    assert wire.ended["proximity"] >= 37
    assert wire.ended["sensors"] <= 4  # both at once


@inside(elib.open, url())
async def test_a_new_reader_does_not_wait_for_the_tick_of_a_slow_one(robot: elib.Epuck) -> None:
    async with robot.watch("battery", rate=0.01) as slow:
        await anext(slow)
        began = robot.time
        await take(robot.watch("selector", rate=0.01), 1)
        assert robot.time - began < 0.05


@inside(elib.open, url())
async def test_a_slow_reader_misses_snapshots_and_delays_nobody(robot: elib.Epuck) -> None:
    wire = Wire(robot)
    async with robot.watch("proximity", rate=20) as slow, robot.watch("proximity", rate=20) as fast:
        await anext(slow)
        times = [(await anext(fast)).time for _ in range(40)]
        gaps = [b - a for a, b in itertools.pairwise(times)]
        assert gaps == pytest.approx([0.05] * 39, abs=0.001)  # an answer has more digits or fewer
        newest = await anext(slow)
        assert newest.time == times[-1]
        assert newest.dropped == 38
        assert newest.sequence == 39
        assert (await anext(slow)).dropped == 38
    assert len(wire.writes) <= 42


@inside(elib.open, url(latency=0.08))
async def test_on_a_slow_link_the_rate_falls_and_nothing_queues_up(robot: elib.Epuck) -> None:
    wire = Wire(robot)
    found = await take(robot.watch("proximity", rate=20), 10)
    gaps = {round(b.time - a.time, 3) for a, b in itertools.pairwise(found)}
    assert gaps == {0.2}  # 0.163 s of round trip, then the grid's next tick
    assert wire.most_unanswered == 1
    assert found[-1].dropped == 0


@inside(elib.open, url(latency=0.1))
async def test_a_view_with_a_shorter_timeout_does_not_hurry_the_poller(robot: elib.Epuck) -> None:
    (snapshot,) = await take(robot.within(0.01).watch("proximity"), 1)
    assert snapshot.error is None


# -- the camera --------------------------------------------------------------------------------------------------------


@inside(elib.open, url())
async def test_pictures_come_beside_the_sensors(robot: elib.Epuck) -> None:
    found = await take(robot.watch("proximity", "image", rate=20), 20)
    assert found[0].image.width == 40
    pictures = {snapshot.image.time for snapshot in found}
    assert len(pictures) >= 9
    assert len({snapshot.proximity.time for snapshot in found}) == 20
    assert all(0 <= snapshot.age("image") < 0.4 for snapshot in found)


@inside(elib.open, url(latency=0.01))
async def test_the_motors_do_not_starve_while_pictures_stream(robot: elib.Epuck) -> None:
    waits: list[float] = []
    watching = asyncio.create_task(take(robot.watch("proximity", "image", rate=20), 40))
    for step in range(100):
        began = robot.time
        await robot.set_speed(0.1, step % 10 / 100)
        waits.append(robot.time - began)
        await robot.sleep(0.02)
    assert max(waits) < 0.36  # a picture, its round trip and its own
    assert sorted(waits)[50] < 0.1  # behind a picture the line belongs to the others for a while
    assert len(await watching) == 40


@inside(elib.open, url())
async def test_a_camera_that_is_watched_alone_leaves_the_line_free_between_pictures(robot: elib.Epuck) -> None:
    wire = Wire(robot)
    found = await take(robot.watch("image", rate=1000), 6)
    gaps = [b.time - a.time for a, b in itertools.pairwise(found)]
    assert min(gaps) >= 0.28 + 0.05
    assert max(gaps) < 0.36
    assert [snapshot.sequence for snapshot in found] == list(range(6))
    assert len(wire.writes) == 6


@inside(elib.open, url())
async def test_a_late_picture_is_still_shown(robot: elib.Epuck) -> None:
    async with robot.watch("image", rate=1) as snapshots:
        await anext(snapshots)
        link_of(robot).delay_next_reply(1.95)
        late = await anext(snapshots)
        assert isinstance(late.error, ReplyTimeout)
        assert late.age("image") == 0


# -- what goes wrong ---------------------------------------------------------------------------------------------------


@inside(elib.open, url())
async def test_a_lost_answer_leaves_the_old_reading_which_is_seen_to_be_old(robot: elib.Epuck) -> None:
    async with robot.watch("proximity", "encoders", rate=20) as snapshots:
        before = await anext(snapshots)
        link_of(robot).lose_next_reply()
        lost = await anext(snapshots)
        assert isinstance(lost.error, ReplyTimeout)
        assert lost.proximity is before.proximity
        assert lost.age("proximity") == pytest.approx(1.0, abs=0.06)
        assert lost.is_stale("proximity")
        assert not before.is_stale("proximity")
        after = await anext(snapshots)
        assert after.error is None
        assert after.age("proximity") == 0
        assert (before.sequence, lost.sequence, after.sequence) == (0, 1, 2)


@simulated
async def test_a_loss_of_one_reading_leaves_the_others_alone() -> None:
    names = ("speed", "selector", "microphones")  # three writes on this firmware
    async with elib.open(url("btcom-1.1.3")) as robot, robot.watch(*names, rate=1) as snapshots:
        await anext(snapshots)
        link_of(robot).lose_next_reply()
        found = await anext(snapshots)
        assert found.age("selector") < 0.01
        assert found.age("speed") > 1
        assert "speed()" in str(found.error)


@inside(elib.open, url(loss=0.2, seed=3))
async def test_on_a_lossy_link_snapshots_go_on(robot: elib.Epuck) -> None:
    found = await take(robot.watch("proximity", rate=20), 100)
    lost = [snapshot for snapshot in found if snapshot.error is not None]
    assert 5 < len(lost) < 50
    assert all(snapshot.age("proximity") >= 1 for snapshot in lost)
    assert all(snapshot.age("proximity") == 0 for snapshot in found if snapshot.error is None)


@inside(elib.open, url())
async def test_every_reader_gets_the_end_of_the_link_once_after_what_it_has_not_fetched(robot: elib.Epuck) -> None:
    readers = [robot.watch("proximity", rate=rate) for rate in (20, 10, 5)]
    for reader in readers:
        aiter(reader)
    await robot.sleep(0.5)
    link_of(robot).cut()
    await robot.sleep(0.5)
    for reader in readers:
        assert (await anext(reader)).proximity is not None
        with pytest.raises(LinkError):
            await anext(reader)
        with pytest.raises(StopAsyncIteration):
            await anext(reader)
    assert polling_tasks() == []


@inside(elib.open, url())
async def test_a_robot_that_falls_silent_ends_the_watch_with_that_reason(robot: elib.Epuck) -> None:
    with pytest.raises(LinkLost, match="no longer answers"):
        async for snapshot in robot.watch("proximity"):
            if snapshot.sequence == 3:
                link_of(robot).silence()


@simulated
async def test_closing_the_robot_ends_its_readers_and_its_poller() -> None:
    async with elib.open(url()) as robot:
        watch = robot.watch("proximity", "image", rate=20)
        reading = asyncio.create_task(take(watch, 1000))
        await robot.sleep(1.0)
    assert polling_tasks() == []
    with pytest.raises(LinkClosed):
        await reading
    assert len(asyncio.all_tasks()) == 1


@inside(elib.open, url())
async def test_a_first_reading_that_never_comes_is_not_waited_for_without_a_bound(robot: elib.Epuck) -> None:
    link = link_of(robot)

    def lose_every_proximity(time: float, event: TraceEvent) -> None:
        if isinstance(event, Wrote) and event.data == b"N\r":
            link.lose_next_reply()

    robot.trace(lose_every_proximity)
    began = robot.time
    with pytest.raises(ReplyTimeout, match=r"proximity\(\) did not end"):
        await take(robot.watch("proximity"), 1)
    assert FIRST_TIME <= robot.time - began < FIRST_TIME + 2
    await robot.sleep(0.1)
    assert polling_tasks() == []


@inside(elib.reconnecting, url())
async def test_a_reconnecting_robots_readers_live_through_a_gap(robot: elib.Epuck) -> None:
    async with robot.watch("proximity", rate=10) as snapshots:
        before = await anext(snapshots)
        link_of(robot).cut()
        errors, after = 0, before
        while after.proximity.time == before.proximity.time:
            after = await anext(snapshots)
            errors += after.error is not None
        assert after.error is None
        assert after.time - before.time < 10


# -- the end of a subscription -----------------------------------------------------------------------------------------


@inside(elib.open, url())
async def test_leaving_the_loop_early_ends_the_subscription_and_one_never_read_costs_nothing(robot: elib.Epuck) -> None:
    unread = robot.watch("proximity")
    async for snapshot in robot.watch("proximity", rate=50):
        if snapshot.sequence == 2:
            break
    await robot.sleep(0.1)
    assert polling_tasks() == []
    wire = Wire(robot)
    await robot.sleep(1)
    assert wire.writes == []
    await unread.aclose()
    assert await unread.take() is None
    with pytest.raises(LinkClosed, match="async with"):
        elib.open(url()).watch()


@inside(elib.open, url())
async def test_a_watch_that_is_held_goes_on_and_its_block_ends_it(robot: elib.Epuck) -> None:
    async with robot.watch("proximity", rate=50) as snapshots:
        async for _ in snapshots:
            break
        await robot.sleep(1)
        assert (await anext(snapshots)).dropped > 40
    with pytest.raises(StopAsyncIteration):
        await anext(snapshots)
    await robot.sleep(0.1)
    assert polling_tasks() == []


@inside(elib.open, url())
async def test_a_cancelled_wait_loses_no_snapshot(robot: elib.Epuck) -> None:
    async with robot.watch("proximity", rate=2) as snapshots:
        await anext(snapshots)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.2):
                await anext(snapshots)
        assert (await anext(snapshots)).sequence == 1


# -- the requests ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_one_reading_alone_is_asked_for_by_its_own_row(firmware: str) -> None:
    context = Context(PROFILES[firmware])
    for name in WATCHABLE[:-1]:
        if name not in context.profile.absent:
            (poll,) = polls((name,), context)
            assert poll.request.data == SPECS[name].request(context).data
            assert poll.request.name == name  # a probe after a loss must be another question


def test_several_readings_are_one_request_where_the_ring_has_room_for_it() -> None:
    names = ("encoders", "proximity", "selector")
    sizes = {firmware: len(polls(names, Context(profile))) for firmware, profile in PROFILES.items()}
    assert sizes == {"btcom-1.1.3": 3, "btcom-2.0": 1, "asercom-1.2.2": 1, "epuck2": 1}
    for profile in PROFILES.values():
        everything = [name for name in WATCHABLE[:-1] if name not in profile.absent]
        found = polls(everything, Context(profile))
        assert sorted(name for poll in found for name in poll.names) == sorted(everything)
        assert all(len(poll.request.data) <= max(profile.receive_ring, 7) for poll in found)


# -- blocking ----------------------------------------------------------------------------------------------------------


def test_a_blocking_program_reads_snapshots_in_a_plain_loop() -> None:
    with elib.connect(url()) as robot:
        times = []
        for snapshot in robot.watch("proximity", "image", rate=10):
            times.append(snapshot.time)
            robot.set_speed(0.1, 0.1)
            if len(times) == 5:
                break
        robot.sleep(0.5)
        assert robot.statistics.lost == 0
        count = robot.statistics.count
        robot.sleep(1)
        assert robot.statistics.count == count  # nobody polls any more
        assert times == sorted(times)


def test_a_blocking_watch_is_a_block_too_and_goes_on_inside() -> None:
    with elib.connect(url()) as robot:
        with robot.watch("proximity", rate=20) as snapshots:
            first = next(snapshots)
            robot.sleep(1)
            later = next(snapshots)
            assert first.sequence == 0
            assert later.sequence - 1 == later.dropped == pytest.approx(19, abs=1)
        with pytest.raises(StopIteration):
            next(snapshots)
        snapshots.close()


def test_a_blocking_watch_ends_with_the_links_error_and_only_once() -> None:
    robot = elib.connect(url())
    snapshots = robot.watch("proximity")
    next(snapshots)
    link_of(robot._robot).cut()
    robot.sleep(1)
    with pytest.raises(LinkError):
        next(snapshots)
    assert list(snapshots) == []
    robot.close()
    snapshots.close()
