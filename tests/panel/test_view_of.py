"""The page of a simulation: how it begins and ends."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import pytest

pytest.importorskip("aiohttp", reason="the extra web is not installed: pip install '.[web]'")

from page_rig import opened

from elib.base.errors import ArgumentError, LinkBusy, SimulationError
from elib.base.timebase import new_loop
from elib.panel.server.http import view_of
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import needs_page, until

pytestmark = needs_page


@contextlib.asynccontextmanager
async def simulation(**settings: object) -> AsyncIterator[Control]:
    """Serve a simulation and yield its control."""
    controls: list[Control] = []
    async with serve(SimulationSettings(**settings), tcp="0", control=controls.append):  # type: ignore[arg-type]
        yield controls[0]


async def test_a_simulation_is_shown_until_it_ends_and_its_port_is_free_again() -> None:
    async with simulation(world="square", robots=2) as control:
        async with view_of(control, "0") as url, opened(url) as page:
            assert page.hello["simulation"] is True
            assert page.hello["place"] == "overview"
            assert (await page.ask("world", message={"do": "state"}))["result"]["ok"]
            host, port = url.removeprefix("http://").rstrip("/").split(":")
        with pytest.raises(ConnectionRefusedError):
            await asyncio.open_connection(host, int(port))


async def test_a_message_of_the_world_with_a_mistake_is_answered_and_the_page_goes_on() -> None:
    async with simulation(world="square") as control, view_of(control, "0") as url, opened(url) as page:
        for message in (
            {},
            {"do": "fly"},
            {"do": "cut"},
            {"do": "cut", "robot": 7},
            {"do": "cut", "robot": True},
            {"do": "move_robot", "robot": "epuck-1"},
        ):
            answer = await page.ask("world", message=message)
            assert (answer["ok"] and answer["result"]["ok"]) is False, message
        assert (await page.ask("watch", index=99))["ok"]
        assert (await page.ask("rays", on=True))["ok"]
        before = len(page.frames)
        await until(lambda: len(page.frames) > before)


async def test_a_taken_port_a_foreign_address_and_constant_readings_are_said(tmp_path) -> None:
    async with simulation(world="square") as control:
        async with view_of(control, "0") as url:
            with pytest.raises(LinkBusy, match="is taken"):
                async with view_of(control, url.removeprefix("http://").rstrip("/")):
                    pass
        with pytest.raises(ArgumentError, match="is not this computer"):
            async with view_of(control, "0.0.0.0:0"):
                pass
    path = tmp_path / "readings.json"
    path.write_text("{}")
    async with simulation(hardware=str(path)) as control:
        with pytest.raises(SimulationError, match="no world"):
            async with view_of(control, "0"):
                pass


@pytest.mark.parametrize("speed", [0.5, 20.0])
def test_the_page_keeps_its_own_time_however_fast_the_simulation_runs(speed: float) -> None:
    async def main() -> None:
        loop = asyncio.get_running_loop()
        async with (
            simulation(world="square", speed=speed) as control,
            view_of(control, "0") as url,
            opened(url) as page,
        ):
            began, updates = loop.time(), len(page.of("update"))
            await until(lambda: len(page.of("update")) >= updates + 5)
            assert loop.time() - began > 0.3 * speed, "five updates take half a second of the wall clock"

    with asyncio.Runner(loop_factory=lambda: new_loop(speed)) as runner:
        runner.run(main())
