"""``elib foxglove``: what its clients see, and how they drive."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import json
import random
import signal
import struct
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import page_rig
import pytest
import websockets
from elib_process import started
from foxglove_client import Client, connected_to
from recordings import complaints, read

from elib.base.extras import install
from elib.cli import main
from elib.doors.foxglove.commands import CLIENT_TOPICS, Commands
from elib.doors.foxglove.door import hidden_host, opened
from elib.doors.foxglove.layout import layout_of
from elib.doors.robots import connected
from elib.link.protocol.profiles import FIRMWARES
from elib.panel.behaviours import RunPhase
from elib.panel.panel import Panel
from elib.panel.server.listening import Address, listen
from elib.panel.slot import Slot
from elib.panel.watching import virtual
from elib.records.topics import TOPICS
from elib.robot.runner import run_on
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from elib.testing import simulated
from shared import needs_page, until

CLIENT = Path(__file__).parent / "foxglove_client.py"
STAND = 0.5
"""s after the last word of a client within which its robot must stand."""


@contextlib.asynccontextmanager
async def door(*urls: str, page: Address | None = None) -> AsyncIterator[tuple[Panel, str]]:
    """Serve robots and yield the panel and the address."""
    async with connected(urls or ("sim://square",), page=page) as panel:
        address = listen(port=0)
        url = address.url.replace("http", "ws")
        async with opened(panel, address):
            yield panel, url


def wheels(slot: Slot) -> tuple[float, float]:
    """Return how fast the wheels of a virtual robot turn now."""
    transport = virtual(slot.robot)
    assert transport is not None
    left, right = transport.robot.emulator.firmware.motors
    return left.speed, right.speed


def standing(slot: Slot) -> bool:
    return wheels(slot) == (0, 0)


async def test_live_topics_have_the_names_and_schemas_of_a_recording(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    async with door() as (panel, url), connected_to(url) as client:
        panel.slots["1"].records.recording.start(str(path))
        await until(lambda: "/readings/proximity" in client.topics)
        await client.subscribe(*sorted(client.topics))
        for name in (
            "/readings/proximity",
            "/ranges/infrared",
            "/pose/measured",
            "/tf",
            "/link",
            "/pictures",
            "/world",
        ):
            await client.first(name)
        live = {name: (topic.schema_name, topic.schema) for name, topic in client.topics.items()}
        messages = list(client.messages)
    recorded = {each.topic: (each.schema_name, each.schema) for each in read(path)}
    assert {"/tf", "/ranges/infrared", "/link", "/pictures", "/bytes"} <= recorded.keys()
    assert {name: live[name] for name in recorded} == recorded
    for each in messages:
        assert complaints(each.data, live[each.topic][1]) == []
    assert {each.topic for each in messages} >= {"/bytes", "/calls", "/outcomes", "/pose/odometry"}


@contextlib.asynccontextmanager
async def driving(client: Client, topic: str = "/drive", **speeds: object) -> AsyncIterator[None]:
    """Drive as a held stick does, until the block or the connection ends."""
    number = await client.advertise(topic)

    async def hold() -> None:
        with contextlib.suppress(websockets.ConnectionClosed):
            while True:
                await client.publish(number, speeds or {"left": 0.03, "right": 0.03})
                await asyncio.sleep(0.05)  # clock: a stick may be held at any rate

    holding = asyncio.create_task(hold())
    try:
        yield
    finally:
        holding.cancel()
        await asyncio.wait([holding])


@simulated
async def test_a_message_has_the_speeds_of_both_wheels_or_a_twist_within_the_limit_and_drives_for_a_moment() -> None:
    async with connected(["sim://square"]) as panel:
        slot, said = panel.slots["1"], []
        commands = Commands(slot, said.append)
        for message, expected in (
            ({"left": 0.02, "right": 0.04}, (155, 311)),
            ({"linear": {"x": 0.03, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}, (233, 233)),
            ({"linear": 0.0, "angular": 1.0}, (-206, 206)),
            ({"linear": 5.0, "angular": 0.0}, (500, 500)),  # the speed limit
            ({"left": 0.2, "right": 0.1}, (500, 250)),  # and the curve is kept
        ):
            commands.hear("client", "/drive", json.dumps(message).encode())
            await asyncio.sleep(0.1)
            assert wheels(slot) == expected
            assert slot.drive.driver == "client"
        await asyncio.sleep(STAND)
        assert standing(slot)
        assert slot.drive.driver == ""
        assert said == [""] * 5
        for wrong in ({"left": 1}, {"left": 0.1, "right": 0.1, "linear": 0.1}, {"linear": 0.1}, {"up": 1}):
            commands.hear("client", "/drive", json.dumps(wrong).encode())
            assert "a message of /drive was refused" in said[-1]
        await asyncio.sleep(0.1)
        assert standing(slot)
        await commands.close()


@simulated
async def test_who_leaves_the_topic_stops_the_robot_at_once_and_others_may_stop_it_but_not_drive_it() -> None:
    async with connected(["sim://square"]) as panel:
        slot, said = panel.slots["1"], []
        commands = Commands(slot, said.append)

        async def hold(client: str, seconds: float) -> None:
            for _ in range(round(seconds / 0.1)):
                commands.hear(client, "/drive", b'{"left": 0.03, "right": 0.03}')
                await asyncio.sleep(0.1)

        await hold("one", 1)
        assert wheels(slot) == (233, 233)
        commands.hear("other", "/drive", b'{"left": -0.03, "right": -0.03}')
        assert "driven by somebody else" in said[-1]
        commands.hear("other", "/leds", b'{"body": true}')
        assert "driven by somebody else" in said[-1]
        commands.leave("other")
        await hold("one", 1)
        assert wheels(slot) == (233, 233)
        commands.leave("one")
        await asyncio.sleep(0.1)
        assert standing(slot)
        await hold("one", 1)
        commands.hear("other", "/stop", b"")
        await hold("one", 1)
        assert standing(slot)
        assert "until the stick is released" in said[-1]
        await commands.close()


async def test_a_topic_that_is_left_and_a_connection_that_ends_stop_the_robot() -> None:
    async with door() as (panel, url), connected_to(url) as client:
        slot = panel.slots["1"]
        for leave in (True, False):
            async with connected_to(url) as driver:
                number = await driver.advertise("/drive")
                async with driving(driver):
                    await until(lambda: not standing(slot))
                await driver.publish(number, {"left": 0.03, "right": 0.03})
                if leave:
                    await driver.say("unadvertise", channelIds=[number])
                    await until(lambda: standing(slot) and not slot.drive.driver)
            await until(lambda: standing(slot) and not slot.drive.driver)
        assert client.info


@pytest.mark.long
async def test_a_client_that_is_killed_while_it_drives_leaves_a_robot_that_stands() -> None:
    async with door() as (panel, url):
        slot = panel.slots["1"]
        process = await asyncio.create_subprocess_exec(
            sys.executable, str(CLIENT), url, "/drive", stdout=asyncio.subprocess.DEVNULL
        )
        try:
            await until(lambda: not standing(slot))
            process.kill()
            await until(lambda: standing(slot))
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()


async def test_a_behaviour_ends_with_the_last_page_and_clients_see_the_readings_go_on() -> None:
    async with door("sim://arena") as (panel, url), connected_to(url) as client:
        await until(lambda: "/readings/proximity" in client.topics)
        slot = panel.slots["1"]
        slot.join("page")
        slot.runner.start("avoid")
        slot.leave("page")
        assert slot.runner.phase is RunPhase.STOPPED
        seen = slot.readings["proximity"].time
        await until(lambda: slot.readings["proximity"].time > seen)


@needs_page
async def test_the_page_shows_the_same_robots_and_its_stop_stops_a_driving_client() -> None:
    address = listen(port=0)
    async with (
        door("sim://square", "sim://arena", page=address) as (panel, url),
        connected_to(url) as client,
        page_rig.opened(address.url) as page,
    ):
        await until(lambda: [robot["key"] for robot in page.robots] == [*panel.slots])
        slot = panel.slots["2"]
        async with driving(client, "/robot2/drive"):
            await until(lambda: not standing(slot))
            assert slot.drive.driver
            assert (await page.ask("stop"))["ok"]
            since = len(client.statuses)
            await until(lambda: any("until the stick is released" in each for each in client.statuses[since:]))
            await until(lambda: standing(slot))
            since = len(client.statuses)
            await until(lambda: any("until the stick is released" in each for each in client.statuses[since:]))
            assert standing(slot)  # the stick is still held
    address.socket.close()


async def test_one_client_drives_at_a_time_and_everybody_may_stop() -> None:
    async with door() as (panel, url), connected_to(url) as one, connected_to(url) as other:
        slot = panel.slots["1"]
        second, stop = await other.advertise("/drive"), await other.advertise("/stop")
        async with driving(one):
            await until(lambda: not standing(slot))
            await other.publish(second, {"left": -0.03, "right": -0.03})
            await until(lambda: any("driven by somebody else" in each for each in other.statuses))
            assert wheels(slot) == (233, 233)
            await other.publish(stop, {})
            await until(lambda: standing(slot) and slot.drive.is_latched)
            since = len(one.statuses)
            await until(lambda: any("until the stick is released" in each for each in one.statuses[since:]))
            assert standing(slot)  # the stick is still held


@pytest.mark.parametrize("firmware", FIRMWARES)
async def test_a_robot_of_each_firmware_has_its_topics_is_driven_and_stands_in_silence(
    firmware: str,
) -> None:
    async with door(f"sim://square?firmware={firmware}") as (panel, url), connected_to(url) as client:
        slot = panel.slots["1"]
        absent = set(FIRMWARES[firmware].absent)
        of_all = {"proximity", "encoders", "accelerometer", "ground", "microphones", "selector"}
        of_some = {"gyroscope", "battery", "distance", "magnetometer", "sd_card", "temperature"}
        expected = of_all | (of_some - absent)
        await client.subscribe(*(f"/readings/{name}" for name in sorted(expected)), "/pictures", "/ranges/infrared")
        for name in sorted(expected):
            await client.first(f"/readings/{name}")
        await client.first("/pictures")
        await client.first("/ranges/infrared")
        if "distance" in expected:
            await client.subscribe("/ranges/distance")
            await client.first("/ranges/distance")
        assert not {f"/readings/{name}" for name in absent} & client.topics.keys()
        async with driving(client, left=0.02, right=0.04):
            await until(lambda: wheels(slot) == (155, 311) and slot.drive.driver)
        await until(lambda: standing(slot))


async def test_leds_and_parameters() -> None:
    async with door() as (panel, url), connected_to(url) as client:
        slot = panel.slots["1"]
        number = await client.advertise("/leds")
        await client.publish(number, {"ring": [True, False] * 4, "body": True})
        await until(lambda: slot.control is not None and slot.control.world.snapshot().robots[0].lamps.body)
        await client.say("getParameters", parameterNames=[], id="all")
        await until(lambda: "/top_speed" in client.parameters)
        await client.set(top_speed=0.1, rate=20, camera=True, name="mine", nothing=1)
        await until(lambda: slot.drive.limit > 0.7 and slot.watcher.rate == 20 and slot.watcher.pictures)
        await until(lambda: client.parameters["/rate"] == 20 and client.parameters["/camera"] is True)
        assert client.parameters["/name"] == "sim://square"
        await client.set(top_speed=99)
        await until(lambda: any("top_speed" in each for each in client.statuses))
        assert slot.drive.limit < 1
        await client.set(camera=False)
        await until(lambda: slot.watcher.pictures is None)


async def test_several_robots_have_topics_and_frames_of_their_own() -> None:
    async with door("sim://square?robots=2", "sim://arena") as (panel, url), connected_to(url) as client:
        await client.subscribe("/robot1/tf", "/robot3/readings/proximity", "/robot3/tf")
        found = await client.first("/robot1/tf")
        assert (found["parent_frame_id"], found["child_frame_id"]) == ("world", "robot1/robot")
        await client.first("/robot3/readings/proximity")
        assert not [name for name in client.topics if not name.startswith(("/robot1/", "/robot2/", "/robot3/"))]
        async with driving(client, "/robot2/drive"):
            await until(lambda: not standing(panel.slots["2"]))
        assert standing(panel.slots["1"])
        assert standing(panel.slots["3"])


async def test_a_recording_is_played_with_the_same_topics_and_takes_no_commands(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"

    async def program(robot) -> None:  # type: ignore[no-untyped-def]
        with robot.record(path):
            await robot.set_speed(0.2, 0.2)
            for _ in range(20):
                await robot.proximity()
                await robot.encoders()
                await robot.sleep(0.1)

    run_on("sim://square?speed=max", program)
    async with door(f"replay://{path}") as (panel, url), connected_to(url) as client:
        await client.subscribe("/readings/proximity", "/tf", "/ranges/infrared", "/calls", "/pose/measured")
        for name in ("/readings/proximity", "/tf", "/ranges/infrared", "/calls", "/pose/measured"):
            await client.first(name)
        number = await client.advertise("/drive")
        await client.publish(number, {"left": 0.03, "right": 0.03})
        await until(lambda: any("recording" in each for each in client.statuses))
        slot = panel.slots["1"]
        await until(lambda: slot.is_playing and slot.playback.at > 1.0)
        await until(lambda: slot.is_playing and slot.playback.at < 1.0)  # it begins again
        await client.first("/readings/proximity", len(client.messages))
        await until(lambda: slot.is_playing and 0.2 < slot.playback.at < 1.0)
        await client.set(paused=True)
        await until(lambda: client.parameters.get("/paused") is True)


# -- strangers --


@pytest.mark.skipif(sys.platform == "darwin", reason="macOS has one loopback address")
def test_the_address_is_of_this_computer_alone_and_no_page_can_guess_it() -> None:
    hosts = {hidden_host() for _ in range(20)}
    assert len(hosts) == 20
    assert all(ipaddress.ip_address(host).is_loopback for host in hosts)
    assert not hosts & {"127.0.0.1", "127.0.1.1"}


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.1", "::"])
def test_other_computers_are_refused_with_the_way_through_a_tunnel(
    host: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["foxglove", "sim://square", "--host", host]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "ssh -L 8765:127.0.0.1:8765" in err


def resident() -> int:
    """Return the memory of this process, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def malformed(drawn: random.Random) -> str | bytes:
    """Return something that is not a message of the protocol."""
    match drawn.randrange(5):
        case 0:
            return drawn.randbytes(drawn.randrange(200))
        case 1:
            return "".join(map(chr, drawn.choices(range(32, 0x2000), k=drawn.randrange(200))))
        case 2:
            return json.dumps(
                {"op": drawn.choice(["subscribe", "advertise", "x", 7, None]), "channels": drawn.random()}
            )
        case 3:
            return struct.pack("<BI", drawn.randrange(256), drawn.getrandbits(32)) + drawn.randbytes(50)
        case _:
            return "[" * drawn.randrange(3000)


