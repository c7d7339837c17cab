"""A robot on Wi-Fi is used as any other: in every style, watched, lost and found again, and stopped."""

import asyncio
import contextlib
import signal
import subprocess
import sys
from collections.abc import AsyncIterator
from dataclasses import dataclass
from itertools import pairwise

import pytest
from served import is_suspended, served

import elib
from elib.base.errors import ArgumentError, LinkLost, NotAnEpuck, ReplyTimeout, RobotSilent, Unsupported
from elib.link.protocol.profiles import EPUCK2_WIFI
from elib.link.transport.base import Transport
from elib.link.transport.memory import MemoryTransport
from elib.robot import link as robot_link
from elib.robot.link import stop_bytes
from elib.robot.snapshot import SENSORS
from elib.simulator.emulator.control import Control
from elib.testing import simulated, simulation_of
from lanes import short
from shared import inside, until
from wifi_robot import Air, Fault, WifiRobot, wifi_pair

SIM = "sim://arena?firmware=epuck2-wifi&speed=max&quality=ideal"


# -- the styles --------------------------------------------------------------------------------------------------------


def test_the_blocking_style() -> None:
    with elib.connect(SIM) as robot:
        assert robot.firmware == "epuck2-wifi"
        robot.set_speed(0.5, 0.5)
        robot.sleep(1)
        assert 450 < robot.encoders().left < 550
        assert robot.selector().position == 15
        assert robot.image().pixels.shape == (120, 160, 3)
        robot.stop()
        before = robot.encoders()
        robot.drive(0.05)
        assert robot.encoders().left - before.left == pytest.approx(0.05 / 0.0001288, abs=30)
        assert robot.statistics.lost == robot.statistics.resyncs == 0


@pytest.mark.parametrize("latency", short([0, 0.1, 0.2], 0, 0.2))
@simulated
async def test_odometry_follows_what_is_watched(latency: float) -> None:
    async with elib.open(f"{SIM}&latency={latency}") as robot, robot.watch("encoders", rate=10) as watched:

        async def look() -> None:
            async for _ in watched:
                pass

        looking = asyncio.create_task(look())
        odometry = robot.motion.odometry
        for speed in (0.9, -0.9, 0.9, 0.5):  # packets that come before a command is taken are not strange
            await robot.set_speed(speed, speed)
            await asyncio.sleep(0.5)
        before = await robot.encoders()
        counted = odometry.left
        assert counted == before.left
        await robot.set_encoders(5000, -3000)  # the next packet may have the old counters
        await asyncio.sleep(1.0)
        after = await robot.encoders()
        assert (odometry.left - counted, odometry.right - counted) == pytest.approx(
            (after.left - 5000, after.right + 3000), abs=300
        )
        await robot.stop()
        await robot.encoders()
        begin = odometry.left
        await robot.drive(0.05)
        assert odometry.left - begin == pytest.approx(0.05 / 0.0001288, abs=160)
        assert odometry.restarts == 0
        looking.cancel()


def test_the_styles_of_begin_and_end_and_of_callbacks() -> None:
    found: list[object] = []
    with elib.connect(SIM) as robot:
        pending = [robot.begin.proximity(), robot.begin.set_body_led(1), robot.begin.distance()]
        near, done, far = [each.end() for each in pending]
        assert isinstance(near, elib.Proximity)
        assert done is None
        assert isinstance(far, elib.Distance)
        robot.callback(lambda value, state: found.append((value, state)), None, "mine").battery()
        robot.sleep(0.5)
    ((battery, state),) = found
    assert isinstance(battery, elib.Battery)
    assert state == "mine"


def test_all_sensors_come_in_one_packet() -> None:
    with elib.connect(SIM) as robot:
        before = robot.statistics.count
        readings = robot.sensors()
        assert robot.statistics.count == before + 1
        assert [name for name in SENSORS if getattr(readings, name) is None] == ["speed"]


