"""A robot without a library: bytes, a line and a clock."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

from elib.behaviours import RunContext, behaviour
from elib.transport import Transport

TURN, STAND = b"d,-100,100\r", b"d,0,0\r"
"""What makes the robot turn left on the spot at a tenth of its speed, and what makes it stand: the letter, the wheels'
steps a second, and a carriage return."""
TURNS, STANDS = 10, 30
PERIOD = 0.1
"""s between two lines, whoever answers (elib-2011, 6.2)."""


def timetable() -> Iterator[tuple[float, bytes]]:
    """Yield when each line is due, s since the first, and the line: 1 s of turning, 3 s of standing.

    Each is sent many times over: a robot that misses one, or had half a line in its buffer, takes the next.
    """
    for number in range(TURNS + STANDS):
        yield number * PERIOD, TURN if number < TURNS else STAND


@behaviour
async def turn_around(line: Transport, run: RunContext) -> None:
    """Turn the robot to the left for a second, by raw bytes alone.

    Needs no answers and reads none: no session, no library between the program and the robot. It shows what the others
    spare you: nobody knows here whether the robot heard anything.
    """
    run.say(f"the port is {line.url}")
    began = asyncio.get_running_loop().time()
    for due, command in timetable():
        await asyncio.sleep(began + due - asyncio.get_running_loop().time())
        run.state("turning" if command == TURN else "standing")
        await line.write(command)
    await asyncio.sleep(PERIOD)
    run.say(f"{TURNS + STANDS} lines were written to {line.url}; what the robot answered, nobody has read")
