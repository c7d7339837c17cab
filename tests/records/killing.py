"""A program that records and is killed: what it had reported until then, and what its file has of it.

The program drives a virtual robot at 20 times real time. It writes marks, each with the wall time, at the same moment
into its recording and, unbuffered, into a pipe. The pipe's marks are what happened; those in the file are what is left.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from elib.records.mcapreader import Health
from elib.records.reader import read_recording

SPEED = 20
STALL = 0.1
"""s between two marks beyond which the program did not run at all: others had the processor."""
PROGRAM = f"""
import asyncio, os, sys, time
import elib
from elib.robot.runner import run_on

async def main(robot):
    recorder = robot.record(sys.argv[1])
    number = 0
    while True:
        for _ in range(5):
            near = await robot.proximity()
            await robot.set_speed(0.3, 0.3 if near.front_left < 200 else -0.3)
            await robot.encoders()
        mark = f"{{number}} {{time.perf_counter()!r}}"
        recorder.note(mark, kind="mark")
        os.write(1, f"{{mark}}\\n".encode())
        number += 1

run_on("sim://arena?speed={SPEED}", main)
"""


@dataclass(frozen=True)
class Killed:
    """How a program ended.

    Attributes:
        ran: s of wall time from its first mark to its end.
        marks: How many it had made.
        kept: How many of them, from the first one on without a gap, its file has.
        loss: s of wall time before its end of which nothing is in the file.
        worst: The same without the time in which the program did not run.
        calls: Number of calls in the file.
        health: State in which the file was found.
    """

    ran: float
    marks: int
    kept: int
    loss: float
    worst: float
    calls: int
    health: Health


def record_and_kill(path: Path, pause: Callable[[], object]) -> Killed:
    """Let the program record into *path*, wait for *pause* from its first mark on, and kill it.

    Raises:
        AssertionError: Its file has a mark twice, out of order or one that it never made.
    """
    with subprocess.Popen([sys.executable, "-c", PROGRAM, str(path)], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        told = os.read(process.stdout.fileno(), 1 << 16)  # the first mark
        pause()
        process.send_signal(signal.SIGKILL)
        ended = time.perf_counter()  # clock: a figure for the benchmark, of which no test asserts anything
        told += process.stdout.read()
        process.wait()
    marks = [float(line.split()[1]) for line in told.decode().splitlines() if line.count(" ") == 1]
    recording, health = read_recording(path), Health()
    found = [each.data["message"] for each in recording.entries("/notes") if each.data["name"] == "mark"]
    calls = sum(1 for _ in recording.entries("/calls", health=health))
    numbers = [int(text.split()[0]) for text in found]
    assert numbers == list(range(len(numbers)))
    # The pipe may lack the very last mark, never the file one that the pipe has before it.
    assert [float(text.split()[1]) for text in found[: len(marks)]] == marks[: len(found)]
    last = float(found[-1].split()[1]) if found else marks[0]
    after = [last, *(mark for mark in marks if mark > last), max(ended, marks[-1])]
    return Killed(
        ended - marks[0],
        len(marks),
        len(numbers),
        max(0.0, ended - last),
        sum(min(end - begin, STALL) for begin, end in pairwise(after)),
        calls,
        health,
    )
