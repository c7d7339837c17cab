"""``sim://``: a virtual robot inside the program that drives it."""

from __future__ import annotations

import asyncio
import weakref
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from elib.emulator import lost
from elib.emulator.emulator import Emulator
from elib.emulator.fixed import FixedHardware
from elib.emulator.hardware import Hardware
from elib.emulator.link import Link
from elib.emulator.player import FaultPlayer
from elib.emulator.robotprofile import RobotProfile, written
from elib.emulator.robotprofile import load as load_profile
from elib.emulator.simulated import EPUCK1, EPUCK1_HW13, EPUCK2, Build, SimulatedHardware
from elib.emulator.virtual import VirtualRobot, switch_on
from elib.errors import ArgumentError, LinkBusy, LinkLost, SimulationError
from elib.physics.scene import Scene
from elib.physics.world import World
from elib.physics.worldfile import source_of
from elib.pose import Pose
from elib.protocol.profiles import profile_named
from elib.timebase import SimulatedLoop, require_speed
from elib.transport import several
from elib.transport.keeping import stay_of
from elib.transport.memory import MemoryTransport
from elib.transport.simulation import SimulationSettings
from elib.transport.url import Url, simulation_of

HEARTBEAT = 0.1
"""Seconds of loop time between two looks at the clock while nobody talks to the robots.

Without them the first command after an idle hour would wait for an hour of physics.
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
            stand still until :meth:`take` asks for them.

    Attributes:
        settings: What it was built from.
        profile: What sets its robots apart from nominal ones.
        loop: The event loop whose time it shares.
        origin: Time of that loop when the simulation began, s.
        world: The world, or None where a file of constant readings replaces it.
        count: How many robots there are.
        names: Of all robots, in order.
        robots: Those that have an emulator and a link, by index.

    Raises:
        LinkNotFound: There is no such world.
        ArgumentError: There is no such firmware, fault script or robot profile, or the hardware file is wrong.
        SimulationError: The world's file, the fault script or the robot profile breaks a rule.
    """

    def __init__(self, settings: SimulationSettings, *, connected: int | None = None) -> None:
        profile_named(settings.firmware)
        self.settings = settings
        self.profile = RobotProfile() if settings.profile is None else load_profile(settings.profile)
        self.loop = asyncio.get_running_loop()
        self.origin = self.loop.time()
        self._heartbeat: asyncio.TimerHandle | None = None
        self._taken: set[int] = set()
        self.count = settings.robots or 1
        self.world: World | None = None
        self.robots: dict[int, VirtualRobot] = {}
        if settings.hardware is None:
            scene = Scene.load(settings.world, robots=settings.robots)
            if settings.profile is not None:
                scene = replace(scene, model=self.profile.model(scene.model))
            self.world = World(scene, robots=settings.robots, seed=settings.seed)
            self.count = self.world.robots
            if not self.count:
                raise _empty(settings)
        self.names = tuple(f"epuck-{index + 1}" for index in range(self.count))
        if self.world is not None:
            self.world.name_robots(self.names)
        for index in range(self.count if connected is None else min(connected, self.count)):
            self._build(index, settings)
        if self.world is not None and not isinstance(self.loop, SimulatedLoop):
            self._beat()

    @property
    def hardware(self) -> list[Hardware]:
        """The bodies of the robots that have an emulator, in their order."""
        return [robot.hardware for robot in self._in_order()]

    @property
    def emulators(self) -> list[Emulator]:
        """Their programs."""
        return [robot.emulator for robot in self._in_order()]

    @property
    def links(self) -> list[Link]:
        """Their links."""
        return [robot.link for robot in self._in_order()]

    @property
    def weather(self) -> list[FaultPlayer]:
        """The fault scripts at work on the links, one for each; none where no script was asked for."""
        return [robot.player for robot in self._in_order() if robot.player is not None]

    @property
    def time(self) -> float:
        """Time since the simulation began, s."""
        return self.loop.time() - self.origin

    def catch_up(self) -> None:
        """Let everything happen that is due by now, before looking at the world."""
        for robot in self.robots.values():
            robot.link.catch_up()
            robot.hardware.advance(robot.link.now)
        if self.world is not None:
            self.world.run_to(self.time)

    def take(self, index: int, settings: SimulationSettings, url: str) -> VirtualRobot:
        """Return a robot for the program that opens *url*, whose it is until :meth:`release`.

        Args:
            index: Which one, from 0.
            settings: How it is to be built, if it is not yet: firmware, link and fault script.
            url: For messages.

        Raises:
            ArgumentError: There is no such robot, or it was built otherwise.
            LinkBusy: Another program has it.
            LinkNotFound: Its link is cut.
        """
        if not 0 <= index < self.count:
            raise ArgumentError(f"{url}: the world has {self.count} robots, counted from 1")
        robot = self.robots.get(index) or self._build(index, settings)
        if _own(robot.settings) != _own(settings):
            raise ArgumentError(
                f"{url}: robot {index + 1} of this world was opened with another firmware or link before",
                hint="open it by the same URL each time, or give a world of its own another seed",
            )
        if index in self._taken and not lost.find_in(self, index):
            raise LinkBusy(
                f"{url} is open already on this event loop", hint="close it first, or leave robot= out: a world anew"
            )
        robot.check_link(url)
        self._taken.add(index)
        return robot

    def release(self, index: int) -> None:
        """Take note that nobody has a robot any more, or waits for it; the last one ends the simulation."""
        self._taken.discard(index)
        if not self._taken:
            self.close()

    def close(self) -> None:
        """Stop everything; the ends of the links are closed."""
        _SHARED.discard(self)
        if self._heartbeat is not None:
            self._heartbeat.cancel()
            self._heartbeat = None
        for robot in self._in_order():
            robot.close()

    def _in_order(self) -> list[VirtualRobot]:
        return [self.robots[index] for index in sorted(self.robots)]

    def _build(self, index: int, settings: SimulationSettings) -> VirtualRobot:
        """Give a robot its program and its link."""
        # What the world says of a robot goes before what a URL says of all.
        named = () if self.world is None else self.world.scene.firmware
        firmware = (named[index] if index < len(named) else "") or settings.firmware
        profile_named(firmware)
        robot = switch_on(index, self._body(index, firmware, settings), firmware, self._with_link(settings))
        robot.settings = settings
        self.robots[index] = robot
        return robot

    def _with_link(self, settings: SimulationSettings) -> SimulationSettings:
        """Return *settings* with the profile's link where they do not say another."""
        link = self.profile.link
        if link is None:
            return settings
        return replace(settings, latency=settings.latency or link.latency, jitter=settings.jitter or link.jitter)

    def _body(self, index: int, firmware: str, settings: SimulationSettings) -> Hardware:
        if self.world is None:
            return FixedHardware.load(settings.hardware or "", firmware=firmware)
        return SimulatedHardware(self.world, index, build=BODIES[firmware], switched_on=self.time, profile=self.profile)

    def _beat(self) -> None:
        self.catch_up()
        self._heartbeat = self.loop.call_later(HEARTBEAT, self._beat)


