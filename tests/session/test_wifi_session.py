"""A session over Wi-Fi: how a link is opened, what stands on the wire, and what statistics say."""

import asyncio

import pytest

from elib.base.errors import LinkLost, ReplyTimeout
from elib.link.protocol.commands import SPECS
from elib.link.protocol.image import Image
from elib.link.protocol.values import Steps
from elib.link.session import Received, Resynced, Wrote
from shared import inside
from wifi_robot import WifiRig, wifi_rig


async def call(rig: WifiRig, name: str, *args: object, within: float = 1.0) -> object:
    return await rig.session.execute(SPECS[name].request(rig.session.context, *args), within)


@inside(wifi_rig)
async def test_opening_stops_the_robot_and_streams_its_sensors(rig: WifiRig) -> None:
    assert rig.session.profile.name == "epuck2-wifi"
    assert rig.session.version.firmware == "epuck2-wifi"
    first, second = rig.robot.adopted
    assert (first[:2], second[:2]) == (b"\x80\x00", b"\x80\x02")
    assert first[2:] == second[2:] == bytes(19)
    wrote = [event.data for _, event in rig.session.opening if isinstance(event, Wrote)]
    assert wrote == [first + second]


@inside(wifi_rig)
async def test_every_call_is_confirmed_by_the_robot(rig: WifiRig) -> None:
    await call(rig, "set_speed", 0.5, -0.25)
    assert rig.robot.speed == (500, -250)
    assert isinstance(await call(rig, "image", within=2), Image)
    await call(rig, "stop")
    assert rig.robot.speed == (0, 0)
    await call(rig, "set_encoders", 100, -100)
    assert await call(rig, "encoders") == Steps(100, -100)


@inside(wifi_rig)
async def test_a_single_picture_is_cleared_by_a_command_that_nobody_waits_for(rig: WifiRig) -> None:
    events: list[object] = []
    rig.session.hooks.append(lambda time, event: events.append(event))
    await call(rig, "image", within=2)
    await asyncio.sleep(1)
    taken = rig.robot.picture_cycles
    await asyncio.sleep(1)
    assert rig.robot.picture_cycles == taken <= 2
    assert [event.data[22] for event in events if isinstance(event, Wrote)] == [3, 2]
    await call(rig, "ambient_light")
    assert rig.session.counter.resyncs == 0
    assert not any(isinstance(event, Resynced) for event in events)


@inside(wifi_rig)
async def test_a_call_given_up_counts_as_lost_and_the_next_one_waits_for_its_marker(rig: WifiRig) -> None:
    resyncs: list[object] = []
    rig.session.hooks.append(lambda time, event: resyncs.append(event) if isinstance(event, Resynced) else None)
    rig.robot.is_frozen = True
    with pytest.raises(ReplyTimeout):
        await call(rig, "ambient_light", within=0.1)
    asyncio.get_running_loop().call_later(0.5, setattr, rig.robot, "is_frozen", False)
    await call(rig, "ambient_light", within=2)
    statistics = rig.session.counter.read(asyncio.get_running_loop().time())
    assert (statistics.lost, statistics.resyncs) == (1, 1)
    (resync,) = resyncs
    assert isinstance(resync, Resynced)
    assert resync.dropped == 0, "the stream goes on, and its packets are right"


@inside(wifi_rig)
async def test_a_robot_that_streams_but_takes_no_command_is_lost_with_that_reason(rig: WifiRig) -> None:
    rig.robot.is_frozen = True
    with pytest.raises(ReplyTimeout):
        await call(rig, "ambient_light", within=0.1)
    with pytest.raises(LinkLost, match="sends packets but takes no command"):
        await call(rig, "ambient_light", within=10)


@inside(wifi_rig, latency=0.01)
async def test_a_program_that_waits_reads_on_and_falls_behind_by_nothing(rig: WifiRig) -> None:
    received: list[int] = []
    rig.session.hooks.append(
        lambda time, event: received.append(len(event.data)) if isinstance(event, Received) else None
    )
    await asyncio.sleep(10)
    assert sum(received) == pytest.approx(10 / 0.02 * 105, rel=0.01)
    assert rig.air.in_flight <= 105