WRONG: list[object] = [None, True, "1", [], {}, 1e308, -1e308, 2**70, [[1]], "NaN", {"x": "a"}, {"x": 1e400}]


def hostile(drawn: random.Random) -> bytes:
    """Return the content of a message that nothing may follow from, except that the robot stands."""
    names = ["left", "right", "linear", "angular", "ring", "body", "__class__", "x" * 50]
    match drawn.randrange(4):
        case 0:
            return json.dumps({drawn.choice(names): drawn.choice(WRONG) for _ in range(3)} | {"extra": 1}).encode()
        case 1:
            return b'{"left": NaN, "right": Infinity}'
        case 2:
            return b"{" * drawn.randrange(5000)
        case _:
            return drawn.randbytes(drawn.randrange(3000))


async def still_serves(url: str, slot: Slot) -> None:
    """Check that a new client sees and drives the robot."""
    async with connected_to(url) as client:
        await client.subscribe("/readings/proximity")
        await client.first("/readings/proximity")
        async with driving(client):
            await until(lambda: not standing(slot))
    await until(lambda: standing(slot))


@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read as Linux shows it")
async def test_a_thousand_malformed_and_a_thousand_hostile_messages_are_refused() -> None:
    drawn = random.Random(20)
    async with door() as (panel, url):
        slot = panel.slots["1"]
        await still_serves(url, slot)
        before = resident()
        sent = 0
        while sent < 1000:
            with contextlib.suppress(websockets.ConnectionClosed):
                async with connected_to(url) as client:
                    for _ in range(100):
                        await client.socket.send(malformed(drawn))
                        sent += 1
                        await asyncio.sleep(0.002)  # clock: slower is no harm, and faster ones are dropped unread
        sent = 0
        async with connected_to(url) as client:
            numbers = [
                await client.advertise(topic) for topic in ("/drive", "/leds", "/robot1/drive", "/elib/x", "/tf")
            ]
            for sent in range(1000):
                await client.publish(numbers[sent % len(numbers)], hostile(drawn))
                assert slot.drive.target == (0.0, 0.0)
                await asyncio.sleep(0.006)  # clock: slower is no harm, and faster ones are dropped unread
            assert sent == 999
            assert len(client.statuses) < 100
        assert standing(slot)
        assert resident() - before < 20_000_000
        await still_serves(url, slot)


