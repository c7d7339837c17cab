"""``sim://``: a virtual robot inside the program that drives it."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from elib.emulator.emulator import Emulator
from elib.emulator.fixed import FixedHardware
from elib.emulator.hardware import Hardware
from elib.emulator.link import Link
from elib.emulator.simulated import EPUCK1, EPUCK1_HW13, EPUCK2, Build, SimulatedHardware
from elib.errors import SimulationError, Unsupported
from elib.physics.world import World
from elib.protocol.profiles import profile_named
from elib.timebase import ScaledLoop, SimulatedLoop, Speed
from elib.transport.memory import MemoryTransport
from elib.transport.simulation import SimulationSettings
from elib.transport.url import Url, simulation_of

HEARTBEAT = 0.1
"""Seconds of loop time between two looks at the clock while nobody talks to the robots.

Without them the first command after an idle hour would wait for an hour of physics.
"""

INSTANT = 1e-6
"""Least delay of an unpaced link in simulated time, s.

Without it a program that only asks would ask for ever at the same instant.
"""

BODIES: Mapping[str, Build] = MappingProxyType(
    {
        "btcom-1.1.3": EPUCK1,
        "btcom-2.0": EPUCK1,
        # The later camera sits upright; this firmware does not mirror it, so its pictures come half turned
        # (protocol.md, 3.2, orientation).
        "asercom-1.2.2": replace(EPUCK1_HW13, camera_chip=0x8030, mounted="half-turn"),
        "epuck2": EPUCK2,
    }
)
"""Which robot a firmware runs on."""


class Simulation:
    """A world, its robots and the time they share, on the running event loop.

    Args:
        settings: What to build.
        connected: How many of the robots get an emulator and a link, the first ones; None for all. The others
            stand still.

    Attributes:
        settings: What it was built from.
        world: The world, or None where a file of constant readings replaces it.
        hardware: The bodies of the connected robots.
        emulators: Their programs, booted.
        links: Their links, not attached to anything yet.

    Raises:
        LinkNotFound: There is no such world.
        ArgumentError: There is no such firmware, or the hardware file is wrong.
        SimulationError: The world's file breaks a rule.
        Unsupported: A fault script was asked for.
    """

    def __init__(self, settings: SimulationSettings, *, connected: int | None = None) -> None:
        if settings.fault is not None:
            raise Unsupported(
                f"fault={settings.fault}: fault scripts come in a later version",
                hint="until then, order faults in Python: transport.simulation.links[0].faults",
            )
        profile_named(settings.firmware)
        self.settings = settings
        self._loop = asyncio.get_running_loop()
        self._origin = self._loop.time()
        self._heartbeat: asyncio.TimerHandle | None = None
        count = settings.robots or 1
        self.world: World | None = None
        self.hardware: list[Hardware] = []
        if settings.hardware is None:
            self.world = World.load(settings.world, robots=settings.robots, seed=settings.seed)
            count = len(self.world.poses)
        for index in range(count if connected is None else min(connected, count)):
            self.hardware.append(self._body(index))
        self.emulators = [Emulator(settings.firmware, body, baud=settings.baud, booted=True) for body in self.hardware]
        self.links = [self._link(emulator, index) for index, emulator in enumerate(self.emulators)]
        if self.world is not None and not isinstance(self._loop, SimulatedLoop):
            self._beat()

    @property
    def time(self) -> float:
        """Time since the simulation began, s."""
        return self._loop.time() - self._origin

    def catch_up(self) -> None:
        """Let everything happen that is due by now, before looking at the world."""
        now = self.time
        for link, body in zip(self.links, self.hardware, strict=True):
            link.catch_up()
            body.advance(now)

    def close(self) -> None:
        """Stop everything; the ends of the links are closed."""
        if self._heartbeat is not None:
            self._heartbeat.cancel()
            self._heartbeat = None
        for link in self.links:
            link.close()

    def _body(self, index: int) -> Hardware:
        if self.world is None:
            return FixedHardware.load(self.settings.hardware or "")
        return SimulatedHardware(self.world, index, build=BODIES[self.settings.firmware])

    def _link(self, emulator: Emulator, index: int) -> Link:
        settings = self.settings
        latency = settings.latency
        if settings.baud == 0 and isinstance(self._loop, SimulatedLoop):
            latency = max(latency, INSTANT)
        return Link(
            emulator,
            latency=latency,
            jitter=settings.jitter,
            loss=settings.loss,
            seed=(settings.seed or 0) + index,
            baud=settings.baud,
            origin=self._origin,
        )

    def _beat(self) -> None:
        self.catch_up()
        self._heartbeat = self._loop.call_later(HEARTBEAT, self._beat)


class SimTransport(MemoryTransport):
    """The program's end of the cable to a virtual robot.

    Attributes:
        simulation: World, emulators and links behind it, for demos and tests.
    """

    def __init__(self, url: str, simulation: Simulation) -> None:
        super().__init__(url, origin="simulator")
        self.simulation = simulation

    def abort(self) -> None:
        """Pull the cable and end the simulation; the world stays as it is then."""
        super().abort()
        self.simulation.close()


async def open_sim(url: Url) -> SimTransport:
    """Build the world that *url* describes and connect to its first robot, which is booted already.

    Raises:
        SimulationError: The running event loop cannot run at the speed asked for.
        LinkNotFound: There is no such world.
        ArgumentError: A value is out of its range.
        Unsupported: A fault script was asked for.
    """
    settings = simulation_of(url)
    require_speed(settings.speed)
    simulation = Simulation(settings, connected=1)
    transport, end = SimTransport(str(url), simulation), MemoryTransport(str(url))
    transport.join(end)
    simulation.links[0].attach(end)
    return transport


def require_speed(speed: Speed) -> None:
    """Check that the running event loop runs at *speed*; ``"real"`` means as the loop does.

    Raises:
        SimulationError: It does not.
    """
    loop = asyncio.get_running_loop()
    if speed == "real" or (speed == "max" and isinstance(loop, SimulatedLoop)):
        return
    if isinstance(loop, ScaledLoop) and loop.factor == speed:
        return
    runs = "simulated time" if isinstance(loop, SimulatedLoop) else "real time"
    if isinstance(loop, ScaledLoop):
        runs = f"{loop.factor:g} times real time"
    raise SimulationError(
        f"speed={speed} needs an event loop made for it, but this one runs in {runs}",
        hint="let elib.connect() or elib.run() choose the loop, or leave speed out",
    )
