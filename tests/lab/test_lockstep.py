"""The same program in the same variant gives the same run, to the last byte, and the run of ``sim://?speed=max``."""

from __future__ import annotations

import os
import sys
from itertools import product
from pathlib import Path

import pytest
from labs_for_tests import TOP, lab_in, run_program

from elib.lab import running
from elib.link.protocol.profiles import FIRMWARES
from lanes import short
from shared import PATIENCE, run

BLOCKING = """
with elib.connect(URL) as robot:
    for turn in range(6):
        robot.set_speed(0.3, 0.1 * turn)
        show(robot.time, robot.proximity(), robot.encoders())
        robot.sleep(0.3)
    robot.stop()
    show(robot.time, robot.accelerometer())
"""
ASYNC = """
async def main(robot):
    for turn in range(4):
        await robot.set_speed(0.3, 0.1 * turn)
        show(robot.time, await asyncio.gather(robot.proximity(), robot.accelerometer(), robot.encoders()))
        await asyncio.sleep(0.25)
    await robot.turn(1.0)
    show(robot.time, await robot.encoders())

elib.run(main, robot=URL)
"""
BEGIN = """
with elib.connect(URL) as robot:
    for turn in range(4):
        calls = [robot.begin.set_speed(0.2, 0.1 * turn), robot.begin.proximity(), robot.begin.encoders()]
        show(robot.time, [call.result() for call in calls])
        robot.sleep(0.2)
"""
CALLBACK = """
seen = []
with elib.connect(URL) as robot:
    for turn in range(4):
        robot.callback(lambda near, state: state.append(near), print, seen).proximity()
        robot.sleep(0.2)
    show(robot.time, seen)
"""
BEHAVIOUR = """
async def main(robot):
    while robot.time < 4:
        near = await robot.proximity()
        await robot.set_speed(0.4 - near.front_right / 4000, 0.4 - near.front_left / 4000)
        show(robot.time, near)
        await asyncio.sleep(0.2)

elib.run(main, robot=URL)
"""
PICTURES = """
with elib.connect(URL) as robot:
    for turn in range(2):
        robot.set_speed(0.3, -0.3)
        show(robot.time, hashlib.sha256(robot.image().pixels.tobytes()).hexdigest())
"""
RECONNECTING = """
async def main(robot):
    await robot.set_speed(0.2, 0.1)
    for turn in range(60):
        try:
            show(robot.time, await robot.proximity())
        except elib.ElibError as error:
            show(robot.time, type(error).__name__)
        await asyncio.sleep(0.5)

async def whole():
    async with elib.reconnecting(URL) as robot:
        await main(robot)

from elib.robot.running import run_coroutine
from elib.robot.substitute import choose_robot
from elib.link.transport import speed_of

run_coroutine(whole, speed_of(choose_robot(URL)))
"""
SWARM = """
async def main(robots):
    for turn in range(5):
        for number, robot in enumerate(robots):
            await robot.set_speed(0.3, 0.05 * turn * (number + 1))
        await robots[0].send_message(bytes([turn]))
        show(robots[0].time, await asyncio.gather(*(robot.proximity() for robot in robots)))
        await asyncio.sleep(0.3)
    show([await robot.neighbours() for robot in robots])

elib.swarm(URL).run(main)
"""
HEAD = """
import asyncio, hashlib, os, time
import elib

URL = os.environ.get("URL", "sim://no-such-world")

def show(*what):
    print(*what)
    time.sleep(float(os.environ.get("SLOW", "0")))
"""
STYLES = {
    "blocking": BLOCKING,
    "async": ASYNC,
    "begin": BEGIN,
    "callback": CALLBACK,
    "behaviour": BEHAVIOUR,
    "pictures": PICTURES,
}
STOPS = '[[goal]]\nname = "stops"\nkind = "stands"\n'
SEEDS = [1, 918273, 2**63 + 5]
FIRST = [("btcom-2.0", 2**63 + 5), ("epuck2-wifi", 1)]
"""What the quick lane tries: bytes and messages."""


