"""Virtual robots that are served as ``elib simulate`` serves them, in real time, and what their wheels do."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import threading
from collections.abc import AsyncIterator, Iterator

from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.wifi import WifiEmulator
from shared import until, wait_until


class ServedRobot:
    """A robot that another program can open.

    Attributes:
        url: What opens it.
    """

    def __init__(self, url: str, control: Control) -> None:
        simulation = control.simulation
        self.url = url
        self.link = simulation.robots[0].link
        self._control = control
        self._loop = asyncio.get_running_loop()
        self._start, self._way = control.snapshot().robots[0].pose, 0.0
        self._robot = simulation.robots[0].emulator

    @property
    def is_turning(self) -> bool:
        """Whether a wheel turns."""
        return any(motor.speed for motor in self._robot.firmware.motors)

    @property
    def way(self) -> float:
        """How far it was from where it was at first, m, at the last question; this one begins a new look."""
        self._loop.call_soon_threadsafe(self._look)
        return self._way

    def _look(self) -> None:
        pose = self._control.snapshot().robots[0].pose
        self._way = max(self._way, math.hypot(pose.x - self._start.x, pose.y - self._start.y))

    @property
    def stands(self) -> bool:
        """Whether the robot stands, and nothing is on its way to it that may drive it again."""
        return not self.is_turning and not self.link._inbound and self._has_heard_all

    @property
    def _has_heard_all(self) -> bool:
        if isinstance(self._robot, WifiEmulator):  # it is never idle, because it streams
            return not self._robot.unread
        return self._robot.is_idle

    async def until_it_stands(self) -> None:
        await until(lambda: self.stands)


@contextlib.asynccontextmanager
async def served(way: str, **keys: str) -> AsyncIterator[ServedRobot]:
    """Serve a robot on *way*: ``pty``, ``tcp`` or ``wifi``."""
    controls: list[Control] = []
    settings = SimulationSettings.from_text("arena", keys)
    tcp, wifi = "0" if way == "tcp" else None, "127.0.0.1:0" if way == "wifi" else None
    async with serve(settings, pty=way == "pty", tcp=tcp, wifi=wifi, control=controls.append) as robots:
        yield ServedRobot(robots[0].url, controls[0])


@contextlib.contextmanager
def served_from_a_thread(way: str, **keys: str) -> Iterator[ServedRobot]:
    """Serve a robot from a thread of its own, so that the test may block."""
    found: list[ServedRobot] = []
    errors: list[BaseException] = []
    loop, over = asyncio.new_event_loop(), asyncio.Event()

    async def main() -> None:
        async with served(way, **keys) as robot:
            found.append(robot)
            await over.wait()

    def run() -> None:
        try:
            loop.run_until_complete(main())
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        wait_until(lambda: found or errors)
        assert not errors, errors
        yield found[0]
    finally:
        loop.call_soon_threadsafe(over.set)
        thread.join()
        loop.close()


def is_suspended(process: int) -> bool:
    """Return whether a process of this one was suspended by a signal, and not continued since."""
    return os.waitid(os.P_PID, process, os.WSTOPPED | os.WNOHANG | os.WNOWAIT) is not None
