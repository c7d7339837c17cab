"""The honesty suite, smaller, over a real pty: real bytes through the kernel, time ten times as fast."""

import asyncio
import random
import sys

import pytest
from honest_rig import honest_rig

from elib.base.errors import LinkLost
from elib.base.timebase import ScaledLoop
from elib.link.protocol.profiles import PROFILES
from elib.simulator.emulator.faults import Fault
from lanes import short
from shared import PATIENCE

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no ptys")

FAULTS = [
    Fault(),
    Fault(),
    Fault(lose=True),
    Fault(delay=0.3),
    Fault(delay=0.8),
    Fault(halve=True),
    Fault(halve=True, delay=0.2),
    Fault(copy_after=0.0),
    Fault(corrupt=3),
]
ROWS = ["ambient_light", "ambient_light", "set_speed", "set_body_led", "speed", "encoders", "image", "attitude"]


@pytest.mark.parametrize("seed", short(range(16), *range(4)))
def test_bad_answers_over_a_pty_give_the_right_value_or_an_error(seed: int) -> None:
    draw = random.Random(seed)
    firmware = sorted(PROFILES)[seed % 4]
    faults = [draw.choice(FAULTS) for _ in range(6)]
    # A byte turned over in a picture or a binary answer leaves it well-shaped: no client can see that.
    rows = ROWS[:6] if any(fault.corrupt is not None for fault in faults) else ROWS

    async def story() -> None:
        async with honest_rig(firmware, faults=faults, pty=True) as rig:
            running = []
            for _ in range(6):
                name = draw.choice(rows)
                args = (
                    (round(draw.random(), 3), -round(draw.random(), 3))
                    if name == "set_speed"
                    else (1,)
                    if name == "set_body_led"
                    else ()
                )
                call = asyncio.ensure_future(rig.call(name, *args, within=draw.choice([0.1, 0.4, 2.0])))
                running.append(call)
                if draw.random() < 0.6:
                    await call
            await asyncio.gather(*running)
            assert len(rig.outcomes) == 6
            for outcome in rig.outcomes:
                rig.check(outcome, punctual=False)

    with asyncio.Runner(loop_factory=lambda: ScaledLoop(10)) as runner:
        runner.run(story())


@pytest.mark.parametrize("at", [0, 1, 7])
def test_a_pty_that_vanishes_ends_every_call(at: int) -> None:
    async def story() -> None:
        async with honest_rig("btcom-2.0", pty=True) as rig:
            rig.link.cut_after(to_robot=at)
            outcomes = await asyncio.gather(*(rig.call("ambient_light", within=10 * PATIENCE) for _ in range(4)))
            assert isinstance(outcomes[-1].error, LinkLost)
            for outcome in outcomes:
                rig.check(outcome, punctual=False)

    with asyncio.Runner(loop_factory=lambda: ScaledLoop(10)) as runner:
        runner.run(story())
