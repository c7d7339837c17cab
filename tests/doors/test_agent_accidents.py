"""What happens to the robot of an agent when calls are cancelled, links break, or a client or a person interferes."""

import asyncio
import collections
import contextlib
import http.client
import json
import math
import random
import signal
import subprocess
import sys
from urllib.parse import urlsplit

import pytest
from agent_wire import INITIALIZE, WITNESSED, Wire, memory, wire
from page_rig import opened
from test_agent import FIRMWARES, LIMITS, call, speeds, tools_on, went, world_of

from elib.base.errors import LinkLost
from elib.doors.agent.limits import Limits
from elib.panel.behaviours import RunPhase
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from elib.testing import simulated
from lanes import short
from shared import PATIENCE, until, wait_until

MEGABYTE = 1 << 20
FAR = {"distance": 1.5, "speed": 0.02, "stop_at_obstacle": False}
"""A drive that takes 75 s, so that no busy machine comes to its end."""
FULL = 1.4
"""m after which that drive is as good as done."""


def until_driving(door):
    """Wait until the robot of a door drives."""
    wait_until(lambda: not (said := door.call("status"))["stands"] and said["pose"]["x"] > 0.005)


# -- calls --


@pytest.mark.long
def test_a_connection_over_http_that_breaks_during_a_call_stops_the_robot(tmp_path):
    witness = tmp_path / "witness.json"
    words = [sys.executable, WITNESSED, str(witness), "agent", "sim://square", "--http", "--port", "0"]
    door = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    headers = {"Content-Type": "application/json", "Accept": "application/json, text/event-stream"}
    page = None

    def begin(**message):
        connection = http.client.HTTPConnection(page.hostname, page.port, timeout=PATIENCE)
        connection.request("POST", page.path, json.dumps({"jsonrpc": "2.0", **message}), headers)
        return connection

    def ask(**message):
        connection = begin(**message)
        try:
            answer = connection.getresponse()
            if "mcp-session-id" in answer.headers:
                headers["Mcp-Session-Id"] = answer.headers["mcp-session-id"]
            lines = answer.read().splitlines()
        finally:
            connection.close()
        return next((json.loads(line[6:]) for line in lines if line.startswith(b"data: {")), {})

    def status():
        answer = ask(id=9, method="tools/call", params={"name": "status", "arguments": {}})
        return answer["result"]["structuredContent"]

    try:
        page = urlsplit(door.stdout.readline().strip())
        ask(id=1, method="initialize", params=INITIALIZE)
        ask(method="notifications/initialized")
        driving = begin(id=2, method="tools/call", params={"name": "drive", "arguments": FAR})
        wait_until(lambda: status()["pose"]["x"] > 0.005)
        driving.close()
        wait_until(lambda: status()["stands"])
        ask(id=3, method="tools/call", params={"name": "robots", "arguments": {}})
    finally:
        door.terminate()
        door.wait(PATIENCE)
        door.stdout.close()
    said = json.loads(witness.read_text())
    assert said["farthest"] < FULL
    assert not said["unconfirmed"]


@pytest.mark.long
@pytest.mark.parametrize("calls", [200, 1_000_000])
def test_a_client_that_does_not_read_is_left_with_a_standing_robot_and_flat_memory(tmp_path, calls):
    words = [sys.executable, WITNESSED, str(tmp_path / "w.json"), "agent", "sim://square", "--calls", "100000"]
    door = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    line = b'{"jsonrpc": "2.0", "id": 3, "method": "tools/call", "params": {"name": "status", "arguments": {}}}\n'
    try:

        def send(**message):
            door.stdin.write(json.dumps({"jsonrpc": "2.0", **message}).encode() + b"\n")
            door.stdin.flush()

        send(id=1, method="initialize", params=INITIALIZE)
        door.stdout.readline()
        send(method="notifications/initialized")
        send(id=2, method="tools/call", params={"name": "look", "arguments": {}})
        door.stdout.readline()
        before = most = memory(door)
        send(id=3, method="tools/call", params={"name": "drive", "arguments": FAR})
        with contextlib.suppress(BrokenPipeError):
            for number in range(calls):
                door.stdin.write(line)
                if number % 100 == 99:
                    door.stdin.flush()
                    most = max(most, memory(door))
            assert calls < 1000, "the door takes calls for ever"
        assert most - before < 40 * MEGABYTE
        with contextlib.suppress(BrokenPipeError):
            door.stdin.close()
        assert door.wait(PATIENCE) == 0
    finally:
        door.kill()
        door.wait()
        door.stdout.close()
    said = json.loads((tmp_path / "w.json").read_text())
    assert said["farthest"] < FULL
    assert not said["unconfirmed"]


@pytest.mark.parametrize("number", short([signal.SIGINT, signal.SIGTERM], signal.SIGTERM))
def test_a_signal_is_the_usual_end_of_a_door_and_stops_its_robot(tmp_path, number):
    with wire(tmp_path, "sim://square") as door:
        door.begin("drive", json.dumps(FAR))
        until_driving(door)
        door.process.send_signal(number)
        assert door.process.wait(PATIENCE) == 0
        assert not json.loads(door.witness.read_text())["unconfirmed"]


