"""The honesty suite over a robot that comes back: with cuts, pulled batteries and bad answers."""

import asyncio
import os

from honest_rig import Call, HonestRig, NumberedHardware
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_honesty import calls, play, text_faults, text_rows

from elib.base.errors import LinkNotFound
from elib.link.protocol.profiles import PROFILES
from elib.link.session import Session
from elib.link.transport.memory import MemoryTransport, memory_pair
from elib.robot.reconnect import Policy, Reconnector
from elib.simulator.emulator.emulator import Emulator
from elib.simulator.emulator.faults import Fault
from elib.simulator.emulator.link import Link
from elib.testing import simulated

SCHEDULES = int(os.environ.get("ELIB_SCHEDULES", "100"))
breaks = st.lists(
    st.tuples(st.sampled_from([0.01, 0.02, 0.05, 0.3, 1.0, 2.0]), st.sampled_from(["cut", "clear", "battery"])),
    max_size=6,
)
"""What happens to the link: a pause, s, and the event after it."""


@settings(max_examples=SCHEDULES, deadline=None, derandomize=SCHEDULES <= 1000, suppress_health_check=list(HealthCheck))
@given(
    st.sampled_from(sorted(PROFILES)),
    st.lists(text_faults, max_size=6),
    st.lists(calls(text_rows), min_size=1, max_size=8),
    breaks,
    st.sampled_from(["wait", "fail"]),
)
@simulated
async def test_a_link_that_breaks_and_comes_back_gives_the_right_value_or_an_error(
    firmware: str, faults: list[Fault], script: list[Call], plan: list[tuple[float, str]], during_gap: str
) -> None:
    loop = asyncio.get_running_loop()
    hardware = NumberedHardware(firmware)
    robot = Emulator(firmware, hardware, booted=True)
    link = Link(robot, latency=0.005, origin=0.0)
    is_clear = True
    far: MemoryTransport | None = None

    async def start() -> Session:
        nonlocal far
        if not is_clear:
            raise LinkNotFound("out of range")
        near, far = memory_pair()
        link.attach(far)
        return await Session.open(near)

    async def break_link() -> None:
        nonlocal is_clear
        for pause, what in plan:
            await asyncio.sleep(pause)
            if what == "cut" and far is not None:
                is_clear = False
                link.detach()
                far.abort()
            elif what == "battery":
                robot.power_cycle(loop.time())
                link.catch_up()
            else:
                is_clear = True
        is_clear = True

    policy = Policy(during_gap=during_gap, give_up_after=20.0)  # type: ignore[arg-type]
    channel = await Reconnector("test://air", start, policy).open()
    link.faults.extend(faults)
    rig = HonestRig(channel, hardware, link, 0.0)
    breaking = asyncio.ensure_future(break_link())
    try:
        await play(rig, script)
    finally:
        breaking.cancel()
        await asyncio.gather(breaking, return_exceptions=True)
        await channel.close()
        link.close()
    assert len(asyncio.all_tasks()) == 1, asyncio.all_tasks()