async def test_a_client_that_sends_too_much_is_cut_off_or_not_heard() -> None:
    async with door() as (panel, url):
        slot = panel.slots["1"]
        async with connected_to(url) as client:
            with contextlib.suppress(websockets.ConnectionClosed):
                await client.socket.send(b"x" * 20_000_000)
            await until(lambda: client.socket.close_code is not None)
        async with connected_to(url) as client:
            channels = [{"id": k, "topic": "/drive", "encoding": "json", "schemaName": ""} for k in range(1, 300)]
            await client.say("advertise", channels=channels)
            await client.publish(299, {"left": 0.03, "right": 0.03})
            await client.say("getParameters", parameterNames=[], id="later")
            await until(lambda: client.parameters)  # all that was said before this was heard
            assert slot.drive.target == (0.0, 0.0)
        await still_serves(url, slot)


# -- the command --


def test_ctrl_c_stops_the_robot_and_writes_what_was_asked_for(tmp_path: Path) -> None:
    words = ("foxglove", "sim://square", "--port", "0", "--layout", "layout.json", "--record", "run.mcap")
    with started(*words, cwd=tmp_path) as run:
        url = run.out.line()

        async def drive() -> None:
            async with connected_to(url) as client:
                await client.subscribe("/readings/encoders")
                async with driving(client):
                    await until(lambda: any(each.data["left"] > 20 for each in client.messages))
                    assert await asyncio.to_thread(run.end, signal.SIGINT) == 0

        asyncio.run(drive())
    assert json.loads((tmp_path / "layout.json").read_text()) == json.loads(layout_of([""]))
    calls = [each.data["command"] for each in read(tmp_path / "run.mcap") if each.topic == "/calls"]
    assert calls[-1] == "stop"
    assert "set_speed" in calls


