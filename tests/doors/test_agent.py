"""The agent's door: tools within their limits, a person's stop, and a robot that stands when its client is gone."""

import asyncio
import collections
import contextlib
import json
import math
import os
import random
import signal
import sys
from types import SimpleNamespace

import aiohttp
import pytest
from mcp.client.client import Client
from mcp.client.stdio import StdioServerParameters, stdio_client
from mcp_types import CallToolRequestParams, CallToolResult

from elib.cli import main
from elib.doors.agent.driver import CallRefused
from elib.doors.agent.limits import Limits
from elib.doors.agent.server import AgentDoor, Journal, serve_pipes
from elib.doors.agent.tools import Tools
from elib.doors.robots import connected
from elib.panel.events import KINDS
from elib.panel.watching import virtual
from elib.testing import simulated
from lanes import short
from shared import PATIENCE, until

FIRMWARES = ("btcom-1.1.3", "asercom-1.2.2", "btcom-2.0", "epuck2", "epuck2-wifi")
LIMITS = Limits(fence=0.3, speed=0.1, calls=500, seconds=600.0)
STANDING = 0.5
"""s within which the wheels stand after a client's end."""
CLIENT = """
import json, sys
def say(**message):
    print(json.dumps({"jsonrpc": "2.0", **message}), flush=True)
say(id=1, method="initialize", params={"protocolVersion": "2025-06-18", "capabilities": {},
    "clientInfo": {"name": "test", "version": "1"}})
sys.stdin.readline()
say(method="notifications/initialized")
say(id=2, method="tools/call", params={"name": "drive", "arguments": {"distance": 0.28, "speed": 0.005}})
sys.stdin.read()
"""
"""It drives for a minute, and waits to be killed."""


@contextlib.asynccontextmanager
async def tools_on(url="sim://arena", limits=LIMITS):
    async with connected([url]) as panel:
        yield Tools(panel, limits)


def world_of(tools, key="1"):
    return virtual(tools.drivers[key].slot.robot).simulation.world


def went(tools, start, key="1"):
    """Return how far a robot is from where it started, m."""
    pose = world_of(tools, key).pose(tools.drivers[key].slot.index)
    return math.dist((pose.x, pose.y), (start.x, start.y))


def speeds(tools, key="1"):
    """Return how fast the wheels of a robot turn, m/s."""
    robot = world_of(tools, key)._robot(tools.drivers[key].slot.index)
    return robot.left_speed, robot.right_speed


def door_of(tools):
    """Return the server of tools, with a journal that says nothing."""
    return AgentDoor(tools, Journal(tools, SimpleNamespace(say=lambda text: None), None))


async def call(tools, name, /, **arguments):
    """Call a tool; return its data, its text, whether it has a picture, and whether it failed."""
    result = await tools.call(name, arguments)
    text, *pictures = result.content
    return SimpleNamespace(
        data=result.structured_content, text=text.text, picture=bool(pictures), is_error=result.is_error
    )


async def test_a_client_drives_looks_and_reads_by_a_process_of_its_own():
    parameters = StdioServerParameters(command=sys.executable, args=["-m", "elib", "agent", "sim://red-boxes"])
    async with Client(stdio_client(parameters)) as client:
        listed = {tool.name: tool for tool in (await client.list_tools()).tools}
        assert set(listed) == {
            "robots", "status", "read_all", "look", "drive", "turn", "go_to", "set_leds", "run_behaviour", "stop",
        }  # fmt: skip
        assert listed["drive"].input_schema["properties"]["speed"]["maximum"] == 0.1
        driven = await client.call_tool("drive", {"distance": 0.05})
        assert driven.structured_content["ended"] == "reached"
        assert driven.structured_content["driven"] == pytest.approx(0.05, abs=0.001)
        picture = await client.call_tool("look", {})
        assert [each.type for each in picture.content] == ["text", "image"]
        refused = await client.call_tool("drive", {"distance": "far"})
        assert refused.is_error


@simulated
async def test_a_call_is_a_line_of_the_event_log_that_the_page_can_hide():
    async with tools_on() as tools:
        await door_of(tools)._call(SimpleNamespace(request=None), CallToolRequestParams(name="status", arguments={}))
        lines = tools.drivers["1"].slot.log.lines
        assert lines[-1].text.startswith("status {}: ")
        assert {line.kind for line in lines} <= KINDS.keys()


async def test_the_wheels_stand_after_the_client_is_killed():
    async with tools_on() as tools:
        door = door_of(tools)
        (source, their_out), (their_in, target) = os.pipe(), os.pipe()
        client = await asyncio.create_subprocess_exec(sys.executable, "-c", CLIENT, stdin=their_in, stdout=their_out)
        os.close(their_in)
        os.close(their_out)
        serving = asyncio.create_task(serve_pipes(door, source, target))
        start = world_of(tools).pose(0)
        await until(lambda: went(tools, start) > 0.005)
        client.send_signal(signal.SIGKILL)
        await client.wait()
        await until(lambda: speeds(tools) == (0, 0) and not tools.drivers["1"].slot.drive.may_move)
        assert went(tools, start) < 0.28
        await until(serving.done)
        await serving


