"""A simulation: a world, its robots with their firmwares and links, and the time they share."""

from __future__ import annotations

import asyncio
import itertools
import math
import weakref
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TypedDict

from elib.base.errors import ArgumentError, LinkBusy, LinkNotFound, SimulationError
from elib.base.timebase import SimulatedLoop
from elib.link.protocol.profiles import profile_named
from elib.link.transport.lease import UrlLease, lease_of
from elib.simulator.emulator.clock import WorldClock
from elib.simulator.emulator.emulator import Emulator
from elib.simulator.emulator.faultplayer import FaultPlayer
from elib.simulator.emulator.faults import ManualFaults
from elib.simulator.emulator.faultscript import load as load_script
from elib.simulator.emulator.firmware import WIFI_FIRMWARES, firmware_named
from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.hardware import Hardware
from elib.simulator.emulator.link import Link
from elib.simulator.emulator.past import Past
from elib.simulator.emulator.robotprofile import RobotProfile, load_profile
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.simulated_hardware import SimulatedHardware
from elib.simulator.emulator.wifi import WifiEmulator
from elib.simulator.emulator.wifi_link import WifiLink
from elib.simulator.physics.defects import Defect
from elib.simulator.physics.placement import cleared
from elib.simulator.physics.scene import Scene
from elib.simulator.physics.world import World

HEARTBEAT = 0.1
"""Seconds of loop time between two looks at the clock while no program talks to the robots.

Without them the first command after an idle hour would wait for an hour of physics.
"""

MIN_DELAY = 1e-6
"""Least delay of an unpaced link in simulated time, s.

Without it a program that only asks would ask for ever at the same instant.
"""

RECONNECT_TIMEOUT = 60.0
"""Seconds of loop time for which a robot waits for its program, counted from the last attempt to open it or, if later,
the end of its outage."""


class _LinkOptions(TypedDict):
    latency: float
    jitter: float
    loss: float
    seed: int
    clock: WorldClock


@dataclass(slots=True, eq=False)
class VirtualRobot:
    """One robot of a simulation that programs can talk to."""

    index: int  # its place in the world, from 0
    settings: SimulationSettings  # the settings that it was built from
    firmware: str  # name of its firmware
    hardware: Hardware  # its simulated or fixed hardware
    emulator: Emulator  # the emulator of its firmware, booted
    link: Link  # the link between the robot and its program
    manual_faults: ManualFaults  # what Control does to its answers
    player: FaultPlayer | None = None  # the fault script that runs on the link, if there is one
    # What is broken in it, by who broke it: a kind of fault of its script, or a hand.
    defects: dict[str, tuple[Defect, ...]] = field(default_factory=dict)

    @property
    def broken(self) -> list[Defect]:
        """Everything that is broken in it now."""
        return [defect for each in self.defects.values() for defect in each]

    def break_parts(self, by: str, defects: Sequence[Defect]) -> None:
        """Break these parts of it, and mend what *by* broke before: a SimulationError if its readings are constant."""
        if not isinstance(self.hardware, SimulatedHardware):
            raise SimulationError("constant readings have no parts that break", hint="leave --hardware out")
        self.link.catch_up()
        self.emulator.let_world_run(self.link.now)
        now = self.defects | {by: tuple(defects)}
        self.emulator.pace = self.hardware.set_defects([defect for each in now.values() for defect in each])
        self.defects = now

    @property
    def opens_in(self) -> float:
        """Seconds until its link can be opened: 0 if it can, infinite if it never can or that is unknown."""
        if "hand" in self.link.down_by:
            return math.inf
        return 0.0 if self.player is None else self.player.mends_in

    @property
    def is_reachable(self) -> bool:
        """Whether its fault script lets a program talk to it at the moment."""
        return self.player is None or self.player.is_reachable

    def check_link(self, url: str) -> None:
        """Raise LinkNotFound if the link that *url* asks for is down."""
        if "hand" in self.link.down_by:
            raise LinkNotFound(
                f"{url}: the robot is there, but its link was cut by hand", hint="mend it where it was cut"
            )
        opens_in = self.opens_in
        if opens_in > 0:
            until = f"for another {opens_in:.3g} s" if math.isfinite(opens_in) else "for good"
            raise LinkNotFound(
                f"{url}: the robot is there, but its fault script has cut the link {until}", hint="try again later"
            )

    def close(self) -> None:
        """Stop its script; the end of its link is closed."""
        if self.player is not None:
            self.player.close()
        self.link.close()


