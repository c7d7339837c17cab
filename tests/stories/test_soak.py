"""A long run with link faults: every call is accounted for, memory does not grow, and nothing is left over.

Its long form takes ten simulated minutes; ELIB_SOAK=3600 makes it an hour.
"""

import asyncio
import gc
import os
import sys
import threading
from collections import Counter

import pytest

import elib
from elib.link.session import Called, Ended, TraceEvent, Wrote
from elib.simulator.emulator.faultplayer import Counts
from elib.testing import faults_of, with_faults
from lanes import short

DURATION = float(os.environ.get("ELIB_SOAK", "600"))
"""s of robot time."""
PERIOD = 0.2
"""s between two rounds of calls: 5 Hz."""
GROWTH = 1500
"""Blocks of memory that the interpreter may hold more at the end than after the warm-up; it holds some 200,000 in all.
One kept for each call would be 3,500 in ten minutes."""


class Bookkeeper:
    """A trace hook that knows how often each call ended, and which bytes were the probes of resyncs."""

    def __init__(self) -> None:
        self.called = self.ended = self.questions = 0

    def __call__(self, time: float, event: TraceEvent) -> None:
        match event:
            case Called():
                self.called += 1
                assert self.called == self.ended + 1, f"{event.request} began before the last call had ended"
            case Ended():
                self.ended += 1
                assert self.called == self.ended, f"{event.request} ended without having begun, or twice"
            case Wrote(data=data) if data.startswith(b"\0"):
                self.questions += 1


def blocks() -> int:
    gc.collect()
    return sys.getallocatedblocks()


@pytest.mark.parametrize("duration", short([100.0, DURATION], 100.0))
def test_a_long_time_of_flaky_bluetooth_is_accounted_for_to_the_last_answer(duration: float) -> None:
    warm_up = duration / 5  # then everything that fills up, like the window of round trips, is full
    threads = set(threading.enumerate())
    ends: Counter[str] = Counter()
    sizes: list[int] = []
    books = Bookkeeper()
    weathers: list[Counts] = []

    async def program(robot: elib.Epuck) -> elib.LinkStats:
        robot.trace(books)
        turn = 0
        while robot.time < duration:
            turn += 1
            for call in (robot.encoders(), robot.set_speed(0.2, 0.1 + 0.001 * (turn % 100))):
                try:
                    await call
                    ends["value"] += 1
                except elib.ReplyTimeout:
                    ends["timeout"] += 1
            if not sizes and robot.time > warm_up:
                sizes.append(blocks())
            await robot.sleep(PERIOD)
        sizes.append(blocks())
        weathers.append(faults_of(robot).counts)
        assert asyncio.all_tasks() == {asyncio.current_task()}, "the session keeps no task between calls"
        return robot.statistics

    statistics = elib.run(program, robot=with_faults("flaky-bluetooth", "sim://square?speed=max"))
    (counts,) = weathers
    calls = sum(ends.values())
    assert calls > 0.7 * 2 * duration / PERIOD, "it kept its pace"
    assert ends["timeout"] > 0.01 * calls, "the script took answers away"
    # Every call ended once: one more, the stop of leaving, came after the count.
    assert (books.called - 1, books.ended - 1) == (calls, calls)
    assert statistics.count == ends["value"]
    assert statistics.lost + statistics.unsent == ends["timeout"]
    assert (statistics.refused, statistics.resets) == (0, 0)
    # What the script took away is what was missed: by a call, or by a resync that had to ask again.
    unanswered = books.questions - statistics.resyncs
    assert counts.lost + counts.halved == statistics.lost + unanswered
    assert counts.stalls == len(range(20, int(duration), 31))
    assert sizes[1] - sizes[0] < GROWTH
    assert set(threading.enumerate()) <= threads
