"""Who may use the door for programs, and what it does with what nobody should send."""

from __future__ import annotations

import asyncio
import json
import random
import tracemalloc

import pytest
from local_network import LocalLoop
from serve_rig import Rig, serving
from websockets.exceptions import ConnectionClosed, InvalidStatus

from elib.base.errors import ArgumentError
from elib.doors.serve import door as doors
from elib.doors.serve.door import ProgramDoor
from elib.doors.serve.messages import NAMES
from lanes import short
from shared import PATIENCE, needs_page, now, until

pytestmark = needs_page

# clock: simulated
LOOP = LocalLoop
GROWTH = 4_000_000
"""Bytes by which the memory may grow while strangers attack: what the door keeps does not depend on their number."""


async def status(rig: Rig, path: str = "", **options: object) -> int:
    """Return the status with which a WebSocket is refused."""
    changed = Rig(rig.panel, rig.door, rig.url + path)
    with pytest.raises(InvalidStatus) as caught:
        async with changed.program(**options):
            pass
    return caught.value.response.status_code


async def thrown_out(rig: Rig, *said: str | bytes) -> str:
    """Say something and return the reason with which the connection is closed."""
    async with rig.program() as program:
        with pytest.raises(ConnectionClosed) as caught:
            async with asyncio.timeout(PATIENCE):
                for each in said:
                    await program.socket.send(each)
                while True:
                    await program.socket.recv()
    return caught.value.rcvd.reason if caught.value.rcvd else ""


# -- who --


async def test_pages_of_other_sites_are_refused_unless_they_are_allowed() -> None:
    async with serving(origins=["http://localhost:3000", "null"]) as rig:
        own = rig.url.replace("ws:", "http:").removesuffix("/v1")
        assert await status(rig, origin="http://evil.example") == 403
        assert await status(rig, origin="https://localhost:3000") == 403
        assert await status(rig, additional_headers=[("Origin", own), ("Origin", "http://evil.example")]) == 403
        for origin in (None, own, "http://localhost:3000", "null"):
            async with rig.program(origin=origin) as program:
                assert (await program.ask("hello"))["protocol"] == 1
    async with serving() as rig:
        assert await status(rig, origin="null") == 403


@pytest.mark.parametrize("origin", ["localhost:3000", "http://localhost/page", "*", ""])
def test_what_is_not_an_origin_cannot_be_allowed(origin: str) -> None:
    with pytest.raises(ArgumentError, match="not the origin"):
        ProgramDoor([origin])


async def test_with_a_token_hello_comes_first_and_shows_it() -> None:
    async with serving(token="secret-token") as rig:
        async with rig.program() as program:
            assert (await program.ask("hello", token="secret-token"))["robots"][0]["robot"] == "1"
            assert await program.ask("proximity")
        assert await thrown_out(rig, '{"do": "proximity", "id": 1}') == "say hello first, with the token"
        assert await thrown_out(rig, "nothing") == "say hello first, with the token"
        assert await thrown_out(rig, '{"do": "hello", "id": 1, "token": "wrong"}') == "this is not the token"
        assert await thrown_out(rig, '{"do": "stop"}') == "say hello first, with the token"
        assert await status(rig, "?token=secret-token") == 400
        for _ in range(5):
            await thrown_out(rig, '{"do": "hello", "id": 1, "token": "guess"}')
        async with rig.program() as program:  # too many guesses: not even the right one is heard now
            assert "too many wrong tokens" in (await program.refused("hello", token="secret-token"))["message"]


async def test_a_stranger_that_says_nothing_is_not_waited_for() -> None:
    async with serving(token="secret-token") as rig:
        began = now()
        assert await thrown_out(rig) == "no token came"
        assert now() - began == pytest.approx(doors.HELLO_TIME, abs=0.1)


async def test_connections_messages_and_their_length_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doors, "MAX_PROGRAMS", 2)
    async with serving() as rig:
        async with rig.program(), rig.program():
            assert await status(rig) == 503
        await until(lambda: not rig.door._callers.open)
        assert await thrown_out(rig, b"binary") == "only text is understood"
        await thrown_out(rig, json.dumps({"do": "hello", "name": "x" * 9000}))
        assert await thrown_out(rig, *['{"do":"beat"}'] * 2500) == "too many messages"
        async with rig.program() as program:
            assert await program.ask("hello")


# -- what --