class Simulation:
    """A world, its robots and the time they share, on the running event loop.

    Args:
        settings: What to build.
        is_connected: Whether all robots get an emulator and a link now; otherwise each stands still until :meth:`take`
            asks for it.
        is_shared: Whether its robots are opened one by one, with ``robot=``.
        scene: The world, instead of the one that the settings name.

    Raises:
        LinkNotFound: There is no such world.
        ArgumentError: There is no such firmware, fault script or robot profile, or the hardware file is wrong.
        SimulationError: The world's file, the fault script or the robot profile breaks a rule.
    """

    def __init__(
        self,
        settings: SimulationSettings,
        *,
        is_connected: bool = True,
        is_shared: bool = False,
        scene: Scene | None = None,
    ) -> None:
        profile_named(settings.firmware)
        self.settings = settings  # what it was built from
        self.is_shared = is_shared
        # how its robots differ from nominal ones
        self.profile = RobotProfile() if settings.profile is None else load_profile(settings.profile)
        self.loop = asyncio.get_running_loop()  # the event loop whose time it shares
        # the time of its world; it is the loop's until somebody pauses it or changes its speed
        self.clock = WorldClock(self.loop)
        self.origin = self.clock.time()  # time of that clock when the simulation began, s
        self._heartbeat: asyncio.TimerHandle | None = None
        self._taken: set[int] = set()
        self.waiting: dict[int, Waiting] = {}  # robots that lost their program and wait for it, by index
        self.count = settings.robots or 1  # how many robots there are
        self.world: World | None = None  # the world, or None where a file of constant readings replaces it
        self.past = Past()  # its last minute, as far as somebody looked
        self.robots: dict[int, VirtualRobot] = {}  # robots that have an emulator and a link, by index from 0
        if settings.hardware is None:
            scene = scene or Scene.load(settings.world, robots=settings.robots)
            if settings.profile is not None:
                scene = replace(scene, model=self.profile.model(scene.model))
            if settings.quality is not None:
                scene = replace(scene, model=replace(scene.model, quality=settings.quality))
            self.world = World(scene, robots=settings.robots, seed=settings.seed)
            self._first_scene = scene
            self.count = self.world.robots
            if not self.count:
                raise no_robot(settings)
        self.names = tuple(f"epuck-{index + 1}" for index in range(self.count))  # names of all robots, in order
        if self.world is not None:
            self.world.name_robots(self.names)
        for index in range(self.count if is_connected else 0):
            self._build(index, settings)
        if self.world is not None and not isinstance(self.loop, SimulatedLoop):
            self._beat()
        _RUNNING.add(self)
        for each in on_begin:
            each(self)

    @property
    def time(self) -> float:
        """Time since the simulation began, s."""
        return self.clock.time() - self.origin

    @property
    def is_rebuilt(self) -> bool:
        """Whether boxes or walls were added, moved or removed by hand since it began."""
        return self.world is not None and self.world.scene is not self._first_scene

    def step(self, seconds: float) -> None:
        """Go on by some seconds at once, tick by tick, while paused.

        Raises:
            ArgumentError: The world is not paused.
        """
        tick = seconds if self.world is None else self.world.scene.step
        for _ in range(max(1, round(seconds / tick))):
            self.change_clock(lambda: self.clock.step(tick))

    def change_clock(self, change: Callable[[], None]) -> None:
        """Change the clock by ``change()``, and set all timers again."""
        self.catch_up()
        change()
        for robot in self.robots.values():
            robot.link.rearm()
            if robot.player is not None:
                robot.player.rearm()
        self.catch_up()

    def catch_up(self) -> None:
        """Let everything happen that is due by now, before looking at the world."""
        for robot in self.robots.values():
            robot.link.catch_up()
            robot.hardware.advance(robot.link.now)
        if self.world is not None:
            self.world.run_to(self.time)

    def take(self, index: int, settings: SimulationSettings, url: str) -> VirtualRobot:
        """Return a robot for the program that opens *url*; it belongs to that program until :meth:`release`.

        Args:
            index: Index of the robot, from 0.
            settings: How to build it, if it is not built yet: firmware, link and fault script.
            url: For messages.

        Raises:
            ArgumentError: There is no such robot, or it was built with other settings.
            LinkBusy: Another program has it.
            LinkNotFound: Its link is down, or the world is paused.
        """
        if not 0 <= index < self.count:
            raise ArgumentError(f"{url}: the world has {self.count} robots, counted from 1")
        robot = self.robots.get(index) or self._build(index, settings)
        if _own(robot.settings) != _own(settings):
            raise ArgumentError(
                f"{url}: robot {index + 1} of this world was opened with another firmware or link before",
                hint="open it by the same URL each time, or give a world of its own another seed",
            )
        if self.clock.is_paused:
            raise LinkNotFound(f"{url}: the robot is there, but its world is paused", hint="let the world go on first")
        waiting = self.waiting.get(index)
        if waiting is not None:
            waiting.reconnect()
        elif index in self._taken:
            raise LinkBusy(
                f"{url} is open already on this event loop", hint="close it first, or leave robot= out for a new world"
            )
        robot.check_link(url)
        self._taken.add(index)
        return robot

    def release(self, index: int) -> None:
        """Record that no program has a robot any more, or will open it again; the last one ends the simulation."""
        self._taken.discard(index)
        if not self._taken:
            self.close()

    def wait_for(self, url: str, index: int) -> None:
        """Let a robot wait until *url* is opened again; robot and world go on meanwhile."""
        self.waiting[index] = Waiting(url, self, index)

    def close(self) -> None:
        """Stop everything; the ends of the links are closed."""
        _RUNNING.discard(self)
        if self._heartbeat is not None:
            self._heartbeat.cancel()
            self._heartbeat = None
        for robot in self.robots.values():
            robot.close()

    def _build(self, index: int, settings: SimulationSettings) -> VirtualRobot:
        """Give a robot its firmware and its link; its time begins now."""
        # What the world says of one robot overrides what a URL says of all.
        named = () if self.world is None else self.world.scene.firmware
        firmware = (named[index] if index < len(named) else "") or settings.firmware
        profile_named(firmware)
        script = None if settings.fault is None else load_script(settings.fault, self.count)
        hardware = self._hardware(index, firmware, settings)
        latency, jitter = self._delay(settings)
        options = _LinkOptions(
            latency=latency, jitter=jitter, loss=settings.loss, seed=(settings.seed or 0) + index, clock=self.clock
        )
        emulator: Emulator
        link: Link
        if firmware in WIFI_FIRMWARES:
            emulator = robot_on_wifi = WifiEmulator(firmware, hardware, booted=True)
            spread = 0.0 if self.world is None else self.world.scene.model.spread
            link = WifiLink(robot_on_wifi, spread=spread, **options)
        else:
            emulator = Emulator(firmware, hardware, baud=settings.baud, booted=True)
            link = Link(emulator, baud=settings.baud, **options)
        manual_faults = ManualFaults(f"{self.settings.seed or 0} control {index}")
        robot = VirtualRobot(index, settings, firmware, hardware, emulator, link, manual_faults)
        if script is not None:
            robot.player = FaultPlayer(link, script, robot=index, seed=settings.seed)
            robot.player.break_parts = robot.break_parts
            if isinstance(hardware, SimulatedHardware):
                hardware.volts = robot.player.read_volts
        link.impairments.append(manual_faults)
        self.robots[index] = robot
        return robot

    def _delay(self, settings: SimulationSettings) -> tuple[float, float]:
        """Return latency and jitter of a link: those of the settings, or else those of the profile."""
        latency, jitter = settings.latency, settings.jitter
        if self.profile.link is not None:
            latency, jitter = latency or self.profile.link.latency, jitter or self.profile.link.jitter
        if settings.baud == 0 and isinstance(self.loop, SimulatedLoop):
            latency = max(latency, MIN_DELAY)
        return latency, jitter

    def _hardware(self, index: int, firmware: str, settings: SimulationSettings) -> Hardware:
        if self.world is None:
            return FixedHardware.load(settings.hardware or "", firmware=firmware)
        build = firmware_named(firmware).BUILD
        return SimulatedHardware(self.world, index, build=build, switched_on=self.time, profile=self.profile)

    def _beat(self) -> None:
        self.catch_up()
        self._heartbeat = self.loop.call_later(HEARTBEAT, self._beat)