_SHARED: weakref.WeakSet[Simulation] = weakref.WeakSet()
"""Those whose robots are opened one by one, with ``robot=``."""


def _world_of(settings: SimulationSettings) -> tuple[object, ...]:
    """Return what the robots of one world have in common."""
    return settings.world, settings.seed, settings.robots, settings.hardware, settings.profile


def _own(settings: SimulationSettings) -> SimulationSettings:
    """Return what each robot of a world may have for itself."""
    return replace(settings, robot=None, speed="real")


def _empty(settings: SimulationSettings) -> SimulationError:
    return SimulationError(
        f"the world {settings.world} has no robot", hint="add a [[robot]] to it, or ask for robots=1"
    )


class SimTransport(MemoryTransport):
    """The program's end of the cable to a virtual robot.

    Attributes:
        simulation: World, emulators and links behind it, for demos and tests.
        robot: The one it leads to.
    """

    def __init__(self, url: str, simulation: Simulation, robot: VirtualRobot) -> None:
        super().__init__(url, origin="simulator")
        self.simulation = simulation
        self.robot = robot

    def describe(self) -> dict[str, str]:
        """Return what a recording says of the simulation: world by name and as TOML, seed, which robot, profile."""
        settings, world = self.simulation.settings, self.simulation.world
        found = {"robot_index": str(self.robot.index)}
        if world is not None:
            content, _ = source_of(settings.world)
            found |= {"world": settings.world, "seed": str(world.seed), "robots": str(self.simulation.count)}
            found["scene"] = content.decode("utf-8", "replace")
        if settings.profile is not None:
            found["profile"] = written(self.simulation.profile)
        return found

    def observe(self) -> tuple[Pose, dict[str, object]] | None:
        """Return where the robot is, and where everything stands that can move; None without a world.

        It is the world as it was computed last, at most a step before now while the robot is talked to.
        """
        world = self.simulation.world
        if world is None:
            return None
        seen = world.snapshot()
        time = self.simulation.origin + world.time
        pose = replace(seen.robots[self.robot.index].pose, time=time)
        return pose, {
            "tick": seen.tick,
            "robots": [_place(each.pose) for each in seen.robots],
            "boxes": [[box.x, box.y, box.angle] for box in seen.boxes],
            "cylinders": [[post.x, post.y] for post in seen.cylinders],
        }

    def lose(self, message: str, *, hint: str = "", kind: type[LinkLost] = LinkLost) -> None:
        """Mark the link as lost; the robot and its world go on and wait for the same URL to be opened again."""
        was_open = self.is_open
        super().lose(message, hint=hint, kind=kind)
        if was_open:
            lost.wait(self._url, self.simulation, self.robot.index)

    def abort(self) -> None:
        """Pull the cable; with the last one the simulation ends, and the world stays as it is then.

        It goes on if the link had broken, if the program gave up a robot that its fault script keeps from answering,
        and while somebody means to come back (:func:`elib.transport.keeping.keep`).
        """
        was_open = self.is_open
        super().abort()
        if not was_open:
            return
        index = self.robot.index
        if not self.robot.is_reachable or stay_of(self._url, self.simulation.loop) is not None:
            lost.wait(self._url, self.simulation, index)
        else:
            self.simulation.release(index)


