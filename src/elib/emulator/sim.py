"""``sim://``: a virtual robot inside the program that drives it."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from elib.emulator import lost
from elib.emulator.battery import DrainedHardware
from elib.emulator.emulator import Emulator
from elib.emulator.fixed import FixedHardware
from elib.emulator.hardware import Hardware
from elib.emulator.link import Link
from elib.emulator.player import FaultPlayer
from elib.emulator.simulated import EPUCK1, EPUCK1_HW13, EPUCK2, Build, SimulatedHardware
from elib.emulator.weatherfile import load
from elib.errors import SimulationError
from elib.physics.world import World
from elib.protocol.profiles import profile_named
from elib.timebase import ScaledLoop, SimulatedLoop, Speed
from elib.transport.keeping import stay_of
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
        loop: The event loop whose time it shares.
        world: The world, or None where a file of constant readings replaces it.
        hardware: The bodies of the connected robots.
        emulators: Their programs, booted.
        links: Their links, not attached to anything yet.
        weather: The fault scripts at work on the links, one for each; none where no script was asked for.

    Raises:
        LinkNotFound: There is no such world.
        ArgumentError: There is no such firmware or fault script, or the hardware file is wrong.
        SimulationError: The world's file or the fault script breaks a rule.
    """

    def __init__(self, settings: SimulationSettings, *, connected: int | None = None) -> None:
        profile_named(settings.firmware)
        script = None if settings.fault is None else load(settings.fault)
        self.settings = settings
        self.loop = asyncio.get_running_loop()
        self._origin = self.loop.time()
        self._heartbeat: asyncio.TimerHandle | None = None
        count = settings.robots or 1
        self.world: World | None = None
        self.hardware: list[Hardware] = []
        if settings.hardware is None:
            self.world = World.load(settings.world, robots=settings.robots, seed=settings.seed)
            count = len(self.world.poses)
            if not count:
                raise SimulationError(
                    f"the world {settings.world} has no robot", hint="add a [[robot]] to it, or ask for robots=1"
                )
        for index in range(count if connected is None else min(connected, count)):
            self.hardware.append(self._body(index))
        self.emulators = [Emulator(settings.firmware, body, baud=settings.baud, booted=True) for body in self.hardware]
        self.links = [self._link(emulator, index) for index, emulator in enumerate(self.emulators)]
        self.weather: list[FaultPlayer] = []
        if script is not None:
            for index, (link, body) in enumerate(zip(self.links, self.hardware, strict=True)):
                self.weather.append(FaultPlayer(link, script, robot=index, seed=settings.seed))
                if isinstance(body, DrainedHardware):
                    body.volts = self.weather[-1].read_volts
        if self.world is not None and not isinstance(self.loop, SimulatedLoop):
            self._beat()

    @property
    def time(self) -> float:
        """Time since the simulation began, s."""
        return self.loop.time() - self._origin

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
        for player in self.weather:
            player.close()
        for link in self.links:
            link.close()

    def _body(self, index: int) -> Hardware:
        if self.world is None:
            return FixedHardware.load(self.settings.hardware or "", firmware=self.settings.firmware)
        kind = SimulatedHardware if self.settings.fault is None else DrainedHardware
        return kind(self.world, index, build=BODIES[self.settings.firmware])

    def _link(self, emulator: Emulator, index: int) -> Link:
        settings = self.settings
        latency = settings.latency
        if settings.baud == 0 and isinstance(self.loop, SimulatedLoop):
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
        self._heartbeat = self.loop.call_later(HEARTBEAT, self._beat)


class SimTransport(MemoryTransport):
    """The program's end of the cable to a virtual robot.

    Attributes:
        simulation: World, emulators and links behind it, for demos and tests.
    """

    def __init__(self, url: str, simulation: Simulation) -> None:
        super().__init__(url, origin="simulator")
        self.simulation = simulation

    def lose(self, message: str, *, hint: str = "") -> None:
        """Mark the link as lost; the robot and its world go on and wait for the same URL to be opened again."""
        was_open = self.is_open
        super().lose(message, hint=hint)
        if was_open:
            lost.wait(self._url, self.simulation)

    def abort(self) -> None:
        """Pull the cable and end the simulation; the world stays as it is then.

        It goes on if the link had broken, if the program gave up a robot that its fault script keeps from answering,
        and while somebody means to come back (:func:`elib.transport.keeping.keep`).
        """
        was_open = self.is_open
        super().abort()
        if not was_open:
            return
        is_given_up = any(not player.is_reachable for player in self.simulation.weather[:1])
        if is_given_up or stay_of(self._url, self.simulation.loop) is not None:
            lost.wait(self._url, self.simulation)
        else:
            self.simulation.close()


async def open_sim(url: Url) -> SimTransport:
    """Connect to a virtual robot, which is booted already: one whose link broke, or the first one of a new world.

    A simulation whose link broke, with a :meth:`~elib.emulator.link.Link.cut` or by its fault script, waits 60 s of
    loop time for its URL to be opened again on the same event loop.

    Raises:
        SimulationError: The running event loop cannot run at the speed asked for, or a file breaks a rule.
        LinkNotFound: There is no such world, or the fault script has cut the link and it is not yet over.
        ArgumentError: A value is out of its range, or there is no such fault script.
    """
    settings = simulation_of(url)
    require_speed(settings.speed)
    name = str(url)
    simulation = lost.find(name) or Simulation(settings, connected=1)
    transport, end = SimTransport(name, simulation), MemoryTransport(name)
    if simulation.weather:
        player = simulation.weather[0]
        player.on_cut = lambda: transport.lose(
            f"{name}: the link was cut at {player.time:.3g} s, as the fault script says",
            hint="open it again when that is over",
        )
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