class Waiting:
    """A robot that lost its program and waits until the same URL is opened again.

    It refers to its event loop only through the simulation, so that both can be freed together.
    """

    _RANKS = itertools.count()

    def __init__(self, url: str, simulation: Simulation, index: int) -> None:
        self.url = url  # what its program had opened
        # its place among the robots that wait; the robot that was lost first has the lowest
        self.rank = next(self._RANKS)
        self._simulation = simulation
        self._index = index
        self._timer: asyncio.TimerHandle | None = None
        self._lease: UrlLease | None = None
        self._wait()

    @property
    def robot(self) -> VirtualRobot:
        """The robot."""
        return self._simulation.robots[self._index]

    def reconnect(self) -> None:
        """End the waiting because the robot is opened again; it stays taken.

        Raises:
            LinkNotFound: Its link is still down; the robot then waits for the same time again.
        """
        try:
            self.robot.check_link(self.url)
        except LinkNotFound:
            self._wait()
            raise
        self._leave()

    def _wait(self) -> None:
        """Wait as long as if the robot had been lost now."""
        self._cancel()
        loop = self._simulation.loop
        self._lease = lease_of(self.url, loop)
        if self._lease is not None:
            self._lease.on_end.append(self._give_up)
        elif not loop.is_closed():
            opens_in = self.robot.opens_in
            delay = RECONNECT_TIMEOUT + (opens_in if math.isfinite(opens_in) else 0.0)
            self._timer = loop.call_later(delay, self._give_up)

    def _give_up(self) -> None:
        self._leave()
        self._simulation.release(self._index)

    def _leave(self) -> None:
        self._cancel()
        self._simulation.waiting.pop(self._index, None)

    def _cancel(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._lease is not None:
            self._lease.on_end.remove(self._give_up)
            self._lease = None


_RUNNING: weakref.WeakSet[Simulation] = weakref.WeakSet()
on_begin: list[Callable[[Simulation], object]] = []
"""Called with each simulation that begins, for those who show what a program does."""


def running() -> Iterator[Simulation]:
    """Yield the simulations of the running event loop."""
    loop = asyncio.get_running_loop()
    yield from [each for each in _RUNNING if each.loop is loop]


def waiting_for(url: str) -> Simulation | None:
    """Return the simulation whose robot waits until *url* is opened again, or None.

    Of several such robots the one is meant that can be opened first, then the one lost first.
    """
    waiting = [
        (each.robot.opens_in, each.rank, simulation)
        for simulation in running()
        for each in simulation.waiting.values()
        if each.url == url
    ]
    return min(waiting, key=lambda each: each[:2])[-1] if waiting else None


def is_shared_elsewhere(settings: SimulationSettings) -> bool:
    """Return whether programs share a world of these settings on another event loop, without this robot.

    If that world has this robot, the program wants two worlds, such as those of two swarms.
    """
    loop, index = asyncio.get_running_loop(), (settings.robot or 1) - 1
    return any(
        each.is_shared and index not in each.robots and _world(each.settings) == _world(settings)
        for each in tuple(_RUNNING)
        if each.loop is not loop and not each.loop.is_closed()
    )


def shared_with(settings: SimulationSettings) -> Simulation | None:
    """Return the simulation whose robots all programs of the running event loop share, if there is one yet."""
    return next((each for each in running() if each.is_shared and _world(each.settings) == _world(settings)), None)


def as_scene(world: World) -> Scene:
    """Return a world as it is now as a scene: another simulation that starts with it goes on from here.

    Raises:
        SimulationError: A robot stands in something.
    """
    now, scene = world.snapshot(), world.scene
    scene = replace(
        scene,
        **world.laid_out(),
        energies=tuple(robot.energy for robot in now.robots) if scene.energy else (),
        model=replace(scene.model, ambient=world.ambient),
    )
    return replace(scene, starts=cleared(scene, [robot.pose for robot in now.robots]))


def no_robot(settings: SimulationSettings) -> SimulationError:
    """Return the error for a world without a robot."""
    return SimulationError(
        f"the world {settings.world} has no robot", hint="add a [[robot]] to it, or ask for robots=1"
    )


def _world(settings: SimulationSettings) -> tuple[object, ...]:
    """Return what the robots of one world have in common."""
    return settings.world, settings.seed, settings.robots, settings.hardware, settings.profile, settings.quality


def _own(settings: SimulationSettings) -> SimulationSettings:
    """Return what each robot of a world may have for itself."""
    return replace(settings, robot=None, speed="real")
