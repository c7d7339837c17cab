"""The check that refuses tests which race the wall clock."""

import asyncio

import pytest

from check_waiting import Reader
from elib.testing import simulated
from shared import PATIENCE, until

RACES = [
    ("await asyncio.sleep(0.3)", "asyncio.sleep() sleeps"),
    ("await asyncio.sleep(pause)", "asyncio.sleep() sleeps"),
    ("time.sleep(1)", "time.sleep() sleeps"),
    ("began = time.monotonic()", "time.monotonic() reads the wall clock"),
    ("async with asyncio.timeout(5): pass", "asyncio.timeout() waits for 5 s only"),
    ("async with asyncio.timeout(SHORT): pass", "asyncio.timeout() waits for SHORT s only"),
    ("await asyncio.wait_for(task, 2)", "asyncio.wait_for() waits for 2 s only"),
    ("await asyncio.wait_for(task, timeout=2)", "asyncio.wait_for() waits for 2 s only"),
    ("subprocess.run(command, timeout=20)", "subprocess.run() waits for 20 s only"),
    ("process.wait(20)", "process.wait() waits for 20 s only"),
    ("process.communicate(timeout=20)", "process.communicate() waits for 20 s only"),
    ("threading.Event().wait(0.05)", "?.wait() waits for 0.05 s only"),
    ("thread.join(10)", "thread.join() waits for 10 s only"),
    ("lines.get(timeout=1)", "lines.get() waits for 1 s only"),
    ("listener.bind(('127.0.0.1', 4000))", "bind() takes a fixed port; take port 0"),
    ("os.kill(4711, 9)", "os.kill() names a fixed process"),
    ("await until(lambda: tab.run('done'))", "until() asks a page that may be left; use until() of the tab"),
    (
        "await tab.run('location.reload()')",  # clock: an example
        "the next question may go to the old page; use reload() or go() of the tab",
    ),
    (
        "with socket.socket() as free: port = free.getsockname()[1]\n    connect(port)",
        "a port that is let go may be anybody's; use held_port()",
    ),
]
NO_RACES = [
    "await asyncio.sleep(0)",
    "async with asyncio.timeout(60): pass",
    "async with asyncio.timeout(PATIENCE): pass",
    "process.wait(PATIENCE)",
    "elib.wait(calls, timeout=0.2)",
    "', '.join(words)",
    "words.get('key', 5)",
    "await tab.until('location.hash === \"\"')",
    "with socket.socket() as line: connect(line.getsockname()[1])",
    "listener.bind(('127.0.0.1', 0))",
    "os.kill(process.pid, 9)",
    "await asyncio.sleep(0.3)  # clock: simulated",
]


def races(line: str, before: str = "") -> list[tuple[int, str]]:
    return Reader(f"SHORT = 3\n{before}\nasync def test_it():\n    {line}\n").found


@pytest.mark.parametrize(("line", "sentence"), RACES)
def test_what_races_the_wall_clock_is_refused_with_its_line(line, sentence):
    assert races(line) == [(4, sentence)]


@pytest.mark.parametrize("line", NO_RACES)
def test_what_waits_for_an_outcome_passes(line):
    assert races(line) == []


def test_in_simulated_time_everything_may_wait():
    for before in ("@simulated", "@inside(elib.open, SIM)", "# clock: simulated"):
        assert races("await asyncio.sleep(1)", before) == []


@pytest.mark.parametrize(("answers", "said"), [(True, r"; [1-9]\d* looks"), (False, "; 0 looks")])
@simulated
async def test_a_wait_that_fails_says_how_often_it_was_answered(answers, said):
    async def look() -> bool:
        await asyncio.sleep(1 if answers else 2 * PATIENCE)
        return False

    with pytest.raises(AssertionError, match=said):
        await until(look)
