"""Eleven requests at once, in the callback style: the program does not wait while the robot answers."""

from __future__ import annotations

from elib.base.errors import LinkError
from elib.behaviours import RunContext, behaviour
from elib.behaviours._run.tours import TIMEOUT, Timeout, TourStep, begin_step, no_outcome
from elib.behaviours.sensors_tour import STEPS
from elib.link.session import GRACE
from elib.robot.blocking import BlockingEpuck

SHARES = {
    "help_text": 1,
    "accelerometer": 2,
    "version": 3,
    "camera": 4,
    "encoders": 4,
    "proximity": 5,
    "ir_receiver": 6,
    "ambient_light": 7,
    "microphones": 8,
    "selector": 9,
    "speed": 10,
}
"""The requests, and how many timeouts each has: they wait for each other, and waiting counts (as in Elib of 2011)."""
SLICE = 1.0
"""s of waiting after which the run is checked for its end."""


def questions() -> list[tuple[TourStep, int]]:
    """Return the requests and their numbers of timeouts, in the order of asking."""
    return [(step, SHARES[step.command]) for step in STEPS if step.command in SHARES]


@behaviour(group="samples of 2011")
def ask_all(robot: BlockingEpuck, run: RunContext, *, timeout: Timeout = TIMEOUT) -> None:
    """Ask eleven questions without waiting for any answer, and show how far the answers lag behind.

    The calls return at once, and the answers come to callbacks. A request uses up its time while it waits for the ones
    before, so each has more time than the one before.

    Args:
        robot: The robot.
        run: The run.
        timeout: Time for the first answer; the last has ten times as much.
    """
    run.state("asking")
    began = run.time
    asked = [(step, begin_step(robot, run, step, share * timeout)) for step, share in questions()]
    answers = [(step, answer) for step, answer in asked if answer is not None]
    done = run.time
    run.say(f"{done:8.3f} s  {len(answers)} questions asked in {done - began:.3f} s")
    run.state("listening")
    end = robot.time + max(SHARES.values()) * timeout + GRACE
    for step, answer in answers:
        while not answer.wait(robot, SLICE) and not run.is_over:
            if robot.time > end:
                raise no_outcome(step.command)
        if run.is_over:
            return
        if isinstance(answer.error, LinkError):
            raise answer.error
    last = max((answer.time for _, answer in answers), default=done)
    run.say(f"{last:8.3f} s  the last outcome came {last - done:.3f} s after the last question")