@pytest.mark.parametrize("name", sorted(EPUCK2_WIFI.absent))
def test_what_wifi_cannot_do_is_unsupported_with_the_reason(name: str) -> None:
    arguments = {"text": ("V",), "i2c_read": (192, 0), "i2c_write": (192, 0, 0)}.get(name, ())
    if name in ("set_proximity_rate", "set_distance_sensor"):
        arguments = (1,)
    with elib.connect(SIM) as robot, pytest.raises(Unsupported, match=r"does not exist on epuck2-wifi: \w"):
        getattr(robot, name)(*arguments)


def test_what_is_not_there_cannot_be_watched() -> None:
    with elib.connect(SIM) as robot, pytest.raises(Unsupported, match="speed cannot be watched"):
        robot.watch("speed")


def test_the_firmware_of_another_kind_of_link_is_refused() -> None:
    with pytest.raises(ArgumentError, match=r"(?s)epuck2 does not talk through .*hint: .* epuck2-wifi") as caught:
        elib.connect(SIM, firmware="epuck2")
    assert "btcom" not in str(caught.value)
    with pytest.raises(ArgumentError, match="epuck2-wifi does not talk through"):
        elib.connect("sim://?speed=max", firmware="epuck2-wifi")


# -- a strict robot in the air -----------------------------------------------------------------------------------------


@dataclass
class Place:
    """A robot, and every link to it."""

    robot: WifiRobot
    airs: list[Air]

    def open(self) -> Transport:
        near, far = wifi_pair()
        self.airs.append(Air(self.robot, far, 0.005))
        return near


@contextlib.asynccontextmanager
async def place(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Place]:
    """A robot that ``wifi://robot`` opens."""
    there = Place(WifiRobot(), [])

    async def open_transport(url: str) -> Transport:
        return there.open()

    monkeypatch.setattr(robot_link, "open_transport", open_transport)
    try:
        yield there
    finally:
        for air in there.airs:
            air.cut()
        await there.robot.close()


