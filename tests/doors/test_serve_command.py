"""``elib serve`` as a person starts and ends it, while a program drives a robot on a port; and drivers that die."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal

import pytest
from elib_process import started
from serve_rig import Program, child, serving
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from elib.cli import main
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from lanes import short
from shared import needs_page, until

pytestmark = needs_page


async def drive_on(program: Program) -> None:
    """Set the same speeds until the connection ends: a busy machine that lets the robot stop lets it drive on."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            await program.say("set_speed", left=0.5, right=0.4)
            await asyncio.sleep(0.1)  # clock: any rate will do


def wheels(control: Control) -> tuple[float, float]:
    """Return how fast the wheels turn in the world, m/s."""
    control.simulation.catch_up()
    here = control.world._robot(0)
    return here.left_speed, here.right_speed


@pytest.mark.parametrize("number", short([signal.SIGINT, signal.SIGTERM, signal.SIGHUP], signal.SIGTERM))
async def test_whatever_ends_the_command_stops_the_robot_and_tells_the_program(number: signal.Signals) -> None:
    controls: list[Control] = []
    async with serve(SimulationSettings(world="square", baud=0), tcp="0", control=controls.append) as robots:
        (control,) = controls
        with started("serve", robots[0].url, "--port", "0") as run:
            url = await asyncio.to_thread(run.out.line)
            async with connect(url, compression=None, proxy=None) as ws:
                program = Program(ws)
                driving = asyncio.create_task(drive_on(program))
                await until(lambda: all(wheels(control)))
                ended = asyncio.create_task(asyncio.to_thread(run.end, number))
                with pytest.raises(ConnectionClosed) as caught:
                    while True:
                        await program.hear()
                await asyncio.wait([driving])
                assert caught.value.rcvd is not None
                assert (caught.value.rcvd.code, caught.value.rcvd.reason) == (1001, "elib serve has ended")
                assert await ended == 0
                await until(lambda: wheels(control) == (0, 0))  # nobody is left who would stop it later
            assert await asyncio.to_thread(run.err.rest) == ""


def test_the_schema_is_printed_without_a_robot(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--schema"]) == 0
    assert json.loads(capsys.readouterr().out)["x-protocol"] == 1


@pytest.mark.parametrize("number", short([signal.SIGKILL, signal.SIGSTOP], signal.SIGKILL))
async def test_a_robot_stands_whose_driver_was_killed_or_stopped(number: signal.Signals) -> None:
    async with serving() as rig, child(rig.url) as process:
        await rig.until_it_moves()
        process.send_signal(number)
        await rig.until_it_stands()
        await until(lambda: rig.slot().drive.driver == "")