def malformed(draw: random.Random) -> str:
    """Draw what is not a message: cut, mangled or wrong in its fields."""
    text = json.dumps(
        {
            "do": draw.choice([*NAMES, "fly", "", "__init__", "DROP TABLE"]),
            draw.choice(["id", "robot", "left", "x" * draw.randrange(1, 40), "n"]): draw.choice(
                [None, -1, 1e300, 1 << 80, "x", [], {}, [[[]]], True, "\u0000"]
            ),
            "extra": draw.random(),
        }
    )
    kind = draw.randrange(4)
    if kind == 0:
        return text[: draw.randrange(len(text))]
    if kind == 1:
        place = draw.randrange(len(text))
        return text[:place] + chr(draw.choice([0, 34, 92, 123, 0x2028, 0xFFFD, 0x1F600])) + text[place:]
    if kind == 2:
        return draw.choice(["[" * 1500, '{"do":' * 250, "null", "[]", "1e999", '{"id": 1, "id": 2}', "", "NaN"])
    return text


HOSTILE = [
    {"do": "set_speed", "left": 1e308, "right": -1e308},
    {"do": "set_speed", "left": 2, "right": 2},
    {"do": "set_speed", "left": True, "right": 1},
    {"do": "set_speed", "robot": "1; stop", "left": 1, "right": 1},
    {"do": "set_speed", "robot": "../../1", "left": 1, "right": 1},
    {"do": "set_led", "n": 1 << 70, "action": "on"},
    {"do": "set_led", "n": 1, "action": "x" * 400},
    {"do": "set_camera", "width": 640, "height": 640, "zoom": 1, "mode": "yuv"},
    {"do": "i2c_write", "device": -1, "register": 0, "value": 0},
    {"do": "text", "command": "D,1000,1000\rD,1000,1000"},
    {"do": "text", "command": "\x00\x01\x02"},
    {"do": "text", "command": ""},
    {"do": "watch", "readings": ["__class__"]},
    {"do": "watch", "readings": ["proximity"] * 18, "rate": 1e9},
    {"do": "watch", "readings": ["distance"]},
    {"do": "hello", "name": "\x1b[2J"},
    {"do": "drive", "robot": "2", "force": True},
    {"do": "leave", "robot": "constructor"},
    {"do": "stop", "robot": "2"},
    {"do": "unwatch", "robot": "\u202e"},
]
"""Whole messages that ask for what must not be done."""


@pytest.mark.parametrize("count", short([200, 1000], 200))
@pytest.mark.parametrize("kind", ["malformed", "hostile"])
async def test_however_many_such_messages_are_refused_and_leave_no_trace(kind: str, count: int) -> None:
    draw = random.Random(f"elib serve, {kind}")
    async with serving() as rig:

        async def attack(messages: int) -> None:
            async with rig.program() as program:
                for number in range(1, messages + 1):
                    if kind == "malformed":
                        await program.socket.send(malformed(draw))
                        message = json.loads(await program.socket.recv())
                    else:
                        await program.socket.send(json.dumps(draw.choice(HOSTILE) | {"id": number}))
                        message = json.loads(await program.socket.recv())
                        assert message["id"] == number
                    assert message.get("error"), message

        await attack(50)
        tracemalloc.start()
        try:
            before = tracemalloc.get_traced_memory()[0]
            await attack(count)
            assert tracemalloc.get_traced_memory()[0] - before < GROWTH
        finally:
            tracemalloc.stop()
        assert rig.wheels() == (0, 0)
        assert rig.slot().drive.driver == ""
        async with rig.program() as program:
            assert len(await program.ask("proximity")) == 9


async def test_a_robot_without_a_device_answers_unsupported_on_each_firmware() -> None:
    firmwares = ("btcom-1.1.3", "asercom-1.2.2", "btcom-2.0", "epuck2")
    async with serving(*(f"sim://?firmware={each}" for each in firmwares)) as rig, rig.program() as program:
        robots = (await program.ask("hello"))["robots"]
        for robot in robots:
            for name in ("distance", "gyroscope", "sd_card", "attitude", "battery"):
                answer = await program.whole(name, robot=robot["robot"])
                is_absent = name in rig.slot(robot["robot"]).context.profile.absent
                assert answer["ok"] == (not is_absent), (robot["firmware"], answer)
                assert answer["ok"] or answer["error"]["kind"] == "Unsupported"


async def test_a_program_that_asks_for_a_whole_motion_is_told_what_to_do_instead() -> None:
    async with serving() as rig, rig.program() as program:
        for do in ("go", "turn", "go_to"):
            assert "a loop of set_speed and encoders" in (await program.refused(do))["hint"]
