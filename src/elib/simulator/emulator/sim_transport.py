"""``sim://``: a virtual robot inside the program that drives it."""

from __future__ import annotations

import logging
from dataclasses import replace

from elib.base.errors import LinkLost, SimulationError, Unsupported
from elib.base.pose import Pose
from elib.base.timebase import host, require_speed
from elib.link.protocol.profiles import profile_named
from elib.link.protocol.values import Neighbour
from elib.link.transport.base import Transport
from elib.link.transport.lease import lease_of
from elib.link.transport.memory import MemoryTransport
from elib.link.transport.url import Scheme, Url
from elib.simulator.emulator.robotprofile import written
from elib.simulator.emulator.settings import FLAGS, KEYS, SimulationSettings, settings_of
from elib.simulator.emulator.simulation import (
    Simulation,
    VirtualRobot,
    as_scene,
    is_shared_elsewhere,
    no_robot,
    shared_with,
    waiting_for,
)
from elib.simulator.physics.scene import Scene
from elib.simulator.physics.world import World
from elib.simulator.worlds.files import source_of
from elib.simulator.worlds.writer import written_scene

_has_warned = False
log = logging.getLogger("elib")


class SimTransport(MemoryTransport):
    """The program's end of the cable to a virtual robot."""

    def __init__(self, url: str, simulation: Simulation, robot: VirtualRobot) -> None:
        super().__init__(url, origin="simulator")
        self.simulation = simulation  # world, emulators and links behind it, for demos and tests
        self.robot = robot  # the one it leads to
        self.codec = profile_named(robot.firmware).codec
        self.last_command = b""

    def describe(self) -> dict[str, str]:
        """Return what a recording keeps of the simulation: world by name and as TOML, seed, robot, profile."""
        settings, world = self.simulation.settings, self.simulation.world
        found = {"robot_index": str(self.robot.index)}
        if world is not None:
            found |= {"world": settings.world, "seed": str(world.seed), "robots": str(self.simulation.count)}
            if self.simulation.is_rebuilt:
                try:
                    found["scene"] = written_scene(as_scene(world))
                except SimulationError:  # a robot is squeezed in
                    found["scene"] = written_scene(world.scene)
            else:
                content, _ = source_of(settings.world)
                found["scene"] = content.decode("utf-8", "replace")
        if settings.profile is not None:
            found["profile"] = written(self.simulation.profile)
        return found

    @property
    def layout(self) -> object:
        """The scene with its boxes and walls: another object whenever a hand has added, moved or removed one."""
        return None if self.simulation.world is None else self.simulation.world.scene

    def observe(self) -> tuple[Pose, dict[str, object]] | None:
        """Return the robot's pose, and the places of everything that can move; None without a world.

        These are as they were last computed, at most a step before now while a program talks to the robot.
        """
        world = self.simulation.world
        if world is None:
            return None
        seen = world.snapshot()
        time = self.simulation.clock.loop_time(self.simulation.origin + world.time)
        pose = replace(seen.robots[self.robot.index].pose, time=time)
        return pose, {
            "tick": seen.tick,
            "robots": [_place(each.pose) for each in seen.robots],
            "boxes": [[box.x, box.y, box.angle] for box in seen.boxes],
            "cylinders": [[post.x, post.y] for post in seen.cylinders],
        }

    def send_message(self, message: bytes) -> None:
        """Let the robot say *message* to others by range and bearing, from now on.

        Raises:
            ArgumentError: The message is too long.
            Unsupported: The robot has constant readings instead of a world.
            LinkLost: The link is down.
        """
        self._shared_world().send_message(self.robot.index, message, at=self.simulation.time)

    def neighbours(self) -> tuple[Neighbour, ...]:
        """Return the robots that this one hears by range and bearing, the nearest first.

        Raises:
            Unsupported: The robot has constant readings instead of a world.
            LinkLost: The link is down.
        """
        simulation, link = self.simulation, self.robot.link
        world = self._shared_world()
        link.catch_up()
        self.robot.hardware.advance(link.now)
        return tuple(
            Neighbour(
                each.distance,
                each.bearing,
                each.message,
                time=simulation.clock.loop_time(simulation.origin + each.time),
                origin=self.origin,
            )
            for each in world.neighbours(self.robot.index)
        )

    def _shared_world(self) -> World:
        """Return the world in which the robot can meet others."""
        if not self.is_open:
            raise LinkLost(f"{self.url}: the link is down", hint="try again when it is back")
        if self.simulation.world is None:
            raise Unsupported(
                f"{self.url} has constant readings, and no world with other robots",
                hint="leave hardware= out of the URL",
            )
        return self.simulation.world

    @property
    def is_paused(self) -> bool:
        """Whether the robot's world stands still: no answer is late then."""
        return self.simulation.clock.is_paused

    def lose(self, message: str, *, hint: str = "", kind: type[LinkLost] = LinkLost) -> None:
        """Mark the link as lost; the robot and its world go on and wait for the same URL to be opened again."""
        was_open = self.is_open
        super().lose(message, hint=hint, kind=kind)
        if was_open:
            self.simulation.wait_for(self._url, self.robot.index)

    def abort(self) -> None:
        """Pull the cable; with the last one the simulation ends, and the world keeps its state.

        It goes on if the link had broken, if the program gave up a robot that its fault script keeps from answering,
        and while its URL is leased (:func:`elib.link.transport.lease.lease`).
        """
        was_open = self.is_open
        super().abort()
        if not was_open:
            return
        index = self.robot.index
        if not self.robot.is_reachable or lease_of(self._url, self.simulation.loop) is not None:
            self.simulation.wait_for(self._url, index)
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
    settings = settings_of(url)
    if settings.robot is not None:
        return [url]
    count = settings.robots
    if count is None:
        count = 1 if settings.hardware is not None else len(Scene.load(settings.world).starts)
        if not count:
            raise no_robot(settings)
    if count == 1:
        return [url]
    return [replace(url, query=(*url.query, ("robot", str(number)))) for number in range(1, count + 1)]


