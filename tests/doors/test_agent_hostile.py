"""Hostile and confused callers of ``elib agent`` are refused; the robot keeps its limits, and the door serves on."""

import asyncio
import contextlib
import http.client
import json
import os
import random
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from agent_wire import INITIALIZE, WITNESSED, Wire, WitnessedWire, memory, wire
from test_agent import call, door_of, tools_on, went, world_of

from elib.doors.agent.limits import Limits
from elib.doors.agent.server import serve_pipes
from shared import PATIENCE

GROWTH = 40 << 20
"""Bytes by which the memory of the door may grow while it is attacked: one message may have a megabyte."""
DEEP = "[" * 5000 + "]" * 5000
SURROGATE = '"\\ud800"'
"""Half a character: a line with it is no JSON text, so no call was made that an answer could belong to."""
HOSTILE = [
    SURROGATE,
    "NaN",
    "Infinity",
    "-Infinity",
    "1e308",
    "-1e308",
    "1e999",
    "1e-320",
    "9" * 400,
    "-9223372036854775809",
    "null",
    "true",
    "{}",
    "[]",
    '"0.1"',
    '""',
    '"\\u0000"',
    '"../../etc/passwd"',
    json.dumps("robot " * 20_000),
    json.dumps("\N{ROBOT FACE}" * 500),
    "[[[[[[[[[[[[1]]]]]]]]]]]]",
    '{"x": {"x": {"x": {}}}}',
    '{"__class__": "os.system"}',
]
"""Values as JSON texts, and what only looks like JSON."""
PARAMETERS = {
    "robots": (),
    "status": ("robot",),
    "read_all": ("robot",),
    "look": ("robot",),
    "drive": ("distance", "speed", "stop_at_obstacle", "robot"),
    "turn": ("angle", "speed", "robot"),
    "go_to": ("x", "y", "speed", "stop_at_obstacle", "robot"),
    "set_leds": ("ring", "body", "front", "robot"),
    "run_behaviour": ("name", "seconds", "parameters", "robot"),
    "stop": ("robot",),
}


def malformed(chance: random.Random) -> bytes:
    """Return a line that is not a message of the protocol, or one that no server has to answer with a result."""
    call = (
        b'{"jsonrpc": "2.0", "id": "m1", "method": "tools/call",'
        b' "params": {"name": "drive", "arguments": {"distance": 0.5}}}'
    )
    match chance.randrange(14):
        case 0:
            return bytes(chance.randrange(256) for _ in range(chance.randrange(1, 300))).replace(b"\n", b" ")
        case 1:
            return call[: chance.randrange(1, len(call))]
        case 2:
            place = chance.randrange(len(call) - 1)
            return b"\xff" + call[:place] + call[place + 1 :]
        case 3:
            return DEEP.encode()
        case 4:
            return call.replace(b'"2.0"', chance.choice([b'"1.0"', b"2.0", b"null", b"[]"]))
        case 5:
            return call.replace(
                b'"tools/call"', chance.choice([b'"tools/evil"', b"7", b"null", b'"' + b"m" * 9999 + b'"'])
            )
        case 6:
            return call.replace(b'"m1"', chance.choice([b"null", b"{}", b"[1]", b"1.5", b"true"])).replace(
                b"0.5", b"1e9"
            )
        case 7:
            return (
                b'{"jsonrpc": "2.0", "id": "m7", "method": "tools/call", "params": '
                + chance.choice(HOSTILE).encode()
                + b"}"
            )
        case 8:
            return b'{"jsonrpc": "2.0", "method": "notifications/cancelled", "params": {"requestId": 999999}}'
        case 9:
            return b"[" + b", ".join([b'{"jsonrpc": "2.0", "id": 1}'] * 5) + b"]"
        case 10:
            return b'{"jsonrpc": "2.0", "id": "m10", "result": ' + chance.choice(HOSTILE).encode() + b"}"
        case 11:
            return b'{"jsonrpc": "2.0", "id": "m11", "method": "initialize", "params": {"protocolVersion": 7}}'
        case 12:
            return b'"' + b"\xf0\x9f\xa4\x96" * 5000 + b'"'
        case _:
            return chance.choice([b"", b" ", b"null", b"0", b"{}", b"[]", b"\xef\xbb\xbf{}", b"GET / HTTP/1.1\r"])


def hostile(chance: random.Random) -> tuple[str, str]:
    """Return a tool and its arguments as text; none of them moves a robot further than a rounding."""
    tool = chance.choice(
        [*PARAMETERS, "drive", "turn", "go_to", "run_behaviour", "os.system", "", "drive ", "d" * 9999]
    )
    names = list(PARAMETERS.get(tool, ("robot",)))
    chance.shuffle(names)
    names = names[: chance.randrange(len(names) + 1)]
    if chance.random() < 0.2 or not names:
        names.append(chance.choice(["evil", "", "__init__", "x" * 5000, "\N{ROBOT FACE}"]))
    if chance.random() < 0.05:
        return tool, chance.choice(HOSTILE)
    return tool, "{" + ", ".join(f"{json.dumps(name)}: {chance.choice(HOSTILE)}" for name in names) + "}"


def send_malformed(door: Wire, count: int) -> int:
    """Send lines that are no messages and change nothing; return the memory on the way of a door that is a process."""
    chance = random.Random("malformed")
    before = door.call("status")
    grown = 0
    for number in range(count):
        door.send(malformed(chance))
        if number % 50 == 0:
            assert door.call("status")["stands"]
        if number == 200:
            grown = memory_of(door)
    door.send(b'{"jsonrpc": "2.0", "id": "' + b"x" * (3 << 20) + b'"}')  # longer than any message may be
    after = door.call("status")
    assert (after["pose"], after["budget"]) == (before["pose"], before["budget"])
    assert door.strange == []
    return grown