@needs_page
@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "sigterm"])
async def test_a_signal_to_the_command_stops_a_robot_that_a_client_drives(number: signal.Signals) -> None:
    controls: list[Control] = []
    async with serve(SimulationSettings(world="square", baud=0), tcp="0", control=controls.append) as robots:
        left, right = controls[0].simulation.robots[0].emulator.firmware.motors
        with started("foxglove", robots[0].url, "--port", "0", "--view") as run:
            url = await asyncio.to_thread(run.out.line)
            page = (await asyncio.to_thread(run.err.until, "The panel: ")).removeprefix("The panel: ")
            assert page_rig.fetch(page)[0] == 200
            async with connected_to(url) as client, driving(client):
                await until(lambda: (left.speed, right.speed) == (233, 233))
                assert await asyncio.to_thread(run.end, number) == 0
                assert (left.speed, right.speed) == (0, 0)


@pytest.mark.parametrize(("missing", "extra"), [("foxglove", "foxglove"), ("aiohttp", "web"), ("mcap", "record")])
def test_a_missing_package_is_named_with_what_to_type(
    missing: str, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, missing, None)
    assert main(["foxglove", "sim://square", "--port", "0", "--record", str(tmp_path / "run.mcap")]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert missing in err
    assert install(extra) in err


# -- the layout --


def topics_in(value: object) -> set[str]:
    """Return everything in a layout that is called like a topic."""
    match value:
        case dict():
            return set().union(*map(topics_in, [*value, *value.values()]))
        case list():
            return set().union(*map(topics_in, value))
        case str() if value.startswith("/"):
            return {value}
    return set()


@pytest.mark.parametrize(
    ("robots", "prefixes"),
    [
        ("sim://square?robots=2", ["/robot1", "/robot2"]),
        *((f"sim://square?firmware={each}", [""]) for each in FIRMWARES),
    ],
)
async def test_the_layout_names_topics_and_fields_that_are_there(robots: str, prefixes: list[str]) -> None:
    layout = json.loads(layout_of(prefixes))
    panels = layout["configById"]
    shown = topics_in(panels)
    assert {prefix + name for prefix in prefixes for name in ("/drive", "/pictures", "/notes")} <= shown
    async with door(robots) as (_, url), connected_to(url) as client:
        await until(lambda: all(prefix + "/readings/encoders" in client.topics for prefix in prefixes))
        ours = {prefix + name for prefix in prefixes for name in CLIENT_TOPICS}
        for name in shown - ours:
            topic, _, field = name.partition(".")
            await until(lambda topic=topic: topic in client.topics)
            assert topic in client.topics, name
            assert not field or field in client.topics[topic].schema["properties"], name

    def leaves(place: object) -> list[str]:
        if isinstance(place, str):
            tabs = panels[place].get("tabs", []) if place.startswith("Tab!") else []
            return [place, *(leaf for tab in tabs for leaf in leaves(tab["layout"]))]
        assert isinstance(place, dict)
        return leaves(place["first"]) + leaves(place["second"])

    assert sorted(leaves(layout["layout"])) == sorted(panels)
    assert len({topic.name for topic in TOPICS} & set(CLIENT_TOPICS)) == 0
