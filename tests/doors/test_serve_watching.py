"""What ``elib serve`` tells programs: readings, events, recordings, and whether all of it follows the schema."""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
from pathlib import Path
from urllib.parse import urlsplit

import jsonschema
import pytest
from local_network import LocalLoop
from recordings import recorded
from serve_rig import Program, Rig, serving

from elib.base.errors import LinkLost
from elib.doors.serve.schema import schema
from elib.panel.server.conversation import MAX_UNREAD
from shared import PATIENCE, needs_page, until

pytestmark = needs_page

# clock: simulated
LOOP = LocalLoop
FAST = "sim://square?baud=0"
BAD = """
description = "Answers that are lost, late, doubled and mangled"

[[fault]]
kind = "loss"
probability = 0.05

[[fault]]
kind = "delay"
delay = 0.02
probability = 0.2

[[fault]]
kind = "duplicate"
probability = 0.1

[[fault]]
kind = "corrupt"
probability = 0.02
"""
FIRMWARES = ("btcom-1.1.3", "asercom-1.2.2", "btcom-2.0", "epuck2", "epuck2-wifi")


def deaf(rig: Rig) -> contextlib.AbstractAsyncContextManager[Program]:
    """Connect a program that keeps very little of what it has not read."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, LocalLoop)
    return rig.program(sock=loop.connected(urlsplit(rig.url).port or 0), max_queue=1)


async def test_a_program_that_does_not_read_misses_old_readings_and_holds_nobody_up() -> None:
    async with serving(FAST) as rig, deaf(rig) as slow, rig.program() as quick:
        for readings in ([], ["image", "proximity"], ["proximity"], ["encoders"], ["ambient_light"]):
            await slow.ask("watch", readings=readings, rate=50)
        await quick.ask("watch", rate=50)
        while not (behind := [each for each in rig.door._callers.open.values() if each.is_behind]):
            await quick.hear()  # until the system takes no more for the slow program
        (client,) = behind
        waiting = client.unread
        quick.told.clear()
        for _ in range(50):
            await quick.until_told("readings")
            assert quick.told.pop()["missed"] == 0
            quick.told.clear()
        assert client.unread <= waiting, "no further message is kept for it"
        newest = await quick.until_told("readings")

        def is_same_watch(message: dict) -> bool:
            return message["readings"].keys() == newest["readings"].keys()

        caught_up = await slow.until_told(
            "readings", lambda message: is_same_watch(message) and message["time"] >= newest["time"]
        )
        assert caught_up["missed"] >= 50
        times = [message["time"] for message in slow.told if is_same_watch(message)]
        assert times == sorted(set(times))
        assert await slow.ask("hello")
        slow.socket.transport.abort()


async def test_a_driver_that_asks_on_and_on_without_reading_is_left_and_its_robot_stands() -> None:
    async with serving(FAST) as rig, deaf(rig) as program:
        await program.ask("set_speed", left=0.5, right=0.5)
        await rig.until_it_moves()
        (client,) = rig.door._callers.open.values()
        most, number = 0, 1000
        async with asyncio.timeout(PATIENCE):
            while rig.slot().drive.driver:
                number += 1
                await program.say("sensors", id=number)
                await asyncio.sleep(0.002)
                most = max(most, client.unread)
        await rig.until_it_stands()
        assert MAX_UNREAD < most < 2 * MAX_UNREAD
        program.socket.transport.abort()
        await until(lambda: not rig.door._callers.open)


async def test_events_come_in_their_order_while_they_are_wanted() -> None:
    async with serving() as rig, rig.program() as program:
        await program.ask("events")
        for number in range(8):
            await program.ask("set_led", n=number, action="on")
        await program.until_told("event", lambda event: event["text"].startswith("set_led(7"))
        events = [message for message in program.told if message["type"] == "event"]
        calls = [event["text"] for event in events if event["text"].startswith("set_led")]
        assert calls == [f"set_led({number}, 'on'): ok" for number in range(8)]
        assert all(event["missed"] == 0 and not event["is_bad"] and event["robot"] == "1" for event in events)
        times = [event["time"] for event in events]
        assert times == sorted(times)
        await program.ask("events", on=False)
        program.told.clear()
        await program.ask("set_led", n=1, action="off")
        await asyncio.sleep(0.3)
        await program.ask("hello")
        assert program.told == []


async def test_a_recording_is_watched_and_takes_no_commands(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"

    async def drive(robot, recorder) -> None:  # type: ignore[no-untyped-def]
        await robot.set_speed(0.2, 0.2)
        for _ in range(20):
            await robot.encoders()
            await robot.sleep(0.1)

    recorded(path, drive)
    async with serving(f"replay://{path}") as rig, rig.program() as program:
        assert (await program.ask("hello"))["robots"][0]["state"] == "playing"
        await program.ask("watch", readings=["encoders"], rate=20)
        far = await program.until_told("readings", lambda message: message["readings"]["encoders"]["left"] > 100)
        assert far["readings"]["encoders"]["right"] == pytest.approx(far["readings"]["encoders"]["left"], abs=2)
        for do, values in {"set_speed": {"left": 0.1, "right": 0.1}, "proximity": {}, "drive": {}}.items():
            assert (await program.refused(do, **values))["kind"] == "LinkClosed"


async def test_on_a_bad_link_every_request_has_one_answer_and_a_cut_is_told(tmp_path: Path) -> None:
    script = tmp_path / "bad.toml"
    script.write_text(BAD, encoding="utf-8")
    drawn = random.Random("bad link")
    names = ("proximity", "selector", "encoders", "microphones", "version")
    door = serving(f"{FAST}&fault={script}")
    rig = await door.__aenter__()
    async with rig.program() as program:
        beats = asyncio.create_task(program.drive_on())
        await program.whole("set_speed", left=0.3, right=0.3)
        kinds: set[str] = set()
        for _ in range(40):
            for number in range(1000, 1005):
                await program.say(drawn.choice(names), id=number)
            for answer in await program.answers(5):
                assert answer["ok"] or answer["error"]["message"]
                kinds.add("" if answer["ok"] else answer["error"]["kind"])
        assert {"", "ReplyTimeout"} <= kinds
        rig.slot().control.cut(0)
        lost = await program.until_told("error", lambda message: message["error"]["kind"].startswith("Link"))
        assert lost["robot"] == "1"
        assert (await program.refused("proximity"))["kind"].startswith("Link")
        beats.cancel()
    with pytest.raises(LinkLost, match="did not confirm that it stands"):
        await door.__aexit__(None, None, None)


async def test_the_wheels_of_each_firmware_stand_when_its_driver_falls_silent() -> None:
    async with serving(*(f"sim://square?firmware={each}" for each in FIRMWARES)) as rig, rig.program() as program:
        keys = [robot["robot"] for robot in (await program.ask("hello"))["robots"]]
        assert [rig.slot(key).firmware for key in keys] == list(FIRMWARES)
        beats = asyncio.create_task(program.drive_on())
        for key in keys:
            await program.ask("set_speed", robot=key, left=0.5, right=0.4)
            await program.ask("watch", robot=key, rate=10)
        for key in keys:
            await rig.until_it_moves(key)
            message = await program.until_told("readings", lambda message, key=key: message["robot"] == key)
            assert {"proximity", "encoders"} <= message["readings"].keys()
        beats.cancel()
        for key in keys:
            await rig.until_it_stands(key)


SCHEMA = schema()
VALIDATOR = jsonschema.Draft202012Validator
VALIDATORS = {name: VALIDATOR(SCHEMA | {"$ref": f"#/$defs/{name}"}) for name in ("ClientMessage", "ServerMessage")}
SAID: list[tuple[str, dict]] = [
    ("hello", {"name": "test"}),
    ("beat", {}),
    ("events", {}),
    ("watch", {"readings": [], "rate": 20}),
    ("drive", {}),
    ("set_speed", {"left": 0.2, "right": 0.2}),
    ("set_led", {"n": 1, "action": "on"}),
    ("stop", {}),
    ("unwatch", {}),
    ("leave", {}),
]


@pytest.mark.parametrize("firmware", FIRMWARES)
async def test_everything_that_is_said_follows_the_schema(firmware: str) -> None:
    results = {
        part["properties"]["do"]["enum"][0]: part["x-result"] for part in SCHEMA["$defs"].values() if "x-result" in part
    }
    commands = [name for name, result in results.items() if "$ref" in result and name != "hello"]
    async with serving(f"{FAST}&firmware={firmware}") as rig, rig.program() as program:
        answered = 0
        for do, values in SAID + [(name, {}) for name in commands]:
            if do == "unwatch":
                await program.until_told("readings")
            message = {"do": do, "id": 1} | values
            VALIDATORS["ClientMessage"].validate(message)
            answer = await program.whole(do, **values)
            VALIDATORS["ServerMessage"].validate(answer)
            if answer["ok"]:
                answered += 1
                VALIDATOR({"$defs": SCHEMA["$defs"]} | results[do]).validate(answer["result"])
            else:
                assert answer["error"]["kind"] in ("Unsupported", "ArgumentError"), answer
        assert answered > 20
        await program.until_told("event")
        for message in program.told:
            VALIDATORS["ServerMessage"].validate(message)
        wrong = json.loads('{"do": "fly"}')
        with pytest.raises(jsonschema.ValidationError):
            VALIDATORS["ClientMessage"].validate(wrong)
        await program.say(**wrong)
        VALIDATORS["ServerMessage"].validate(await program.until_told("error"))


def test_the_schema_names_nothing_that_only_readers_of_python_know() -> None:
    assert ":`" not in json.dumps(SCHEMA), "a reference of a docstring"