@pytest.mark.parametrize("is_cancelled", [True, False], ids=["cancelled", "gone"])
@simulated
async def test_the_wheels_stand_half_a_second_after_the_caller_cancelled_or_is_gone(is_cancelled):
    async with tools_on() as tools:
        door, is_gone = door_of(tools), False

        async def is_disconnected():
            return is_gone

        request = SimpleNamespace(is_disconnected=is_disconnected)
        asked = CallToolRequestParams(name="drive", arguments={"distance": 0.28, "speed": 0.03})
        calling = asyncio.create_task(door._call(SimpleNamespace(request=request), asked))
        start = world_of(tools).pose(0)
        await until(lambda: went(tools, start) > 0.01)
        if is_cancelled:
            calling.cancel()
        else:
            is_gone = True
        await asyncio.sleep(STANDING)
        assert speeds(tools) == (0, 0)
        there = went(tools, start)
        await asyncio.sleep(5)
        assert went(tools, start) == there < 0.03
        assert not tools.drivers["1"].slot.drive.may_move
        with contextlib.suppress(asyncio.CancelledError):
            assert (await calling).structured_content["ended"] == "cancelled"


@simulated
async def test_a_flood_of_calls_and_cancellations_is_answered_and_the_robot_stays_inside_its_fence():
    draw = random.Random("flood")
    async with tools_on("sim://red-boxes", Limits(fence=0.2, speed=0.1, calls=5000, seconds=600.0)) as tools:
        door, start = door_of(tools), world_of(tools).pose(0)
        farthest = 0.0

        def measure():
            nonlocal farthest
            farthest = max(farthest, went(tools, start))

        def call_some_tool():
            name, arguments = draw.choice(
                [
                    ("drive", {"distance": draw.uniform(-0.4, 0.4)}),
                    ("turn", {"angle": draw.uniform(-360, 360)}),
                    ("go_to", {"x": draw.uniform(-0.2, 0.2), "y": draw.uniform(-0.2, 0.2)}),
                    ("run_behaviour", {"name": draw.choice(["avoid", "braitenberg"]), "seconds": 1}),
                    ("status", {}),
                    ("stop", {}),
                ]
            )
            asked = CallToolRequestParams(name=name, arguments=arguments)
            return asyncio.create_task(door._call(SimpleNamespace(request=None), asked))

        world_of(tools).follow(measure)
        for _ in range(20):
            calls = [call_some_tool() for _ in range(draw.choice([1, 6]))]
            await asyncio.sleep(draw.choice([0, 0.3, 3]))
            for call_ in calls:
                if draw.random() < 0.3:
                    call_.cancel()
            answers = await asyncio.gather(*calls, return_exceptions=True)
            assert all(isinstance(each, CallToolResult | asyncio.CancelledError) for each in answers)
        assert (await call(tools, "stop")).data["stands"]
        assert speeds(tools) == (0, 0)
        assert 0.05 < farthest < 0.2 + 0.01
        await until(lambda: not door._calls)


@pytest.mark.parametrize("firmware", short(FIRMWARES, "btcom-2.0"))
@simulated
async def test_fence_and_speed_hold_for_drawn_calls_and_behaviours(firmware):
    draw = random.Random(f"fence and speed on {firmware}")
    async with tools_on(f"sim://arena?firmware={firmware}") as tools:
        driver, world = tools.drivers["1"], world_of(tools)
        start, farthest, fastest = world.pose(0), 0.0, 0.0

        def measure():
            nonlocal farthest, fastest
            pose, robot = world.pose(0), world._robot(0)
            farthest = max(farthest, math.hypot(pose.x - start.x, pose.y - start.y))
            fastest = max(fastest, abs(robot.left_speed), abs(robot.right_speed))

        world.follow(measure)
        ended = collections.Counter()
        for _ in range(30):
            name, arguments = draw.choice(
                [
                    ("run_behaviour", {"name": draw.choice(["braitenberg", "avoid", "billiard"]), "seconds": 4}),
                    ("go_to", {"x": draw.uniform(-0.3, 0.3), "y": draw.uniform(-0.3, 0.3), "speed": 0.1}),
                    ("drive", {"distance": draw.uniform(-0.6, 0.6), "speed": draw.uniform(0.01, 0.1)}),
                    ("turn", {"angle": draw.uniform(-360, 360), "speed": draw.uniform(5, 216)}),
                ]
            )
            ended[(await call(tools, name, **arguments)).data["ended"]] += 1
            assert (world._robot(0).left_speed, world._robot(0).right_speed) == (0, 0)
        assert {"fence", "reached", "time"} <= ended.keys()
        assert 0.2 < farthest < LIMITS.fence + 0.01
        assert 0.09 < fastest <= LIMITS.speed
        assert not driver.slot.drive.may_move


