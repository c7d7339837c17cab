"""Drive a robot by raw bytes, without any other part of the library."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

from elib.behaviours import RunContext, behaviour
from elib.link.transport import Transport

TURN, STAND = b"d,-100,100\r", b"d,0,0\r"
"""The commands that make the robot turn left on the spot at a tenth of its speed, and stand: the letter, the speeds of
the wheels in steps/s, and a carriage return."""
TURNS, STANDS = 10, 30
PERIOD = 0.1
"""s between two commands, answered or not (as in Elib of 2011)."""


def timetable() -> Iterator[tuple[float, bytes]]:
    """Yield the time of each command, s since the first, and the command: 1 s of turning, 3 s of standing.

    Each command is sent many times: a robot that misses one, or had half a line in its buffer, gets the next.
    """
    for number in range(TURNS + STANDS):
        yield number * PERIOD, TURN if number < TURNS else STAND


@behaviour(group="samples of 2011")
async def turn_around(line: Transport, run: RunContext) -> None:
    """Turn the robot to the left for a second, by raw bytes.

    There is no session between the program and the robot, and the program reads no answers. So it does not know whether
    the robot received anything; the other behaviours do.
    """
    run.say(f"the port is {line.url}")
    began = asyncio.get_running_loop().time()
    for due, command in timetable():
        await asyncio.sleep(began + due - asyncio.get_running_loop().time())
        run.state("turning" if command == TURN else "standing")
        await line.write(command)
    await asyncio.sleep(PERIOD)
    run.say(f"{TURNS + STANDS} commands were written to {line.url}; the answers were not read")