def in_the_simulator(folder: Path, text: str, url: str) -> str:
    """Return what a program prints on a robot inside its own process."""
    (folder / "alone.py").write_text(HEAD + text)
    done = run([sys.executable, "alone.py"], cwd=folder, env={**os.environ, "URL": url})
    assert done.returncode == 0, done.stderr
    return done.stdout


def variant(**keys: object) -> str:
    given = {"name": "given", "world": "arena", **keys}
    return "[[variant]]\n" + "".join(
        f"{key} = {str(value) if isinstance(value, int) else repr(value)}\n" for key, value in given.items()
    )


@pytest.mark.parametrize("style", short(STYLES, "blocking", "async"))
def test_a_run_is_the_same_again_however_slow_the_program_is_and_as_in_the_simulator(
    tmp_path: Path, style: str
) -> None:
    seed = SEEDS[len(style) % 3]
    lab = lab_in(tmp_path, variants=variant(seed=seed), top='title = "t"\nsummary = "s"\ntime = 40\n')
    first = run_program(lab, HEAD + STYLES[style])
    slow = run_program(lab, HEAD + STYLES[style], SLOW="0.07")
    assert (first.ending, first.why) == ("ended", "")
    assert first.transcript == slow.transcript
    assert first.paths == slow.paths
    assert (
        first.output == slow.output == in_the_simulator(tmp_path, STYLES[style], f"sim://arena?speed=max&seed={seed}")
    )


@pytest.mark.parametrize(
    ("firmware", "seed"),
    short(product(FIRMWARES, SEEDS), *FIRST),
)
def test_every_firmware_answers_as_in_the_simulator(tmp_path: Path, firmware: str, seed: int) -> None:
    lab = lab_in(tmp_path, variants=variant(seed=seed, firmware=firmware))
    result = run_program(lab, HEAD + BLOCKING)
    assert result.ending == "ended"
    assert result.output == in_the_simulator(
        tmp_path, BLOCKING, f"sim://arena?speed=max&seed={seed}&firmware={firmware}"
    )


@pytest.mark.parametrize("fault", short(["flaky-bluetooth", "walks-out-of-range"], "flaky-bluetooth"))
def test_faults_come_as_in_the_simulator(tmp_path: Path, fault: str) -> None:
    lab = lab_in(tmp_path, variants=variant(fault=fault, time=90))
    result = run_program(lab, HEAD + RECONNECTING)
    assert (result.ending, result.why) == ("ended", "")
    assert result.transcript == run_program(lab, HEAD + RECONNECTING, SLOW="0.01").transcript
    assert result.output == in_the_simulator(tmp_path, RECONNECTING, f"sim://arena?speed=max&fault={fault}")


def test_a_swarm_shares_one_socket_and_one_world(tmp_path: Path) -> None:
    lab = lab_in(tmp_path, variants=variant(world="crowd", robots=4))
    result = run_program(lab, HEAD + SWARM)
    assert (result.ending, len(result.paths)) == ("ended", 4)
    assert result.transcript == run_program(lab, HEAD + SWARM, SLOW="0.07").transcript
    assert result.output == in_the_simulator(tmp_path, SWARM, "sim://crowd?robots=4&speed=max")


def test_asyncio_run_keeps_the_markers_time(tmp_path: Path) -> None:
    program = """
import asyncio, elib
async def main():
    async with elib.open() as robot:
        await asyncio.sleep(2.5)
        print(robot.time > 2.5)
asyncio.run(main())
"""
    result = run_program(lab_in(tmp_path), program)
    assert (result.ending, result.output) == ("ended", "True\n")
    assert 2.5 < result.time < 3.5


def test_the_same_world_goes_on_when_a_program_opens_its_robot_again(tmp_path: Path) -> None:
    program = """
import elib
for turn in range(3):
    with elib.connect("sim://") as robot:
        assert robot.time < 0.5
        robot.set_speed(0.3, 0.3)
        robot.sleep(0.5)
"""
    result = run_program(lab_in(tmp_path), program)
    assert result.ending == "ended"
    assert result.paths[0][-1].x - result.paths[0][0].x == pytest.approx(3 * 0.5 * 0.3 * 0.129, rel=0.1)


