"""What a page's Python has not installed, nothing that the studio does may need."""

from __future__ import annotations

import json

from shared import run_python

WITHOUT = """
import asyncio, json, sys
from importlib.abc import MetaPathFinder

ABSENT = {"PIL", "aiohttp", "cyclopts", "mcap", "numba", "numpy", "rich", "serialx"}

class Absent(MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name.partition(".")[0] in ABSENT:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Absent())

from elib.link.transport import parse_url
from elib.panel.panel import Can, Panel
from elib.panel.recents import RecentRobots
from elib.panel.server import messages
from elib.panel.server.page import Page
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.settings import settings_of
from elib.simulator.emulator.simulation import Simulation

class Port:
    unread = 0

    def __init__(self):
        self.texts, self.frames, self.both = [], [], asyncio.Event()

    async def send(self, data, *, is_text):
        if is_text:
            self.texts.append(json.loads(data))
        else:
            self.frames.append(len(data))
            self.both.set()

async def main():
    panel, port = Panel(can=Can(edit=True), recents=RecentRobots(None)), Port()
    panel.worlds = {"program": Control(Simulation(settings_of(parse_url("sim://line")), is_connected=False))}
    page = Page(panel, messages.decode, port)
    while not port.texts:
        await asyncio.sleep(0)
    await page.hear('{"do": "subscribe", "id": 1, "what": "world", "of": "program", "rate": 25}')
    await port.both.wait()
    print(json.dumps(port.texts))

asyncio.run(main())
"""


def test_a_page_is_shown_a_world_with_a_painted_floor_by_python_and_msgspec_alone() -> None:
    told = json.loads(run_python(WITHOUT).stdout)
    assert told[0]["type"] == "hello"
    [scene] = [each for each in told if each["type"] == "scene"]
    assert scene["scene"]["world"] == "line"
    assert scene["scene"]["floor_png"].startswith("data:image/png;base64,")
    assert [each["ok"] for each in told if each["type"] == "answer"] == [True]
