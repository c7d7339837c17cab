"""``elib foxglove``: what its clients see, and how they drive."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

pytest.importorskip("foxglove", reason="the extra foxglove is not installed: pip install '.[foxglove]'")
sys.path.insert(0, str(Path(__file__).parents[1] / "cli"))
sys.path.insert(0, str(Path(__file__).parents[1] / "recording"))
from foxglove_client import connected_to, until
from recordings import complaints, read

from elib.doors.foxglove.door import opened
from elib.doors.robots import connected
from elib.web.listening import listen
from elib.web.panel import Panel
from elib.web.slot import Slot
from elib.web.watching import virtual

pytestmark = pytest.mark.slow
CLIENT = Path(__file__).parent / "foxglove_client.py"
STAND = 0.5
"""s after the end of a client within which its robot must stand."""


@contextlib.asynccontextmanager
async def door(*urls: str, **options: object) -> AsyncIterator[tuple[Panel, str]]:
    """Serve robots and yield the panel and the address."""
    async with connected(urls or ("sim://square",)) as panel:
        address = listen(port=0)
        async with opened(panel, address, **options):  # type: ignore[arg-type]
            yield panel, f"ws://127.0.0.1:{address.port}/{options.get('token') or ''}"


def wheels(slot: Slot) -> tuple[float, float]:
    """Return how fast the wheels of a virtual robot turn now."""
    transport = virtual(slot.robot)
    assert transport is not None
    left, right = transport.robot.emulator.firmware.motors
    return left.speed, right.speed


def standing(slot: Slot) -> bool:
    return wheels(slot) == (0, 0)


async def stands_after(slot: Slot) -> float:
    """Return how long it takes from now until the robot stands, s."""
    loop = asyncio.get_running_loop()
    began = loop.time()
    await until(lambda: standing(slot))
    return loop.time() - began


async def test_live_topics_have_the_names_and_schemas_of_a_recording(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    async with door() as (panel, url), connected_to(url) as client:
        panel.slots["1"].start_recorder(str(path))
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


async def test_a_client_drives_with_wheels_or_a_twist_and_silence_stops_the_robot() -> None:
    async with door() as (panel, url), connected_to(url) as client:
        slot = panel.slots["1"]
        number = await client.advertise("/drive")
        await client.publish(number, {"left": 0.02, "right": 0.04})
        await until(lambda: wheels(slot) == (155, 311))
        assert slot.drive.driver
        assert await stands_after(slot) < STAND
        await client.publish(number, {"linear": {"x": 0.03, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}})
        await until(lambda: wheels(slot) == (233, 233))
        await client.publish(number, {"linear": 0.0, "angular": 1.0})
        await until(lambda: wheels(slot) == (-206, 206))
        await client.publish(number, {"linear": 5.0, "angular": 0.0})
        await until(lambda: wheels(slot) == (500, 500))  # the speed limit
        await client.publish(number, {"left": 0, "right": 0})
        assert await stands_after(slot) < STAND


async def test_a_topic_that_is_left_and_a_connection_that_ends_stop_the_robot_at_once() -> None:
    async with door() as (panel, url), connected_to(url) as client:
        slot = panel.slots["1"]
        number = await client.advertise("/drive")
        await client.publish(number, {"left": 0.03, "right": 0.03})
        await until(lambda: not standing(slot))
        await client.say("unadvertise", channelIds=[number])
        await until(lambda: not slot.drive.driver)
        assert await stands_after(slot) < STAND
        async with connected_to(url) as other:
            number = await other.advertise("/drive")
            await other.publish(number, {"left": 0.03, "right": 0.03})
            await until(lambda: not standing(slot))
        await until(lambda: not slot.drive.driver)
        assert await stands_after(slot) < STAND


async def test_a_client_that_is_killed_while_it_drives_leaves_a_robot_that_stands() -> None:
    async with door() as (panel, url):
        slot = panel.slots["1"]
        process = await asyncio.create_subprocess_exec(
            sys.executable, str(CLIENT), url, "/drive", stdout=asyncio.subprocess.DEVNULL
        )
        try:
            await until(lambda: not standing(slot))
            process.kill()
            took = await stands_after(slot)
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
        assert took < STAND