# -- links --


@simulated
async def test_a_link_that_dies_during_a_call_is_the_result_and_nothing_drives_until_it_is_back():
    room = tools_on("sim://square?baud=0", Limits(2.0, 0.1, 500, 600.0))
    tools = await room.__aenter__()
    driving = asyncio.create_task(call(tools, "drive", **FAR))
    start = world_of(tools).pose(0)
    await until(lambda: went(tools, start) > 0.02)
    tools.drivers["1"].slot.control.cut(0)
    result = await driving
    assert (result.data["ended"], result.data["stands"], result.is_error) == ("link", False, True)
    assert "may still be moving" in result.text
    assert (await call(tools, "drive", distance=0.1)).data["ended"] == "link"
    assert (await call(tools, "status")).data["stands"] is False
    with pytest.raises(LinkLost, match="did not confirm"):
        await room.__aexit__(None, None, None)


SEEDS = random.Random("poor link").sample(range(1 << 32), 3)


@pytest.mark.parametrize("seed", short(SEEDS, SEEDS[0]))
@simulated
async def test_on_a_poor_link_every_call_ends_within_its_limits_and_the_robot_stands(seed, tmp_path):
    script = tmp_path / "poor.toml"
    script.write_text(
        'description = "Answers that are lost, late and mangled"\n'
        '[[fault]]\nkind = "loss"\nprobability = 0.05\n'
        '[[fault]]\nkind = "corrupt"\nprobability = 0.02\n'
        '[[fault]]\nkind = "delay"\ndelay = 0.05\nprobability = 0.1\n',
        encoding="utf-8",
    )
    draw = random.Random(seed)
    ended = collections.Counter()
    async with tools_on(f"sim://square?fault={script}&seed={seed}") as tools:
        world = world_of(tools)
        start = world.pose(0)
        for _ in range(15):
            name, arguments = draw.choice(
                [
                    ("drive", {"distance": draw.uniform(-0.2, 0.2)}),
                    ("turn", {"angle": draw.uniform(-180, 180)}),
                    ("run_behaviour", {"name": "braitenberg", "seconds": 2}),
                    ("read_all", {}),
                    ("look", {}),
                ]
            )
            result = await call(tools, name, **arguments)
            ended[result.data.get("ended", "")] += 1
            if result.data.get("stands"):
                assert speeds(tools) == (0, 0)
            assert went(tools, start) < LIMITS.fence + 0.03
        assert ended["reached"] + ended["time"] > 3, ended


# -- robots --


@pytest.mark.parametrize("firmware", short(FIRMWARES, "epuck2-wifi"))
@simulated
async def test_every_tool_works_on_each_firmware(firmware):
    async with tools_on(f"sim://red-boxes?firmware={firmware}") as tools:
        world = world_of(tools)
        start = world.pose(0)
        assert (await call(tools, "drive", distance=0.05)).data["ended"] == "reached"
        assert went(tools, start) == pytest.approx(0.05, abs=0.005)
        there = world.pose(0)
        assert (await call(tools, "go_to", x=0.05, y=0.0)).data["ended"] == "reached"
        assert world.pose(0) == there, "it was there already"
        assert (await call(tools, "turn", angle=90)).data["ended"] == "reached"
        turned = math.remainder(world.pose(0).heading - start.heading, math.tau)
        assert math.degrees(turned) == pytest.approx(90, abs=3)
        assert (await call(tools, "go_to", x=0.05, y=0.06)).data["ended"] == "reached"
        back = asyncio.ensure_future(call(tools, "go_to", x=0.05, y=0.03))
        while not back.done():
            assert went(tools, start) > 0.056, "it does not drive beyond the place"
            await asyncio.sleep(0.05)
        assert (await call(tools, "go_to", x=0.0, y=0.0)).data["ended"] == "reached"
        assert went(tools, start) < 0.01
        assert (await call(tools, "look")).picture
        assert "proximity" in (await call(tools, "read_all")).text
        ring = {} if firmware == "epuck2-wifi" else {"ring": [True] * 4 + [False] * 4}  # there, the Wi-Fi has some LEDs
        assert not (await call(tools, "set_leds", front=True, **ring)).is_error
        assert (await call(tools, "run_behaviour", name="avoid", seconds=1)).data["ended"] == "time"
        assert (await call(tools, "stop")).data["stands"]
        assert speeds(tools) == (0, 0)


