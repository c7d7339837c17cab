"""``sim://WORLD?view``: a virtual robot in a process of its own, which shows its world live in the browser."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import queue
import subprocess
import sys
import threading

from elib.base.browser import show_page
from elib.base.errors import LinkBusy, SimulationError
from elib.base.extras import check_web
from elib.link.protocol.profiles import profile_named
from elib.link.transport.lease import lease_of
from elib.link.transport.stream import StreamTransport
from elib.link.transport.tcp import ONE_AT_A_TIME, connect_tcp
from elib.link.transport.url import Url, parse_url
from elib.link.transport.wifi import WifiTransport
from elib.simulator.emulator.settings import SimulationSettings

START_TIME = 30.0
"""s that the process may take to offer its robots and its page, on a busy computer."""
END_TIME = 3.0
"""s that it may take to end after its program has closed the last robot."""

_worlds: dict[str, WatchedWorld] = {}
"""The worlds with a program, or that wait for one, by URL without ``robot``."""


class WatchedWorld:
    """A simulation in a process of its own. It ends with this process, however that ends: its standard input ends then.

    Args:
        settings: What to simulate.
    """

    def __init__(self, settings: SimulationSettings) -> None:
        self.users: set[StreamTransport] = set()  # the transports that lead to it
        self.robots: list[str] = []  # URLs of its robots, in order
        self.page = ""  # URL of the page
        self._starting = threading.Lock()
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        options = [f"--{key}={value}" for key, value in _keys(settings).items()]
        offer = "--wifi=127.0.0.1:0" if profile_named(settings.firmware).codec == "wifi" else "--tcp=127.0.0.1:0"
        command = [sys.executable, "-m", "elib", "simulate", settings.world, offer, *options, "--view=", "--until-eof"]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            start_new_session=True,  # Ctrl-C is for the program, which then stops the robot
        )
        threading.Thread(target=self._read, name="elib view", daemon=True).start()

    def start(self) -> None:
        """Wait until its robots and its page can be opened, and show the page. Any thread may call it, several times.

        Raises:
            SimulationError: It could not be started; the message is its own.
        """
        with self._starting:
            if self.page:
                return
            self._wait()
            print(f"view {self.page}", file=sys.stderr, flush=True)
            show_page(self.page)

    @property
    def is_running(self) -> bool:
        """Whether the process goes on."""
        return self._process.poll() is None

    def close(self) -> None:
        """End the process. Safe to repeat."""
        if self._process.stdin is not None and not self._process.stdin.closed:
            with contextlib.suppress(OSError):
                self._process.stdin.close()
            with contextlib.suppress(RuntimeError):  # the interpreter ends, and no thread can be started
                threading.Thread(target=self._end, name="elib view ends").start()

    def _end(self) -> None:
        try:
            self._process.wait(END_TIME)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _read(self) -> None:
        """Take the lines of the process: first what it offers, then what it has to say."""
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for line in lines:
                if self.page:
                    sys.stderr.write(line)
                else:
                    self._lines.put(line.rstrip())
        self._lines.put("")

    def _wait(self) -> None:
        said: list[str] = []
        while not self.page:
            try:
                line = self._lines.get(timeout=START_TIME)
            except queue.Empty:
                raise SimulationError(f"the view did not start within {START_TIME:g} s") from None
            if not line:
                self._lines.put("")  # for the next one who asks
                text, _, hint = "\n".join(said).removeprefix("error: ").partition("\nhint: ")
                raise SimulationError(f"the view could not be started: {text or 'it said nothing'}", hint=hint)
            said.append(line)
            name, _, url = line.partition(" ")
            if name == "view":
                self.page = url
            elif name.startswith("epuck-"):
                self.robots.append(url)


async def open_watched(url: Url, settings: SimulationSettings) -> StreamTransport:
    """Connect to a robot of a world that is shown live; the first connection starts it, and the last one ends it.

    Raises:
        Unsupported: The packages of the page are not installed.
        SimulationError: The simulation could not be started.
        LinkBusy: The robot is open already.
    """
    check_web()
    name = str(url)
    key = str(Url("sim", settings.world, tuple(item for item in url.query if item[0] != "robot")))
    world = _worlds.get(key)
    if world is not None and world.users and settings.robot is None:
        world, key = None, f"{key} {id(settings)}"  # as without a view: each opening has a world of its own
    if world is None or not world.is_running:
        world = _worlds[key] = WatchedWorld(settings)
    if any(each.url == name for each in world.users):
        raise LinkBusy(f"{name} is open already", hint="close it first, or leave robot= out for a new world")
    is_wifi = profile_named(settings.firmware).codec == "wifi"
    transport = (_WatchedWifi if is_wifi else _Watched)(name, origin="simulator")
    transport.join(world, key)
    try:
        await asyncio.to_thread(world.start)
        host, _, port = parse_url(world.robots[(settings.robot or 1) - 1]).target.rpartition(":")
        refused = "did somebody end the process elib simulate?"
        return await connect_tcp(transport, host, int(port), silent=ONE_AT_A_TIME, refused=refused)
    except BaseException:
        transport.abort()
        raise


class _Watched(StreamTransport):
    """The program's end of the cable to a robot of a watched world."""

    def join(self, world: WatchedWorld, key: str) -> None:
        """Keep the world running as long as this is open."""
        self._world, self._key = world, key
        world.users.add(self)

    def _mark_closed(self) -> None:
        super()._mark_closed()
        self._world.users.discard(self)
        lease = lease_of(self._url, asyncio.get_running_loop())
        if lease is not None:  # the program will open it again
            lease.on_end.append(self._leave)
        else:
            self._leave()

    def _leave(self) -> None:
        lease = lease_of(self._url, asyncio.get_running_loop())
        if lease is not None and self._leave in lease.on_end:
            lease.on_end.remove(self._leave)
        if not self._world.users:
            self._world.close()
            if _worlds.get(self._key) is self._world:
                del _worlds[self._key]


class _WatchedWifi(_Watched, WifiTransport):
    """The same for a robot on Wi-Fi."""


def _keys(settings: SimulationSettings) -> dict[str, object]:
    """Return the settings that differ from the usual ones, as options of ``elib simulate``."""
    usual = dataclasses.asdict(SimulationSettings())
    return {
        key: value
        for key, value in dataclasses.asdict(settings).items()
        if key not in ("world", "robot", "view") and value != usual[key]
    }
