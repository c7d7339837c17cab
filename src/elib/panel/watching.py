"""The newest readings and pictures of one robot of the panel, and where it was."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable

from elib.base.errors import ArgumentError, ElibError
from elib.base.infrared import wall_distance
from elib.base.pose import Pose
from elib.base.rules import Number
from elib.base.tasks import end_tasks
from elib.behaviours import OpenAir
from elib.link.protocol.image import Image
from elib.link.protocol.values import Proximity, Reading
from elib.maps.grid import Grid
from elib.robot.aio import Epuck
from elib.robot.snapshot import IMAGE
from elib.simulator.emulator.sim_transport import SimTransport

RATE = 10.0
"""Snapshots of all sensors a second, unless a program asks for another rate."""
SLOW, FAST = 1.0, 50.0
"""Snapshots a second that a program may ask for."""
STALE = 1.0
"""s after which a value counts as old; three periods of its watch if that is longer."""
PERIODS = 3
"""Of a watch: a value is not old because one answer was lost."""
QUICKEST, SLOWEST = 0.4, 60.0
"""s between two live pictures."""
KEPT = 5000
"""Points of the trail."""
MAX_MISSED = 100
"""Readings that may come onto the map between two looks of a page that is then told only what changed: 10 s."""
AGAIN = 0.5
"""s until a watch that failed begins again."""


class ReadingsWatcher:
    """The readings of one robot, over all its connections.

    Attributes:
        trail_count: Number of points that the trail ever had.
        trail_began: That number when the robot was last connected: earlier points are of another journey.
    """

    def __init__(self, complain: Callable[[str], object], on_lost: Callable[[ElibError], object]) -> None:
        self.readings: dict[str, Reading | Image] = {}  # the newest reading of each kind, by name, with its own time
        # where the robot was by its odometry, or in its world, oldest first
        self.trail: deque[Pose] = deque(maxlen=KEPT)
        self.trail_count = self.trail_began = 0
        self.map = Grid()  # what its infrared sensors have met; nothing of a robot simulated here, whose world is seen
        self.mapped = deque[Pose](maxlen=MAX_MISSED)  # the poses at which that was last added to, oldest first
        self._complain, self._on_lost = complain, on_lost
        self._loop = asyncio.get_running_loop()
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self.rate = RATE  # snapshots of all sensors a second
        self.pictures: float | None = None  # seconds between two live pictures; None if there are none
        self._robot: Epuck | None = None
        self._rests = False
        self._open_air, self._near = OpenAir(), Proximity()
        self._has_news = False

    @property
    def distances(self) -> list[float]:
        """How far a white wall would be in the direction of each infrared sensor, m; infinite where nothing is seen.

        What a sensor read at least since the robot was connected counts as nothing near.
        """
        return [wall_distance(counts) for counts in self._near]

    def watch_sensors(self, rate: float) -> None:
        """Read all sensors so many times a second; an ArgumentError refuses a rate that is not from 1 to 50."""
        self.rate = Number(SLOW, FAST, "Hz").require(rate, "the rate of the sensors")
        self._follow("", self.rate)

    def age(self, name: str) -> float:
        """Return how old a reading is, s; infinite before the first one."""
        reading = self.readings.get(name)
        return math.inf if reading is None else max(0.0, self._loop.time() - reading.time)

    def is_stale(self, name: str) -> bool:
        """Return whether a reading is too old to be believed. A picture that was asked for once is not."""
        period = self.pictures if name == IMAGE else 1 / self.rate
        return period is not None and self.age(name) > max(STALE, PERIODS * period)

    def note(self, name: str, reading: Reading | Image) -> None:
        """Take a reading as the newest of its kind."""
        self.readings[name] = reading
        if isinstance(reading, Proximity):
            self._near = self._open_air(reading)
            self._has_news = True

    def begin(self, robot: Epuck) -> None:
        """Watch *robot*; its trail begins again."""
        self._robot = robot
        self.forget()
        self._go_on()

    def rest(self) -> None:
        """Ask the robot for nothing until :meth:`wake`; what was read stays."""
        self._rests = True
        for task in self._tasks.values():
            task.cancel()

    def wake(self) -> None:
        """Ask again. Safe to repeat."""
        if self._rests:
            self._rests = False
            self._go_on()

    def _go_on(self) -> None:
        self._follow("", self.rate)
        self.watch_camera(self.pictures)

    def forget(self) -> None:
        """Forget the readings, the trail and the map."""
        self.readings.clear()
        self.map = Grid()
        self._open_air, self._near = OpenAir(), Proximity()
        self.trail.clear()
        self.trail_began = self.trail_count

    async def end(self) -> None:
        """End watching; what was read stays."""
        self._robot = None
        await end_tasks(*self._tasks.values())

    def watch_camera(self, seconds: float | None) -> None:
        """Take a picture every so many seconds; None ends that. An ArgumentError refuses what is not from 0.4 to 60."""
        if seconds is not None:
            Number(QUICKEST, SLOWEST, "s").require(seconds, "the time between two pictures")
        self.pictures = seconds
        self._follow(IMAGE, None if seconds is None else 1 / seconds)

    def place(self, robot: Epuck) -> None:
        """Take a robot to be where it is: in its world if it is simulated here, otherwise by its odometry."""
        transport = virtual(robot)
        if transport is not None and transport.simulation.world is not None:
            self._has_news = False
            self.put(transport.simulation.world.pose(transport.robot.index))
        else:
            self.put(robot.odometry_pose)

    def put(self, pose: Pose) -> None:
        """Add a point to the trail if the robot has moved, and to the map what it sees there, if that is new."""
        if self._has_news:
            self._has_news = False
            try:
                self.map.add(pose, self.distances)
                self.mapped.append(pose)
            except ArgumentError as error:  # the robot is too far away
                self._complain(f"the map begins again: {error.message}")
                self.map = Grid()
        if not self.trail or (pose.x, pose.y) != (self.trail[-1].x, self.trail[-1].y):
            self.trail.append(pose)
            self.trail_count += 1

    def _follow(self, name: str, rate: float | None) -> None:
        """Watch all sensors, or the camera, at another rate, in place of the watch before; None ends that."""
        if (old := self._tasks.pop(name, None)) is not None:
            old.cancel()
        if rate is None or self._robot is None or self._rests:
            return
        work = self._watch(self._robot, [name] if name else [], rate)
        task = self._tasks[name] = self._loop.create_task(work, name=f"elib panel watches {name or 'all'}")
        task.add_done_callback(lambda ended: self._tasks.pop(name) if self._tasks.get(name) is ended else None)

    async def _watch(self, robot: Epuck, names: list[str], rate: float) -> None:
        """Keep the newest readings, also after the link was lost and opened again."""
        while True:
            try:
                async with robot.watch(*names, rate=rate) as snapshots:
                    async for snapshot in snapshots:
                        for name, reading in snapshot.readings.items():
                            self.note(name, reading)
                        self.place(robot)
                return
            except ElibError as error:
                if robot.session.error is not None:
                    self._on_lost(robot.session.error)
                    return
                self._complain(f"watching: {error.message}")
                await asyncio.sleep(AGAIN)


def virtual(robot: Epuck | None) -> SimTransport | None:
    """Return the transport of a robot that is simulated in this program; None for any other."""
    transport = None if robot is None else robot.session.transport
    return transport if isinstance(transport, SimTransport) else None
