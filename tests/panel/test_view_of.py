"""The page of a simulation: how it begins and ends."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import pytest
from page_rig import opened

from elib.base.errors import ArgumentError, LinkBusy, SimulationError
from elib.base.timebase import new_loop
from elib.panel.panel import WORLD, Panel
from elib.panel.server.http import own_address, served
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import needs_page, until

pytestmark = needs_page


@contextlib.asynccontextmanager
async def view_of(control: Control, place: str) -> AsyncIterator[str]:
    """Serve the page of a simulation, as elib simulate --view does."""
    panel = Panel(can=WORLD, worlds={"": control}, reachable=[("epuck-1", "tcp://127.0.0.1:4001")])
    async with served(panel, own_address(place)) as server:
        yield server.url


@contextlib.asynccontextmanager
async def simulation(**settings: object) -> AsyncIterator[Control]:
    """Serve a simulation and yield its control."""
    controls: list[Control] = []
    async with serve(SimulationSettings(**settings), tcp="0", control=controls.append):  # type: ignore[arg-type]
        yield controls[0]


async def test_a_simulation_is_shown_until_it_ends_and_its_port_is_free_again() -> None:
    async with simulation(world="square", robots=2) as control:
        async with view_of(control, "0") as url, opened(url) as page:
            assert page.hello["can"] == dict.fromkeys(page.hello["can"], False) | {
                "edit": True,
                "speed": True,
                "save": True,
            }
            await page.ask("subscribe", what="overview")
            await until(lambda: any(each.get("worlds") == [["", "square"]] for each in page.of("update")))
            await page.ask("subscribe", what="world")
            assert (await page.ask("move_robot", robot=0, x=0.3, y=0.4))["ok"]
            host, port = url.removeprefix("http://").rstrip("/").split(":")
        with pytest.raises(ConnectionRefusedError):
            await asyncio.open_connection(host, int(port))


async def test_a_message_of_the_world_with_a_mistake_is_answered_and_the_page_goes_on() -> None:
    async with simulation(world="square") as control, view_of(control, "0") as url, opened(url) as page:
        await page.ask("subscribe", what="world")
        assert "there is no robot 7" in (await page.ask("cut", robot=7))["error"]["message"]
        refused = await page.ask("set_light", light=0, intensity=12.5)
        assert refused["error"]["message"].startswith("intensity is 12.5; it must be a number from 0 to 10")
        assert "there is no such robot" in (await page.ask("subscribe", what="robot", of="9"))["error"]["message"]
        assert "index of a robot" in (await page.ask("subscribe", what="readings", of="x"))["error"]["message"]
        assert (await page.ask("subscribe", what="readings", of="99"))["ok"]
        assert (await page.ask("subscribe", what="world", rays=True))["ok"]
        before = len(page.frames)
        await until(lambda: len(page.frames) > before)


async def test_the_page_of_a_simulation_says_how_programs_reach_its_robots() -> None:
    async with simulation(world="square") as control, view_of(control, "0") as url, opened(url) as page:
        assert page.hello["robots"] == [{"name": "epuck-1", "url": "tcp://127.0.0.1:4001"}]


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
            await page.ask("subscribe", what="overview")
            began, updates = loop.time(), len(page.of("update"))
            await until(lambda: len(page.of("update")) >= updates + 5)
            assert loop.time() - began > 0.3 * speed, "five updates take half a second of the wall clock"

    with asyncio.Runner(loop_factory=lambda: new_loop(speed)) as runner:
        runner.run(main())