async def open_url(url: Url) -> Transport:
    """Connect to a virtual robot: one inside this program, or one that is shown live and has a process of its own."""
    settings = settings_of(url)
    if not settings.view:
        return await open_sim(url)
    from elib.simulator.emulator.watched import open_watched  # few programs need it

    require_speed(settings.speed)
    return await open_watched(url, settings)


async def open_sim(url: Url) -> SimTransport:
    """Connect to a virtual robot, which is booted already: one whose link broke, or the first one of a new world.

    With ``robot=N`` it is robot N of a world that all such URLs share on this event loop; the first connection begins
    the world, and the end of the last one ends it.

    A simulation whose link broke, by ``Link.cut()`` or its fault script, waits 60 s of loop
    time for its URL to be opened again on the same event loop.

    Raises:
        SimulationError: The running event loop cannot run at the speed asked for, or a file breaks a rule.
        LinkNotFound: There is no such world, or the link is down.
        LinkBusy: That robot of the shared world is open already.
        ArgumentError: A value is out of its range, or there is no such fault script.
    """
    settings = settings_of(url)
    require_speed(settings.speed)
    name = str(url)
    simulation, robot = _find(name, settings)
    transport, end = SimTransport(name, simulation, robot), MemoryTransport(name)
    robot.link.on_down = lambda: _lose(transport)
    robot.link.on_missing = lambda package: transport.lose(
        f"{name}: the simulator needs the package {package} for what was asked, and it is not installed",
        hint="who builds the studio can add it: make studio WHEELS=folder" if host() else f"pip install {package}",
    )
    transport.join(end)
    robot.link.attach(end)
    return transport


def _lose(transport: SimTransport) -> None:
    """Say why the link is down, before it is cut."""
    player = transport.robot.player
    if player is not None and player.is_cut:
        transport.lose(
            f"{transport.url}: the link was cut at {player.time:.3g} s, as the fault script says",
            hint="open it again when that is over",
        )


def _find(name: str, settings: SimulationSettings) -> tuple[Simulation, VirtualRobot]:
    """Return the simulation that waits for *name*, or that its settings share, or else a new one; and the robot."""
    global _has_warned
    found = waiting_for(name) if settings.robot is None else shared_with(settings)
    if settings.robot is not None and found is None and not _has_warned and is_shared_elsewhere(settings):
        _has_warned = True
        log.warning(
            "%s: another robot of this world is open on another event loop (each elib.connect() has its own), so this "
            "is a second world, and the two never meet; open all robots by elib.swarm([...]), or by elib.open() on one "
            "loop",
            name,
        )
    simulation = found or Simulation(settings, is_connected=False, is_shared=settings.robot is not None)
    try:
        return simulation, simulation.take((settings.robot or 1) - 1, settings, name)
    except BaseException:
        if found is None:
            simulation.close()
        raise


def _check(url: Url) -> Url:
    settings_of(url)
    return url


SCHEME = Scheme(
    open_url, keys=KEYS, check=_check, speed=lambda url: settings_of(url).speed, robots=robots_of, flags=FLAGS
)
"""``sim://WORLD``."""
