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
ENDED = "elib.program.value.state === 'idle' && elib.lines.value.map((line) => line.text).join('\\n')"
REACH = """import js
from pyodide.ffi import run_sync

try:
    run_sync(js.eval("import('{elsewhere}pyodide.asm.mjs')"))
except Exception as error:
    print(error)
print([name for name in ("caches", "fetch", "indexedDB", "localStorage", "WebSocket", "Worker") if hasattr(js, name)])
print([name for name in ("serial", "storage", "usb") if hasattr(js.navigator, name)])
"""


async def ran(tab: Tab, text: str) -> str:
    """Run a program and return what it printed."""
    await tab.run(f"elib.borrow('test.py', {json.dumps(text)}, 'a test')")
    await tab.run("elib.run()")
    return str(await tab.until(ENDED))


async def test_a_program_of_a_link_waits_for_run_and_then_drives(open_page: Opener, server: Server) -> None:
    tab = await open_page(f"{server.url}studio/{program_link('drive.py', DRIVE)}")
    await tab.until(READY)
    assert await tab.run("[elib.program.value.state, elib.textNow()]") == ["idle", DRIVE]
    await tab.run("elib.run()")
    assert await tab.until(ENDED) == "0.05 m\n"
    assert len(await tab.until("elib.worldOf().frame.value?.poses.length && [...elib.worldOf().frame.value.poses]"))
    assert {url.removeprefix("blob:").startswith(server.url) for url in tab.requests} == {True}
    assert tab.complaints == []


async def test_it_opens_and_runs_without_a_network_after_the_first_visit(open_page: Opener, server: Server) -> None:
    url = f"{server.url}studio/"
    tab = await open_page(url)
    await tab.until(READY)
    await tab.until("navigator.serviceWorker.ready.then(({ active }) => active.state === 'activated')")
    await tab.close()
    server.close()
    again = await open_page(url)
    await again.until(READY)
    assert await ran(again, DRIVE) == "0.05 m\n"


async def test_a_program_reaches_no_other_server_and_nothing_that_the_browser_keeps(
    open_page: Opener, server: Server, studio: Path
) -> None:
    elsewhere = Server(studio)
    tab = await open_page(f"{server.url}studio/")
    await tab.until(READY)
    fetched = f"fetch('{elsewhere.url}', {{ mode: 'no-cors' }}).then(() => 'sent', () => 'refused')"
    assert await tab.run(fetched) == "refused"
    said = (await ran(tab, REACH.replace("{elsewhere}", elsewhere.url))).splitlines()
    assert said[0].startswith("EvalError")
    assert said[-2:] == ["[]", "[]"]
    elsewhere.close()