@simulated
async def test_what_acts_once_acts_in_one_cycle_only(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot:
        await robot.set_speed(0.2, 0.2)
        await robot.calibrate_proximity()
        await robot.set_encoders(100, 200)
        await robot.play_sound(3)
        await robot.play_sound(0)
        await asyncio.sleep(1)
        cycles = there.robot.cycles
        assert sum(cycle.settings & 1 for cycle in cycles) == 1
        assert [(c.left, c.right) for c in cycles if c.settings & 4] == [(100, 200)]
        assert [cycle.sound for cycle in cycles if cycle.sound] == [4, 0x20]
        assert there.robot.speed == (200, 200)
        assert await robot.encoders() == elib.Steps(100, 200)
        assert there.robot.wrong == []
        assert there.robot.discarded == 0


@simulated
async def test_nothing_but_commands_is_sent_even_when_the_robot_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there:
        async with elib.open("wifi://robot") as robot:
            await robot.set_speed(0.5, 0.5)
            there.robot.is_silent = True
            with pytest.raises(ReplyTimeout):
                await robot.within(0.1).proximity()
            with pytest.raises(ReplyTimeout):
                await robot.within(1).stop()
            there.robot.is_silent = False
        await asyncio.sleep(1)
        assert there.robot.wrong == []
        assert there.robot.speed == (0, 0)


@simulated
async def test_closing_stops_the_robot_and_keep_moving_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there:
        async with elib.open("wifi://robot") as robot:
            await robot.set_speed(0.5, 0.5)
        assert there.robot.speed == (0, 0)
        async with elib.open("wifi://robot", keep_moving=True) as robot:
            await robot.set_speed(0.3, 0.4)
        assert there.robot.speed == (300, 400)
        async with elib.open("wifi://robot"):
            assert there.robot.speed == (0, 0), "the first command of a connection stops the robot"


@simulated
async def test_a_stop_overtakes_a_reading_that_is_late(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot:
        await robot.set_speed(0.5, 0.5)
        there.airs[0].down_faults.append(Fault(delay=0.7))
        reading = asyncio.ensure_future(robot.within(3).distance())
        await asyncio.sleep(0.01)
        stopping = asyncio.ensure_future(robot.within(3).stop())
        await asyncio.sleep(0.3)
        assert there.robot.speed == (0, 0), "the stop went past the reading"
        assert not reading.done()
        await stopping
        await reading
        assert there.robot.discarded == 0


def test_an_emergency_stop_is_one_command_that_leaves_body_front_and_stream() -> None:
    async def main(robot: elib.Epuck) -> None:
        await robot.set_body_led(1)
        await robot.set_speed(0.5, 0.5)
        data = stop_bytes(robot.session)
        assert data.hex() == "8002" + "000000000010" + "00" * 13

    elib.run(main, robot=SIM)


@simulated
async def test_after_an_emergency_stop_a_lamp_does_not_drive_the_robot_on(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot:
        await robot.set_speed(0.5, 0.5)
        assert robot.session.send_unqueued(stop_bytes(robot.session))
        await robot.set_body_led(1)
        assert there.robot.speed == (0, 0)


@pytest.mark.parametrize(
    ("answer", "error", "words"),
    [
        (b"", RobotSilent, "selector to 15"),
        (b"\x02" + bytes(104), NotAnEpuck, "did not take a command"),
        (b"\x03" * 50, NotAnEpuck, "did not take a command"),
        (b"HTTP/1.1 400 Bad Request\r\n", NotAnEpuck, "unknown kind 0x48"),
        (b"v,Version 1.2.2\r\n", NotAnEpuck, "not as an e-puck2 on Wi-Fi does"),
    ],
)
@simulated
async def test_what_is_not_an_epuck2_on_wifi_is_named(
    monkeypatch: pytest.MonkeyPatch, answer: bytes, error: type[elib.ElibError], words: str
) -> None:
    far: list[MemoryTransport] = []

    async def open_transport(url: str) -> Transport:
        near, other = wifi_pair()
        far.append(other)
        other.send_nowait(answer) if answer else None
        return near

    monkeypatch.setattr(robot_link, "open_transport", open_transport)
    with pytest.raises(error, match=words):
        async with elib.open("wifi://robot"):
            pass


@simulated
async def test_a_second_client_waits_until_the_first_one_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch):
        async with elib.open("wifi://robot"):
            with pytest.raises(RobotSilent, match="it serves one at a time"):
                async with elib.open("wifi://robot"):
                    pass
        async with elib.open("wifi://robot") as robot:
            await robot.proximity()


# -- watching ----------------------------------------------------------------------------------------------------------


@simulated
async def test_every_sensor_packet_and_every_picture_is_delivered_with_its_age_and_nothing_is_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot:
        calls = robot.statistics.count
        sent = there.robot.sent_packets
        numbers = []
        async with robot.watch("ambient_light", rate=1000) as snapshots:
            async for snapshot in snapshots:
                assert snapshot.age("ambient_light") == 0
                numbers.append(snapshot.ambient_light[0])
                if len(numbers) == 50:
                    break
        assert all(later == before + 1 for before, later in pairwise(numbers)), "every packet, in order"
        assert there.robot.sent_packets - sent <= 52
        pictures = []
        async with robot.watch("image") as snapshots:
            async for snapshot in snapshots:
                assert snapshot.age("image") == 0
                pictures.append(int.from_bytes(snapshot.image.raw[:2], "big"))
                if len(pictures) == 10:
                    break
        taken = [number for _, number in there.robot.readings["image"]]
        assert pictures == taken[: len(pictures)], "every picture"
        await asyncio.sleep(0.3)
        before = there.robot.picture_cycles
        await asyncio.sleep(1)
        assert there.robot.picture_cycles == before, "nobody watches, so the robot takes no pictures"
        assert robot.statistics.count == calls


@simulated
async def test_sensors_come_at_the_rate_asked_for_if_the_robot_is_faster(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with place(monkeypatch), elib.open("wifi://robot") as robot:
        began, count = robot.time, 0
        async with robot.watch("proximity", rate=5) as snapshots:
            async for snapshot in snapshots:
                count += 1
                if snapshot.time - began > 2:
                    break
        assert 10 <= count <= 12


@simulated
async def test_calls_and_single_pictures_work_while_pictures_are_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot:
        seen = 0
        async with robot.watch("image", "distance", rate=20) as snapshots:
            async for _ in snapshots:
                seen += 1
                await robot.set_speed(seen / 100, 0)
                assert there.robot.speed == (10 * seen, 0)
                await robot.image()
                if seen == 10:
                    break
        assert there.robot.discarded == 0


@simulated
async def test_a_stream_that_stops_is_told_with_the_readings_that_there_were(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot, robot.watch("distance") as snapshots:
        first = await snapshots.take()
        assert first is not None
        there.robot.is_silent = True
        while (snapshot := await snapshots.take()) is not None and snapshot.error is None:
            pass
        assert snapshot is not None
        assert isinstance(snapshot.error, ReplyTimeout)
        assert snapshot.is_stale("distance")
        there.robot.is_silent = False
        while (snapshot := await snapshots.take()) is not None and snapshot.error is not None:
            pass
        assert snapshot is not None
        assert snapshot.age("distance") == 0


@simulated
async def test_a_robot_that_is_switched_off_ends_the_watch_though_its_connection_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot:
        began = robot.time
        with pytest.raises(LinkLost, match="sent nothing for"):
            async for _ in robot.watch("image"):
                there.robot.is_silent = True
        assert robot.time - began < 5 * EPUCK2_WIFI.patience


@simulated
async def test_a_late_packet_is_not_taken_for_a_late_answer_and_the_stream_is_not_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot:
        events = robot.events
        there.robot.is_frozen = True
        with pytest.raises(ReplyTimeout):
            await robot.within(0.1).selector()
        await asyncio.sleep(5)
        assert not events._late_answers._heard
        there.robot.is_frozen = False
        await robot.selector()
        assert events.recent == ()


@simulated
async def test_a_lost_link_ends_the_watch_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot:
        with pytest.raises(LinkLost):
            async for _ in robot.watch("distance"):
                there.airs[0].cut()


# -- coming back -------------------------------------------------------------------------------------------------------


@simulated
async def test_a_robot_that_comes_back_has_its_lamps_and_is_watched_on(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there, elib.reconnecting("wifi://robot", first_delay=0.1) as robot:
        await robot.set_led(8, 1)
        await robot.set_rgb_led(3, 0.5, 0, 0)
        await robot.set_body_led(1)
        await robot.set_speed(0.4, 0.4)
        async with robot.watch("image", "distance") as snapshots:
            assert await snapshots.take() is not None
            there.airs[0].cut()
            await robot.within(5).proximity()
            assert len(there.airs) == 2
            command = there.robot.adopted[-1]
            assert command[3:7] == bytes(4), "the wheels stand"
            assert command[7] == 0x1F
            assert list(command[8:20]) == [0, 0, 0, 50, 0, 0, 10, 0, 0, 10, 0, 0]
            back = robot.time
            while (snapshot := await snapshots.take()) is not None and snapshot.image.time < back:
                pass
            assert snapshot is not None, "pictures are streamed again"


@simulated
async def test_bytes_out_of_step_open_a_new_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    async with place(monkeypatch) as there, elib.reconnecting("wifi://robot", first_delay=0.1) as robot:
        await robot.proximity()
        there.airs[0].far.send_nowait(b"\x00")
        assert (await robot.within(5).selector()).position == 15
        assert len(there.airs) == 2
    async with place(monkeypatch) as there, elib.open("wifi://robot") as robot:
        there.airs[0].far.send_nowait(b"\x00")
        with pytest.raises(LinkLost, match=r"(?s)out of step.*elib\.reconnecting\(\) does that"):
            await robot.within(5).selector()


@inside(elib.open, "sim://arena?firmware=epuck2-wifi&quality=ideal&speed=max")
async def test_pictures_do_not_keep_the_sensors_of_the_same_watch_from_their_turn(robot: elib.Epuck) -> None:
    times: dict[str, set[float]] = {"proximity": set(), "image": set()}
    async with robot.watch("proximity", "image", rate=5) as snapshots:
        began = asyncio.get_running_loop().time()
        async for snapshot in snapshots:
            for name, reading in snapshot.readings.items():
                times[name].add(reading.time)
            if asyncio.get_running_loop().time() - began > 4:
                break
    assert len(times["image"]) > 24
    assert 18 <= len(times["proximity"]) <= 22


# -- over TCP ----------------------------------------------------------------------------------------------------------


async def test_a_program_that_was_frozen_does_not_drive_on_with_its_next_lamp() -> None:
    async with served("wifi", firmware="epuck2-wifi") as there:
        outside = asyncio.get_running_loop()

        async def until_stopped() -> None:
            await until(lambda: there.way)  # the empty packet leaves before the main processor has the speeds
            await there.until_it_stands()

        async def drive(robot: elib.Epuck) -> None:
            await robot.set_speed(0.4, 0.4)
            asyncio.run_coroutine_threadsafe(until_stopped(), outside).result()  # blocks this loop
            await robot.set_body_led(1)
            await robot.proximity()
            assert not there.is_turning
            await robot.set_speed(0.3, 0.3)
            await until(lambda: there.is_turning)

        await asyncio.to_thread(elib.run, drive, robot=there.url, watchdog=True)


BUSY = """
import asyncio, sys, threading, elib

async def main():
    async with elib.open(sys.argv[1], watchdog="watchdog" in sys.argv) as robot:
        await robot.set_speed(0.4, 0.4)

        async def look():
            async for snapshot in robot.watch("image"):
                seen.set()

        seen = asyncio.Event()
        looking = asyncio.create_task(look()) if "pictures" in sys.argv else seen.set()
        await seen.wait()
        print("driving", flush=True)
        if "blocks" in sys.argv:
            threading.Event().wait()
        await asyncio.Event().wait()

asyncio.run(main())
"""


ENDINGS = [
    ("pictures blocks", signal.SIGINT),
    ("pictures watchdog", signal.SIGSTOP),
    ("blocks", signal.SIGINT),
    ("blocks", signal.SIGTERM),
    ("pictures", signal.SIGINT),
    ("pictures", signal.SIGQUIT),
    ("pictures", signal.SIGTSTP),
    ("pictures blocks", signal.SIGTSTP),
    ("pictures blocks", signal.SIGQUIT),
    ("pictures watchdog", signal.SIGKILL),
    ("watchdog", signal.SIGSTOP),
    ("watchdog", signal.SIGKILL),
    ("pictures blocks watchdog", 0),
]
"""What a program does when it is ended, and how; the first two are the quick form."""


@pytest.mark.skipif(sys.platform != "linux", reason="signals as Linux has them")
@pytest.mark.parametrize(
    ("words", "number"),
    short(ENDINGS, *ENDINGS[:2]),
)
async def test_a_program_on_wifi_that_is_ended_suspended_or_frozen_leaves_a_robot_that_stands(
    words: str, number: int
) -> None:
    async with served("wifi", firmware="epuck2-wifi") as there:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-c", BUSY, there.url, *words.split()),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            process_group=0,  # Ctrl-Z does not suspend one that nobody may continue
        )
        assert process.stdout is not None
        try:
            assert await process.stdout.readline() == b"driving\n"
            await until(lambda: there.way)
            if "pictures blocks" in words and "watchdog" not in words:  # a watchdog may have read by the next look
                await until(lambda: there.link._is_blocked)  # what it does not read has filled the connection
            if number:
                process.send_signal(number)
            if number in (signal.SIGTSTP, signal.SIGSTOP):
                await until(lambda: is_suspended(process.pid))
            elif number:
                await process.wait()
            await there.until_it_stands()
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.communicate()
        async with elib.open(there.url) as robot:
            assert (await robot.selector()).position == 15


def test_a_watch_waits_with_a_paused_world() -> None:
    async def story(robot: elib.Epuck) -> None:
        async with robot.watch("proximity") as snapshots:
            assert await snapshots.take() is not None
            control = Control(simulation_of(robot))
            control.pause()
            with pytest.raises(TimeoutError):
                for _ in range(3):  # what came before the pause may still be taken
                    async with asyncio.timeout(2.5):  # clock: the loop's own timer, behind that of the watch's patience
                        await snapshots.take()
            control.resume()
            snapshot = await snapshots.take()
            assert snapshot is not None
            assert snapshot.error is None

    elib.run(story, robot="sim://arena?firmware=epuck2-wifi&quality=ideal&speed=5")