@simulated
async def test_a_thing_in_the_way_ends_a_drive_to_a_place_but_no_turn_beside_it():
    async with tools_on("sim://red-boxes", Limits(2.0, 0.1, 500, 600.0)) as tools:
        start = world_of(tools).pose(0)
        met = await call(tools, "drive", distance=1.5)
        assert met.data["ended"] == "obstacle"
        far = met.data["driven"]
        assert (await call(tools, "go_to", x=0.0, y=0.0)).data["ended"] == "reached"  # it turns beside the thing first
        assert went(tools, start) < 0.01
        again = await call(tools, "go_to", x=1.5, y=0.0)
        assert again.data["ended"] == "obstacle"
        assert went(tools, start) == pytest.approx(far, abs=0.01)
        assert speeds(tools) == (0, 0)


@simulated
async def test_several_robots_are_named_and_driven_apart():
    async with tools_on("sim://arena?robots=3") as tools:
        world = world_of(tools)
        starts = [world.pose(robot) for robot in range(3)]
        driving = [
            asyncio.create_task(call(tools, "drive", robot=key, distance=0.04, speed=0.02, stop_at_obstacle=False))
            for key in "12"
        ]
        await until(lambda: tools.drivers["1"].busy and tools.drivers["2"].busy)
        assert (await call(tools, "drive", robot="2", distance=0.1)).data["ended"] == "busy"
        assert (await call(tools, "stop", robot="1")).data["stands"]
        assert [(await each).data["ended"] for each in driving] == ["stopped", "reached"]
        assert went(tools, starts[0]) < 0.02
        assert went(tools, starts[1], "2") == pytest.approx(0.04, abs=0.005)
        assert world.pose(2) == starts[2]


@pytest.mark.long
async def test_a_robot_that_is_not_virtual_is_driven_with_leave_in_a_smaller_fence(tmp_path):
    controls: list[Control] = []
    async with serve(SimulationSettings(world="square", baud=0), tcp="0", control=controls.append) as robots:
        world = controls[0].world
        start = world.pose(0)

        def drive():
            with wire(tmp_path, robots[0].url, "--allow-real") as door:
                assert door.call("drive", distance=0.6)["ended"] == "fence"
                assert door.call("drive", distance=0.05)["ended"] == "reached"
                door.begin("drive", json.dumps(FAR | {"distance": 0.4}))
                until_driving(door)
                door.process.stdin.close()
                assert door.process.wait(PATIENCE) == 0

        await asyncio.to_thread(drive)
        controls[0].simulation.catch_up()
        there = world.pose(0)
        assert 0.05 < math.dist((there.x, there.y), (start.x, start.y)) < 0.5
        await until(lambda: controls[0].simulation.catch_up() or world.wheel_speeds(0) == (0, 0))


# -- a person --


@simulated
async def test_with_the_last_page_a_persons_behaviour_ends_and_the_agents_own_goes_on():
    async with tools_on() as tools:
        slot = tools.drivers["1"].slot
        slot.join("page")
        slot.runner.start("avoid")
        slot.leave("page")
        assert slot.runner.phase is RunPhase.STOPPED
        await slot.runner.finished(PATIENCE)
        running = asyncio.create_task(call(tools, "run_behaviour", name="avoid", seconds=3))
        await until(lambda: slot.runner.phase is RunPhase.RUNNING)
        slot.join("page")
        slot.leave("page")
        assert slot.runner.phase is RunPhase.RUNNING
        assert (await running).data["ended"] == "time"
        seen = slot.readings["proximity"].time
        await until(lambda: slot.readings["proximity"].time > seen)


@pytest.mark.long
async def test_a_person_stops_the_robot_on_the_page_and_the_log_has_every_call(tmp_path, monkeypatch):
    monkeypatch.setenv("BROWSER", "true")
    log = tmp_path / "calls.jsonl"
    words = [sys.executable, "-m", "elib", "agent", "sim://square", "--view", "--log", str(log)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    door = subprocess.Popen(words, **pipes)  # noqa: ASYNC220  # threads read it
    client = Wire(door.stdout, door.stdin)

    async def end(number):
        return (await asyncio.to_thread(client.end, number))["result"]

    try:
        url = (await asyncio.to_thread(door.stderr.readline)).decode().split()[-1]
        await asyncio.to_thread(client.greet)
        async with opened(url) as page:
            key = await page.connected()
            driving = client.begin("drive", json.dumps(FAR))
            await until(lambda: page.tick["drive"]["may_move"])
            await page.ask("stop", robot=key)
            stopped = (await end(driving))["structuredContent"]
            assert (stopped["ended"], stopped["stands"]) == ("person", True)
            refused = await end(client.begin("drive", '{"distance": 0.02}'))
            assert "a person stopped the robot" in refused["content"][0]["text"]
            await page.ask("resume_behaviour", robots=[key])
            driven = await end(client.begin("drive", '{"distance": 0.02}'))
            assert driven["structuredContent"]["ended"] == "reached"
    finally:
        door.stdin.close()
        assert await asyncio.to_thread(door.wait, PATIENCE) == 0
        client.reader.join()
        door.stdout.close()
        door.stderr.close()
    lines = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    assert [line["tool"] for line in lines] == ["drive", "drive", "drive"]
    assert lines[0]["arguments"] == FAR