def _place(pose: Pose) -> list[float]:
    return [pose.x, pose.y, pose.heading]


def robots_of(url: Url) -> list[Url]:
    """Return what opens each robot of the world that *url* names; the URL itself if that is one robot.

    Raises:
        LinkNotFound: There is no such world.
        SimulationError: The world's file breaks a rule, or it has no robot.
    """
    settings = simulation_of(url)
    if settings.robot is not None:
        return [url]
    count = settings.robots
    if count is None:
        count = 1 if settings.hardware is not None else len(Scene.load(settings.world).starts)
        if not count:
            raise _empty(settings)
    if count == 1:
        return [url]
    return [replace(url, query=(*url.query, ("robot", str(number)))) for number in range(1, count + 1)]


@several(robots_of)
async def open_sim(url: Url) -> SimTransport:
    """Connect to a virtual robot, which is booted already: one whose link broke, or the first one of a new world.

    With ``robot=N`` it is that one of the world that all who say so on this event loop share; the first of them
    begins it and the last one to leave ends it.

    A simulation whose link broke, with a :meth:`~elib.emulator.link.Link.cut` or by its fault script, waits 60 s of
    loop time for its URL to be opened again on the same event loop.

    Raises:
        SimulationError: The running event loop cannot run at the speed asked for, or a file breaks a rule.
        LinkNotFound: There is no such world, or the fault script has cut the link and it is not yet over.
        LinkBusy: That robot of the shared world is open already.
        ArgumentError: A value is out of its range, or there is no such fault script.
    """
    settings = simulation_of(url)
    require_speed(settings.speed)
    name = str(url)
    simulation, robot = _find_own(name, settings) if settings.robot is None else _find_shared(name, settings)
    transport, end = SimTransport(name, simulation, robot), MemoryTransport(name)
    player = robot.player
    if player is not None:
        player.on_cut = lambda: transport.lose(
            f"{name}: the link was cut at {player.time:.3g} s, as the fault script says",
            hint="open it again when that is over",
        )
    transport.join(end)
    robot.link.attach(end)
    return transport


def _find_own(name: str, settings: SimulationSettings) -> tuple[Simulation, VirtualRobot]:
    simulation = lost.find(name)
    if simulation is not None:
        return simulation, simulation.robots[0]
    simulation = Simulation(settings, connected=1)
    return simulation, simulation.take(0, settings, name)


def _find_shared(name: str, settings: SimulationSettings) -> tuple[Simulation, VirtualRobot]:
    loop, index = asyncio.get_running_loop(), (settings.robot or 1) - 1
    running = (each for each in _SHARED if each.loop is loop and _world_of(each.settings) == _world_of(settings))
    simulation = next(running, None)
    if simulation is not None:
        return simulation, simulation.take(index, settings, name)
    simulation = Simulation(settings, connected=0)
    try:
        robot = simulation.take(index, settings, name)
    except BaseException:
        simulation.close()
        raise
    _SHARED.add(simulation)
    return simulation, robot