@simulated
async def test_a_goal_beyond_the_fence_and_a_spent_budget_move_nothing():
    async with tools_on(limits=Limits(0.3, 0.1, 1, 600.0)) as tools:
        refused = await call(tools, "drive", distance=0.4)
        assert refused.is_error
        assert refused.data["ended"] == "fence"
        assert (await call(tools, "turn", angle=10)).data["ended"] == "budget"
        assert not (await call(tools, "stop")).is_error


@simulated
async def test_a_second_moving_call_is_refused_and_stop_ends_the_first():
    async with tools_on() as tools:
        driving = asyncio.create_task(call(tools, "drive", distance=0.25, speed=0.02))
        await until(lambda: tools.drivers["1"].busy)
        second = await call(tools, "turn", angle=90)
        assert second.data["ended"] == "busy"
        assert "drive 0.25 m" in second.text
        assert (await call(tools, "stop")).data["stands"]
        assert (await driving).data["ended"] == "stopped"


@simulated
async def test_a_persons_stop_holds_until_the_person_continues():
    async with tools_on() as tools:
        slot = tools.drivers["1"].slot
        driving = asyncio.create_task(call(tools, "drive", distance=0.25, speed=0.02))
        await until(lambda: tools.drivers["1"].busy)
        slot.stop()
        assert (await driving).data["ended"] == "person"
        for name, arguments in (("drive", {"distance": 0.1}), ("run_behaviour", {"name": "avoid"})):
            assert "a person stopped the robot" in (await call(tools, name, **arguments)).text
        slot.runner.resume()
        assert (await call(tools, "drive", distance=0.02)).data["ended"] == "reached"


@simulated
async def test_wrong_arguments_are_refused_with_the_rule():
    async with tools_on() as tools:
        for name, arguments, *rules in (
            ("drive", {"distance": math.nan}, "distance", "finite number"),
            ("drive", {"distance": True}, "distance", "valid number"),
            ("drive", {"distance": "0.1"}, "distance", "valid number"),
            ("drive", {"distance": 0.1, "speed": 0.2}, "speed", "less than or equal to 0.1"),
            ("drive", {"distance": 0.1, "robot": "2"}, "robot", "should be '1'"),
            ("turn", {"angle": 10**400}, "angle", "valid number"),
            ("turn", {}, "angle", "required"),
            ("set_leds", {"ring": [1] * 8}, "ring", "valid boolean"),
            ("run_behaviour", {"name": "../avoid"}, "name", "'avoid'"),
            ("status", {"more": 1}, "more", "not permitted"),
            ("trun", {}, "there is no tool", "did you mean turn?"),
        ):
            refused = await call(tools, name, **arguments)
            assert refused.is_error
            assert "Nothing was sent" in refused.text
            assert all(each in refused.text for each in rules), refused.text
        assert tools.budget.calls == LIMITS.calls
        with pytest.raises(CallRefused):
            tools.drivers["1"].slot.stop()
            tools.drivers["1"].check_free()


@simulated
async def test_an_option_of_a_behaviour_may_be_a_whole_number():
    async with tools_on() as tools:
        for name, options in (("avoid", {"cruise": 0.2}), ("locate-clap", {"threshold": 100})):
            ran = await call(tools, "run_behaviour", name=name, seconds=0.5, parameters=options)
            assert not ran.is_error, ran.text


def test_a_real_robot_needs_leave(capsys):
    assert main(["agent", "serial:///dev/nothing-here"]) == 2
    out, complaint = capsys.readouterr()
    assert not out
    assert "--allow-real" in complaint


async def test_http_serves_programs_and_refuses_pages_and_other_names():
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "elib", "agent", "sim://arena", "--http", "--port", "0",
        stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL,
    )  # fmt: skip
    try:
        url = (await asyncio.wait_for(process.stdout.readline(), PATIENCE)).decode().strip()
        async with Client(url) as client:
            assert (await client.call_tool("drive", {"distance": 0.02})).structured_content["ended"] == "reached"
        message = json.loads('{"jsonrpc": "2.0", "id": 1, "method": "ping"}')
        accept = {"accept": "application/json, text/event-stream"}
        async with aiohttp.ClientSession() as plain:
            for headers in ({"origin": "http://localhost:3000"}, {"host": "evil.example"}):
                async with plain.post(url, json=message, headers=accept | headers) as answer:
                    assert answer.status in (403, 421)
                    assert "access-control-allow-origin" not in answer.headers
    finally:
        process.send_signal(signal.SIGTERM)
        await asyncio.wait_for(process.wait(), PATIENCE)