def test_two_robots_opened_one_by_one_share_the_time(tmp_path: Path) -> None:
    program = """
import elib
with elib.connect() as one, elib.connect() as other:
    one.set_speed(0.2, 0.2)
    other.sleep(1.0)
    other.set_speed(0.1, 0.1)
    one.sleep(1.0)
    print(one.encoders().left // 100, other.encoders().left // 100)
"""
    lab = lab_in(tmp_path, variants=variant(world="crowd", robots=2))
    result = run_program(lab, program)
    assert (result.ending, result.output) == ("ended", "4 1\n")
    assert result.transcript == run_program(lab, program).transcript


@pytest.mark.parametrize("seconds", short([0.0, 1.1, 0.3], 0.3))
def test_a_program_that_is_killed_leaves_its_robot_driving(tmp_path: Path, seconds: float) -> None:
    program = f"""
import os, signal, elib
with elib.connect() as robot:
    robot.set_speed(0.3, 0.3)
    robot.sleep({seconds})
    os.kill(os.getpid(), signal.SIGKILL)
"""
    lab = lab_in(tmp_path, STOPS)
    first, second = (run_program(lab, program) for _ in range(2))
    assert (first.ending, first.why, first.exit_code) == ("failed", "signal 9 ended it", -9)
    assert "39 mm/s left" in first.goals[0].text
    assert first.paths == second.paths


def test_a_program_that_ends_leaves_the_wheels_at_rest(tmp_path: Path) -> None:
    lab = lab_in(tmp_path, STOPS)
    program = (
        "import elib\nwith elib.connect() as robot:\n    robot.set_speed(0.3, 0.3)\n    robot.sleep(0.5)\n    {end}\n"
    )
    for end in ("pass", "raise SystemExit(3)", "1 / 0", "robot.begin.set_speed(1, 1)"):
        assert run_program(lab, program.format(end=end)).goals[0].holds, end


def test_a_program_that_waits_in_threads_is_done_by_the_labs_time(tmp_path: Path) -> None:
    program = """
import threading, elib
with elib.connect() as robot:
    def turn():
        while True:
            robot.set_speed(0.1, -0.1)
            robot.sleep(0.5)
    threading.Thread(target=turn, daemon=True).start()
    while True:
        robot.proximity()
"""
    lab = lab_in(tmp_path, top='title = "t"\nsummary = "s"\ntime = 1\n')
    result = run_program(lab, program)
    assert (result.ending, result.time) == ("time", 1.0)


def test_what_a_program_prints_after_its_time_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "GRACE", PATIENCE)
    program = """
import elib
try:
    with elib.connect() as robot:
        robot.sleep(9)
finally:
    sum(range(10_000_000))
    print("done")
"""
    result = run_program(lab_in(tmp_path, top=TOP.replace("20", "1")), program)
    assert (result.ending, result.output) == ("time", "done\n")


def test_a_program_without_a_robot_is_only_a_program(tmp_path: Path) -> None:
    result = run_program(lab_in(tmp_path), "print('no robot')")
    assert (result.ending, result.output, result.time) == ("ended", "no robot\n", 0.0)


def test_a_program_cannot_reach_the_simulator_in_its_own_process(tmp_path: Path) -> None:
    program = """
import elib
with elib.connect() as robot:
    transport = robot._robot.session.transport if hasattr(robot, "_robot") else None
    print(hasattr(transport, "simulation"), hasattr(transport, "observe"))
"""
    assert run_program(lab_in(tmp_path), program).output == "False False\n"


def test_a_program_that_draws_random_numbers_has_the_same_run_each_time(tmp_path: Path) -> None:
    lab = lab_in(tmp_path)
    text = "import random\nimport elib\nwith elib.connect() as robot:\n    robot.drive(random.uniform(0, 0.1))\n"
    first, second = run_program(lab, text), run_program(lab, text)
    assert first.paths == second.paths
    assert first.paths[0][0] != first.paths[0][-1]
