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

import pytest

pytest.importorskip("mcp")

import aiohttp
from mcp.client.client import Client
from mcp.client.stdio import StdioServerParameters, stdio_client

from elib.doors.agent.driver import Refused
from elib.doors.agent.limits import Limits
from elib.doors.agent.pipes import Complaints
from elib.doors.agent.server import Door, Journal, serve_pipes
from elib.doors.agent.tools import Tools
from elib.doors.robots import connected
from elib.errors import ArgumentError
from elib.testing import simulated
from elib.web.watching import virtual

LIMITS = Limits(fence=0.3, speed=0.1, calls=500, seconds=600.0)
STANDING = 0.5
"""s within which the wheels stand after a client's end."""
CLIENT = """
import json, sys, time
def say(**message):
    print(json.dumps({"jsonrpc": "2.0", **message}), flush=True)
say(id=1, method="initialize", params={"protocolVersion": "2025-06-18", "capabilities": {},
    "clientInfo": {"name": "test", "version": "1"}})
sys.stdin.readline()
say(method="notifications/initialized")
say(id=2, method="tools/call", params={"name": "drive", "arguments": {"distance": 0.28, "speed": 0.03}})
time.sleep(60)
"""


@contextlib.asynccontextmanager
async def tools_on(url="sim://arena", limits=LIMITS):
    async with connected([url]) as panel:
        yield Tools(panel, limits)


def world_of(tools, key="1"):
    return virtual(tools.drivers[key].slot.robot).simulation.world


async def call(tools, name, /, **arguments):
    tool = tools.tools[name]
    return await tools.call(tool, tool.check(arguments))


async def until(is_so, timeout=5.0):
    async with asyncio.timeout(timeout):
        while not is_so():  # noqa: ASYNC110  # what is waited for sets no event
            await asyncio.sleep(0.01)


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


async def test_the_wheels_stand_soon_after_the_client_is_killed():
    async with tools_on() as tools:
        door = Door(tools, Journal(tools, Complaints(), None))
        (source, their_out), (their_in, target) = os.pipe(), os.pipe()
        client = await asyncio.create_subprocess_exec(sys.executable, "-c", CLIENT, stdin=their_in, stdout=their_out)
        os.close(their_in)
        os.close(their_out)
        serving = asyncio.create_task(serve_pipes(door, source, target))
        world = world_of(tools)
        start = world.pose(0)
        await until(lambda: math.dist((start.x, start.y), (world.pose(0).x, world.pose(0).y)) > 0.01, 20)
        client.send_signal(signal.SIGKILL)
        await client.wait()
        await asyncio.sleep(STANDING)
        where = world.pose(0)
        await asyncio.sleep(0.3)
        assert world.pose(0) == where
        assert not tools.drivers["1"].slot.drive.may_move
        await asyncio.wait_for(serving, 5)


@pytest.mark.parametrize("firmware", ["btcom-1.1.3", "asercom-1.2.2", "btcom-2.0", "epuck2", "epuck2-wifi"])
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


async def test_a_goal_beyond_the_fence_and_a_spent_budget_move_nothing():
    async with tools_on(limits=Limits(0.3, 0.1, 1, 600.0)) as tools:
        refused = await call(tools, "drive", distance=0.4)
        assert refused.is_error
        assert refused.data["ended"] == "fence"
        assert (await call(tools, "turn", angle=10)).data["ended"] == "budget"
        assert not (await call(tools, "stop")).is_error


async def test_a_second_moving_call_is_refused_and_stop_ends_the_first():
    async with tools_on() as tools:
        driving = asyncio.create_task(call(tools, "drive", distance=0.25, speed=0.02))
        await until(lambda: tools.drivers["1"].busy)
        second = await call(tools, "turn", angle=90)
        assert second.data["ended"] == "busy"
        assert "drive 0.25 m" in second.text
        assert (await call(tools, "stop")).data["stands"]
        assert (await driving).data["ended"] == "stopped"


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


async def test_wrong_arguments_are_refused_with_the_rule():
    async with tools_on() as tools:
        for name, arguments in (
            ("drive", {"distance": math.nan}),
            ("drive", {"distance": True}),
            ("drive", {"distance": 0.1, "speed": 0.2}),
            ("drive", {"distance": 0.1, "robot": "2"}),
            ("turn", {"angle": 10**400}),
            ("turn", {}),
            ("set_leds", {"ring": [1] * 8}),
            ("run_behaviour", {"name": "../avoid"}),
            ("status", {"more": 1}),
        ):
            with pytest.raises(ArgumentError):
                tools.tools[name].check(arguments)
        with pytest.raises(Refused):
            tools.drivers["1"].slot.stop()
            tools.drivers["1"].check_free()


async def test_a_real_robot_needs_leave():
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "elib", "agent", "serial:///dev/nothing-here",
        stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
    )  # fmt: skip
    out, complaint = await process.communicate()
    assert process.returncode == 2
    assert not out
    assert b"--allow-real" in complaint


async def test_http_serves_programs_and_refuses_pages_and_other_names():
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "elib", "agent", "sim://arena", "--http", "--port", "0",
        stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL,
    )  # fmt: skip
    try:
        url = (await asyncio.wait_for(process.stdout.readline(), 60)).decode().strip()
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
        await asyncio.wait_for(process.wait(), 20)
