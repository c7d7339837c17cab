"""The studio in Chromium and Firefox, from a folder that any web server serves."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from browser import Tab
from studio_rig import BROWSERS, Opener, Server
from try_links import program_link

pytestmark = [pytest.mark.long, pytest.mark.parametrize("open_page", BROWSERS, indirect=True)]

DRIVE = """import elib

with elib.connect("sim://arena?quality=ideal") as robot:
    robot.drive(0.05)
    print(f"{robot.pose().x:.2f} m")
"""
READY = "window.elib?.hello.value"
REACH = """import js
from pyodide.ffi import run_sync

try:
    run_sync(js.eval("import('{elsewhere}pyodide.asm.mjs')"))
except Exception as error:
    print(error)
print([name for name in ("caches", "fetch", "indexedDB", "localStorage", "WebSocket", "Worker") if hasattr(js, name)])
print([name for name in ("serial", "storage", "usb") if hasattr(js.navigator, name)])
"""


async def ran(tab: Tab) -> str:
    """Run the program that is shown, and return what it printed."""
    await tab.run("elib.run()")
    await tab.until("elib.program.value.state === 'idle' && !elib.isWaiting.value")
    await tab.drawn()
    return str(await tab.run("elib.lines.value.map((line) => line.text).join('\\n')"))


async def show(tab: Tab, text: str) -> None:
    await tab.run(f"elib.borrow('test.py', {json.dumps(text)}, 'a test')")


async def reaches_nothing(tab: Tab, elsewhere: Server) -> None:
    fetched = f"fetch('{elsewhere.url}', {{ mode: 'no-cors' }}).then(() => 'sent', () => 'refused')"
    assert await tab.run(fetched) == "refused"
    await show(tab, REACH.replace("{elsewhere}", elsewhere.url))
    said = (await ran(tab)).splitlines()
    assert said[0].startswith("EvalError")
    assert said[-2:] == ["[]", "[]"]


async def test_a_program_of_a_link_waits_for_run_reaches_nothing_else_and_runs_without_a_network_at_the_next_visit(
    open_page: Opener, server: Server, studio: Path
) -> None:
    tab = await open_page(f"{server.url}studio/{program_link('drive.py', DRIVE)}")
    await tab.until(READY)
    assert await tab.run("[elib.program.value.state, elib.textNow()]") == ["idle", DRIVE]
    assert await ran(tab) == "0.05 m\n"
    assert len(await tab.until("elib.worldOf().frame.value?.poses.length && [...elib.worldOf().frame.value.poses]"))
    assert {url.removeprefix("blob:").startswith(server.url) for url in tab.requests} == {True}
    assert tab.complaints == []
    elsewhere = Server(studio)
    await reaches_nothing(tab, elsewhere)
    await tab.until("navigator.serviceWorker.ready.then(({ active }) => active.state === 'activated')")
    await tab.close()
    server.close()
    again = await open_page(f"{server.url}studio/")
    await again.until(READY)
    await reaches_nothing(again, elsewhere)
    elsewhere.close()
    await show(again, DRIVE)
    assert await ran(again) == "0.05 m\n"
