"""Open and close hundreds of pages, then send random messages for minutes: does the server stay as small as it was?

It shows memory, tasks and connections of the server after each part, and whether the robots stand at the end.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import os
import random
import subprocess
import sys
import tempfile
import threading
from collections.abc import AsyncIterator

from harness import PATIENCE, Tables, calling, quick, run, started
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from elib.base.errors import ArgumentError
from elib.panel.panel import Panel
from elib.panel.server import http as server
from elib.panel.server.listening import listen
from elib.panel.server.messages import MESSAGES, decode
from elib.panel.slot import Slot
from elib.robot.running import run_coroutine

ROBOTS = ["sim://crowd?robots=4", "sim://line"]
AT_ONCE = 8
"""Pages that are open at the same time."""
RATE = 60.0
"""Messages a second of one page."""
SKIPPED = {"find", "add", "open_recording", "connect", "disconnect", "remove"}
"""What opens ports of this computer, or takes away the robots that are looked at."""

WORDS = ["1", "2", "3", "6", "overview", "start", "avoid", "version", "set_led", "stop", "", "é\0", "x" * 500, "run"]
NUMBERS: list[object] = [0, 1, -1, 0.5, 1e308, 2**60, 10**30, True, None, 40, 8, 3.5]


def anything(dice: random.Random, depth: int = 0) -> object:
    kind = dice.randrange(5 if depth < 3 else 2)
    if kind == 0:
        return dice.choice(WORDS)
    if kind == 1:
        return dice.choice(NUMBERS)
    if kind == 2:
        return [anything(dice, depth + 1) for _ in range(dice.randrange(3))]
    if kind == 3:
        return {dice.choice(WORDS): anything(dice, depth + 1) for _ in range(dice.randrange(3))}
    return dice.choice(WORDS[:6])


def message(dice: random.Random) -> str:
    """Return a random message: most are of the page, some of them for robots that are not there, some are nonsense."""
    what = dice.choice([name for name in MESSAGES if name not in SKIPPED])
    kind = MESSAGES[what]
    usual: dict[str, object] = {
        "robot": dice.choice("123456"),
        "robots": ["1", "2"],
        "what": dice.choice(["robot", "overview", "world", "readings"]),
        "of": dice.choice(["", "0", "1", "5"]),
        "channel": dice.randrange(3),
        "frames": [[dice.randrange(3), dice.randrange(10**6)]],
        "left": dice.uniform(-1, 1),
        "right": dice.uniform(-1, 1),
        "number": dice.randrange(10**6),
        "name": dice.choice(["avoid", "bull", "set_speed", "set_led", "version", "run.log"]),
        "line": dice.choice(["version", "set_speed 0.3 0.3", "set_led 1", "nonsense"]),
        "arguments": dice.choice([[], [1, 1], [0.5, 0.5]]),
        "mode": "GREY",
        "width": 40,
        "height": 40,
        "zoom": 8,
        "seconds": 1.0 if what == "seek" else dice.choice([None, 1.0]),
        "share": dice.random(),
        "on": dice.random() < 0.5,
        "url": "sim://",
        "options": {},
        "speed": dice.choice([0.5, 1, 2]),
        "ambient": dice.uniform(0, 4095),
        **{name: dice.random() for name in ("x", "y", "x1", "y1", "x2", "y2")},
        **{name: dice.randrange(3) for name in ("wall", "box", "cylinder", "light", "sound", "position", "key")},
    }
    about = {name: usual[name] for name in kind.__struct_fields__ if name != "id" and name in usual}
    if dice.random() < 0.5:
        about["id"] = dice.randrange(10**6)
    if dice.random() < 0.1:
        about[dice.choice([*about, "id", "more"])] = anything(dice)
    text = json.dumps({"do": what} | about)
    return text[: dice.randrange(len(text))] if dice.random() < 0.01 else text


# -- the server, in a process of its own --


def place_of(slot: Slot) -> list[float]:
    """Return where a robot is in its world."""
    assert slot.control is not None
    pose = slot.control.snapshot().robots[slot.index].pose
    return [pose.x, pose.y, pose.heading]


def serve() -> None:
    """Serve until the input ends; for every line of it print how large the server is."""
    panels: list[Panel] = []

    class SeenPanel(Panel):
        def __init__(self, *, is_shared: bool) -> None:
            super().__init__(is_shared=is_shared)
            panels.append(self)

    server.Panel = SeenPanel  # type: ignore[misc]

    async def main() -> None:
        loop = asyncio.get_running_loop()
        stop = asyncio.Event()

        def tell() -> None:
            gc.collect()
            with open("/proc/self/statm") as file:
                pages = int(file.read().split()[1])
            (panel,) = panels
            print(
                json.dumps(
                    {
                        "MiB": pages * os.sysconf("SC_PAGE_SIZE") / 2**20,
                        "tasks": len(asyncio.all_tasks()),
                        "files": len(os.listdir("/proc/self/fd")),
                        "objects": len(gc.get_objects()),
                        "moving": " ".join(key for key, slot in panel.slots.items() if slot.drive.may_move) or "none",
                        "poses": [place_of(slot) for slot in panel.slots.values()],
                        "connected": sum(slot.is_connected for slot in panel.slots.values()),
                    }
                ),
                flush=True,
            )

        def read() -> None:
            for _ in sys.stdin:
                loop.call_soon_threadsafe(tell)
            loop.call_soon_threadsafe(stop.set)

        def ready(url: str) -> None:
            print(url, flush=True)
            threading.Thread(target=read, daemon=True).start()

        serving = asyncio.create_task(server.serve(listen(port=0), ROBOTS, on_ready=ready))
        await asyncio.wait([serving, asyncio.create_task(stop.wait())], return_when=asyncio.FIRST_COMPLETED)
        serving.cancel()
        await asyncio.wait([serving])

    run_coroutine(main)


# -- the pages --


@contextlib.asynccontextmanager
async def page(place: str) -> AsyncIterator[ClientConnection]:
    async with connect(
        f"ws://{place}/ws", origin=f"http://{place}", proxy=None, compression=None, max_size=None, max_queue=None
    ) as socket:
        yield socket


async def draw(socket: ClientConnection) -> None:
    """Draw what comes, as a page does."""
    with contextlib.suppress(ConnectionClosed):
        async for text in socket:
            if isinstance(text, bytes):
                number, channel = (int.from_bytes(text[at : at + 4], "little") for at in (0, 20))
                await socket.send(json.dumps({"do": "frames_drawn", "frames": [[channel, number]]}))
            elif (found := json.loads(text))["type"] == "update":
                await socket.send(json.dumps({"do": "drawn", "number": found["number"]}))


async def visit(place: str, count: int) -> None:
    """Open and close pages one after the other; some leave without a word."""
    for number in range(count):
        async with page(place) as socket:
            drawing = asyncio.create_task(draw(socket))
            for what, of in (("overview", ""), ("robot", "1"), ("world", "1")):
                await socket.send(json.dumps({"do": "subscribe", "what": what, "of": of}))
                await asyncio.sleep(0.15)
            if number % 3 == 0:
                socket.transport.abort()
        await asyncio.wait([drawing])


async def talk(place: str, seed: int, seconds: float) -> tuple[int, int]:
    """Say random things; return how many messages were sent, and how often the page was thrown out."""
    dice, loop = random.Random(seed), asyncio.get_running_loop()
    end, said, thrown = loop.time() + seconds, 0, 0
    while loop.time() < end:
        with contextlib.suppress(ConnectionClosed, InvalidStatus):
            async with page(place) as socket:
                drawing = asyncio.create_task(draw(socket))
                try:
                    while loop.time() < end and not drawing.done():
                        text = message(dice)
                        said += 1
                        await socket.send(text)
                        await asyncio.sleep(dice.expovariate(RATE))
                        if not isinstance(decode(text)[1], ArgumentError):
                            continue
                        await asyncio.wait([drawing], timeout=5)
                        assert drawing.done(), f"it stayed after {text}"
                        assert socket.close_code == 1008, (socket.close_code, text)
                        thrown += 1
                finally:
                    drawing.cancel()
                    await asyncio.wait([drawing])
    return said, thrown


async def tidy(place: str) -> None:
    """End what was begun for robots and goes on without a page: logs, recordings, cut links."""
    async with page(place) as socket:
        for robot in "15":
            await socket.send(json.dumps({"do": "subscribe", "what": "world", "of": robot}))
            await socket.send(json.dumps({"do": "mend", "robot": 0}))
        for robot in "12345":
            for what in ("stop_log", "stop_recording"):
                await socket.send(json.dumps({"do": what, "robot": robot}))
        await asyncio.sleep(3.0)  # a link that was cut is opened again


async def soak(pages: int, minutes: float) -> dict[str, dict]:
    """Return how large the server is after each part."""
    rows: dict[str, dict] = {}
    with tempfile.TemporaryDirectory() as folder:
        home = {**os.environ, "XDG_STATE_HOME": folder, "HOME": folder}
        with started(*calling(serve), stdin=subprocess.PIPE, cwd=folder, env=home) as (process, [url]):
            assert process.stdin is not None
            assert process.stdout is not None

            async def look(after: str) -> None:
                await asyncio.sleep(3.0)  # the robots of pages that left have been stopped
                print(file=process.stdin, flush=True)
                rows[after] = json.loads(await asyncio.to_thread(process.stdout.readline))
                print(f"{after}: {rows[after]['MiB']:.0f} MiB", file=sys.stderr, flush=True)

            place = url.removeprefix("http://").rstrip("/")
            await asyncio.sleep(5.0)
            await look("at the beginning")
            for count, more in ((2, ""), (pages // AT_ONCE, "more ")):
                await asyncio.gather(*(visit(place, count) for _ in range(AT_ONCE)))
                await look(f"after {count * AT_ONCE} {more}pages")
            parts = max(1, round(minutes))
            for part in range(1, parts + 1):
                told = await asyncio.gather(*(talk(place, part * 100 + k, 60.0 * minutes / parts) for k in range(4)))
                await tidy(place)
                await look(f"{part}: {sum(a for a, _ in told)} messages, {sum(b for _, b in told)} thrown out")
            await look("three seconds later")
            process.stdin.close()
            rows["at the end"] = {"exit code": await asyncio.to_thread(process.wait, PATIENCE)}
    return rows


@quick(pages=16, minutes=0.05)
def measure(*, pages: int = 500, minutes: float = 10.0) -> Tables:
    """Soak the server.

    Args:
        pages: That are opened and closed.
        minutes: Of random messages.
    """
    rows = asyncio.run(soak(pages, minutes))
    yield "the server", {name: {key: row[key] for key in row if key != "poses"} for name, row in rows.items()}
    _, first, *_, last, again, _ = rows.values()
    assert last["tasks"] <= first["tasks"], "tasks were left"
    assert last["moving"] == "none", "a robot moves"
    assert last["poses"] == again["poses"], "a robot moves though none should"


if __name__ == "__main__":
    run(__doc__, measure)