def call_hostile(door: Wire, turns: int) -> int:
    """Make calls, twenty at a time, that are refused; return the memory on the way of a door that is a process."""
    chance = random.Random("hostile")
    grown = 0
    for turn in range(turns):
        asked = []
        for _ in range(20):
            tool, arguments = hostile(chance)
            asked.append((door.begin(tool, arguments), tool, arguments))
        for number, tool, arguments in asked:
            if SURROGATE not in arguments:
                answer = door.end(number)
                refused = "error" in answer or answer["result"]["isError"]
                assert len(door.answers[str(number)]) == 1
                assert (
                    refused
                    or tool in ("robots", "status", "read_all", "look", "set_leds", "stop")
                    or (abs(answer["result"]["structuredContent"]["driven"]) < 0.001)
                ), (tool, arguments, answer)
        if turn == 10:
            grown = memory_of(door)
    assert door.call("status")["stands"]
    assert door.strange == []
    return grown


def memory_of(door: Wire) -> int:
    return memory(door.process) if isinstance(door, WitnessedWire) else 0


async def test_malformed_lines_and_hostile_calls_are_refused() -> None:
    async with tools_on("sim://red-boxes", Limits(fence=0.3, speed=0.1, calls=5000, seconds=600.0)) as tools:
        (source, theirs), (ours, target) = os.pipe(), os.pipe()
        serving = asyncio.create_task(serve_pipes(door_of(tools), source, target))

        def attack() -> None:
            with open(ours, "rb") as reading, open(theirs, "wb") as writing:
                door = Wire(reading, writing)
                door.greet()
                send_malformed(door, 100)
                call_hostile(door, 5)
                writing.close()
                door.reader.join()

        attacking = asyncio.create_task(asyncio.to_thread(attack))
        await serving
        os.close(target)
        await attacking
        start = world_of(tools).pose(0)
        assert (await call(tools, "drive", distance=0.02)).data["ended"] == "reached"
        assert went(tools, start) > 0.015


@pytest.mark.long
def test_a_thousand_malformed_lines_change_nothing(tmp_path: Path) -> None:
    with wire(tmp_path, "sim://red-boxes") as door:
        grown = send_malformed(door, 1000)
        assert memory(door.process) - grown < GROWTH
        assert door.call("drive", distance=0.02)["ended"] == "reached"
        said = door.close()
    assert not said["unconfirmed"]


@pytest.mark.long
def test_a_thousand_hostile_calls_are_refused(tmp_path: Path) -> None:
    with wire(tmp_path, "sim://red-boxes", "--calls", "5000", "--log", str(tmp_path / "log.jsonl")) as door:
        grown = call_hostile(door, 50)
        assert memory(door.process) - grown < GROWTH
        assert door.call("drive", distance=0.02)["ended"] == "reached"
        door.close()
    lines = (tmp_path / "log.jsonl").read_text(encoding="utf-8").splitlines()
    assert len(lines) > 800
    for line in lines:
        json.loads(line, parse_constant=pytest.fail)  # NaN and Infinity are no JSON


@pytest.mark.long
def test_hostile_requests_over_http_are_refused(tmp_path: Path) -> None:
    chance = random.Random("http")
    command = [sys.executable, WITNESSED, str(tmp_path / "w.json"), "agent", "sim://red-boxes", "--http", "--port", "0"]
    door = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    headers = {"Content-Type": "application/json", "Accept": "application/json, text/event-stream"}

    def post(body: bytes, **more: str) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection(page.hostname, page.port, timeout=PATIENCE)
        with contextlib.closing(connection):
            connection.request("POST", page.path, body, headers | more)
            answer = connection.getresponse()
            if "mcp-session-id" in answer.headers:
                headers["Mcp-Session-Id"] = answer.headers["mcp-session-id"]
            return answer.status, answer.read()

    def call(tool: str, arguments: str, **more: str) -> tuple[int, bytes]:
        params = f'{{"name": {json.dumps(tool)}, "arguments": {arguments}}}'
        return post(f'{{"jsonrpc": "2.0", "id": 5, "method": "tools/call", "params": {params}}}'.encode(), **more)

    try:
        page = urlsplit(door.stdout.readline().strip())
        hello = {"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": INITIALIZE}
        assert post(json.dumps(hello).encode())[0] == 200
        post(b'{"jsonrpc": "2.0", "method": "notifications/initialized"}')
        assert call("drive", '{"distance": 0.5}', Origin="https://evil.example")[0] == 403
        assert call("drive", '{"distance": 0.5}', Host="evil.example")[0] in (403, 421)
        assert post(b"x" * (3 << 20))[0] == 413
        for _ in range(100):
            status, _ = post(malformed(chance))
            assert status < 500
        for _ in range(100):
            status, _ = call(*hostile(chance))
            assert status < 500
        status, body = call("status", "{}")
        assert status == 200
        found = json.loads(next(line[6:] for line in body.splitlines() if line.startswith(b"data: {")))
        state = found["result"]["structuredContent"]
        assert state["stands"]
        assert abs(state["pose"]["x"]) + abs(state["pose"]["y"]) < 0.01
    finally:
        door.terminate()
        door.wait(PATIENCE)
        door.stdout.close()
