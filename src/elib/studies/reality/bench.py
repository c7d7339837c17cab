"""A bench for one virtual robot: a world with a white floor, walls and papers, in which a program measures it.

The robot is opened by its URL, as any program would, and answers through its firmware and link. Hands that put it
somewhere, or something beside it, are those of :class:`elib.World`. A robot that was recorded has no hands: see
``session.py``.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import AsyncIterator, Awaitable, Callable, Hashable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from elib.base.body import LENS, STEPS_PER_REVOLUTION
from elib.base.files import write_file
from elib.link.protocol.profiles import profile_named
from elib.link.session.trace import Received
from elib.link.transport.url import Url
from elib.robot.aio import Epuck
from elib.robot.link import Link, LinkSettings
from elib.simulator.emulator.sim_transport import SimTransport
from elib.simulator.physics import Box, Colour, Cylinder, EpuckModel, Patch, Pose, Scene, Sound, World
from elib.simulator.physics.body import RADIUS
from elib.simulator.worlds.writer import written_scene

T = TypeVar("T")
Numbers: TypeAlias = NDArray[np.float64]

PACKET = 0.0216
"""s between two readings, as in the recordings over Wi-Fi (measured-robots: time_of_flight.epuck2)."""

DRIVING = 212.0
"""steps/s of the recordings of robots that drive."""

TURNING = 260.0
"""steps/s of the wheels of a robot that turns on the spot: five seconds a turn."""

SERIES = 40
"""Readings from which the noise of a robot is computed: few, because there are many robots."""

MEMORY = 200
"""Readings from which the correlation of a noise is computed: it outlasts ten of them."""

WHITE, BLACK, GREY, BLUE = "#ffffff", "#000000", "#a0a0a0", "#2060c0"


class Field(NamedTuple):
    """What is measured of a reading: a field of it, or all its numbers."""

    name: str = ""  # the field; empty for all
    scale: float = 1.0  # how large its unit is in that of the figures
    most: int | None = None  # how many of its numbers; None where firmwares have more or fewer


FIELDS = {
    "proximity": Field(most=8),
    "accelerometer": Field("g", 768.0, 3),
    "gyroscope": Field("rad_per_s", math.degrees(1), 3),
    "magnetometer": Field(scale=1e6, most=3),
    "distance": Field("metres", 1000.0, 1),
    "ground": Field("counts", most=3),
    "microphones": Field("counts"),
}
"""By the readings. The units: counts of 768 a g, degrees/s,
microtesla, mm. Some robots add the cliff sensors to those of the ground."""

SENSORS, EMPTY = b"\x02", b"\x03"
"""First bytes of packets over Wi-Fi without a picture (wire-protocol.md, 4.3)."""

WIDTH, DEPTH = 2.4, 1.2
"""Size of the arena, m. Its walls and its floor are white, large enough for a distance of 1.1 m: a
larger one takes longer."""

OPEN = Pose(0.5, 0.6, 0.0)
"""Where nothing is in reach of the infrared sensors, and almost two metres ahead are free."""

PAPER = 0.1
"""Side of a sheet of coloured paper, m. Papers lie in two rows on a floor of their own, a white lane between them: a
painted floor of the whole arena would take seconds to make."""

LANE = Pose(0.1, 0.25, 0.0)
"""Where the robot stands on the white lane."""

BLOCK = 0.23 + LENS
"""Where the face of a block stands of which pictures are taken, m from the robot's middle."""

STILLS = 5
"""Pictures of a block."""

MANY = 40
"""Pictures of a wall: of 20, one has a broken row."""

POSTS = (0.03, 0.05)
"""Diameters of the posts that stand in a corner, m."""


def scene_of(model: EpuckModel, papers: Sequence[str]) -> Scene:
    """Return the world of the bench: the arena, or a floor with papers of these colours."""
    white = Colour.parse(WHITE)
    if not papers:
        posts = tuple(Cylinder(*_parked(index), each / 2) for index, each in enumerate(POSTS))
        return Scene(
            WIDTH, DEPTH, starts=(OPEN,), model=model, cylinders=posts, sounds=(Sound(0, 0, 0.0),), floor=white
        )
    places = (_paper(index) for index in range(len(papers)))
    sheets = (
        Patch(x - PAPER / 2, y - PAPER / 2, PAPER, PAPER, Colour.parse(colour))
        for colour, (x, y) in zip(papers, places, strict=True)
    )
    return Scene(
        _paper(len(papers))[0] + 0.1, 2 * LANE.y, starts=(LANE,), model=model, floor=white, paint=tuple(sheets)
    )


def _paper(index: int) -> tuple[float, float]:
    """Return the middle of a paper, m."""
    return 0.1 + 1.2 * PAPER * (index // 2), 2 * LANE.y - 0.1 if index % 2 else 0.1


def _parked(index: int) -> tuple[float, float]:
    """Return where a post stands while it is not needed, m."""
    return WIDTH - 0.1, 0.1 + 0.2 * index


class NotMeasured(Exception):
    """A recorded robot was not in the situation that a quantity needs."""


class Bench:
    """One robot on the bench."""

    def __init__(self, robot: Epuck | None = None, world: World | None = None, papers: Sequence[str] = ()) -> None:
        self._robot = robot
        self._world = world
        self._papers = papers
        self._kept: dict[object, Any] = {}

    @property
    def robot(self) -> Epuck:
        """The robot, as a program has it.

        Raises:
            NotMeasured: It was recorded.
        """
        if self._robot is None:
            raise NotMeasured
        return self._robot

    @property
    def world(self) -> World:
        """The world that hands reach into.

        Raises:
            NotMeasured: The robot was recorded.
        """
        if self._world is None:
            raise NotMeasured
        return self._world

    async def once(self, measured: Callable[..., Awaitable[T]], *arguments: Hashable) -> T:
        """Return what *measured* returns for the bench and the arguments; it is called once for a robot."""
        key = measured, *arguments
        if key not in self._kept:
            self._kept[key] = await measured(self, *arguments)
        found: T = self._kept[key]
        return found

    # -- what a recorded robot has, too --

    async def series(self, name: str, steps: float = 0.0, *, is_turning: bool = False, count: int = SERIES) -> Numbers:
        """Return readings of a robot in the open, a row each, in the units of :data:`FIELDS`.

        Args:
            name: Name of the reading.
            steps: Speed at which it drives straight, or turns; it stands at 0. In steps/s.
            is_turning: It turns on the spot.
            count: How many readings.
        """
        await self.drive(steps, is_turning=is_turning)
        rows = await self.readings(name, count, 5 * PACKET if is_turning else PACKET)
        await self.robot.stop()
        return rows

    async def near(
        self, name: str, distance: float, bearing: float = 0.0, count: int = 3, period: float = PACKET
    ) -> Numbers:
        """Return readings with a white wall at *distance* from the robot's rim, m, and *bearing*, rad."""
        await self.face(distance, bearing)
        return await self.readings(name, count, period)

    async def leaving(self) -> Numbers:
        """Return infrared readings of a robot that backs away from a white wall, from 5 mm to 50 mm."""
        await self.drive(-DRIVING, Pose(RADIUS + 0.005, OPEN.y, math.pi))
        return await self.readings("proximity", 76, PACKET)

    async def stills(self, colour: str) -> Numbers:
        """Return pictures between which nothing moves: of a grey wall, or of a box."""
        return await (self.pictures(GREY, 0.25, count=MANY) if colour == GREY else self.pictures(colour))

    async def packets(self) -> list[float]:
        """Return the times of packets over Wi-Fi without a picture, s."""
        times: list[float] = []

        def note(time: float, event: object) -> None:
            if isinstance(event, Received) and event.data[:1] in (EMPTY, SENSORS):
                times.append(time)

        self.robot.trace(note)
        await self.readings("proximity", 15)
        return times

    async def picture_times(self) -> list[float]:
        """Return how long pictures took, s."""
        found = []
        for _ in range(6):
            began = self.robot.time
            await self.robot.image()
            found.append(self.robot.time - began)
        return found

    # -- hands --

    async def place(self, pose: Pose | None = None) -> None:
        """Put the robot somewhere, into the open unless told; its sensors have seen the place when this returns."""
        await self.robot.stop()
        self.world.move_robot(0, pose or (LANE if self._papers else OPEN))
        await self.robot.sleep(0.15)

    async def face(self, distance: float, bearing: float = 0.0) -> None:
        """Put the robot in front of a white wall.

        Args:
            distance: From its rim to the wall, m.
            bearing: Where the wall is, rad from straight ahead, positive to the left.
        """
        await self.place(Pose(RADIUS + distance, DEPTH / 2, math.pi - bearing))

    async def stand_on(self, colour: str) -> None:
        """Put the robot on paper of a colour."""
        if colour not in self._papers:
            raise NotMeasured
        x, y = _paper(self._papers.index(colour))
        await self.place(Pose(x - 0.03, y, 0.0))

    @contextlib.contextmanager
    def box(self, colour: str, *, ahead: float, width: float) -> Iterator[None]:
        """Stand a box before the robot, whose face is *ahead* of its middle, m, and *width* m wide."""
        pose, depth = self.world.pose(0), 0.1
        x = pose.x + (ahead + depth / 2) * math.cos(pose.heading)
        y = pose.y + (ahead + depth / 2) * math.sin(pose.heading)
        self.world.add_box(Box(x, y, depth, width, pose.heading, colour=Colour.parse(colour)))
        try:
            yield
        finally:
            self.world.remove_box(len(self.world.scene.boxes) - 1)

    @contextlib.contextmanager
    def post(self, diameter: float, *, ahead: float) -> Iterator[None]:
        """Stand a white post of one of :data:`POSTS`, m, before the robot, its nearest point *ahead* of the rim, m."""
        pose, index = self.world.pose(0), POSTS.index(diameter)
        reach = RADIUS + ahead + diameter / 2
        self.world.move_cylinder(
            index, pose.x + reach * math.cos(pose.heading), pose.y + reach * math.sin(pose.heading)
        )
        try:
            yield
        finally:
            self.world.move_cylinder(index, *_parked(index))

    def sound(self, volume: float, distance: float = 1.0, bearing: float = 0.0) -> None:
        """Let a sound come from *distance*, m, and *bearing*, rad, of the robot's middle; volume 0 ends it."""
        pose = self.world.pose(0)
        angle = pose.heading + bearing
        here = Sound(pose.x + distance * math.cos(angle), pose.y + distance * math.sin(angle), volume)
        self.world.set_sound(0, here)

    async def pictures(self, colour: str, ahead: float = BLOCK, width: float = 0.1, count: int = STILLS) -> Numbers:
        """Return pictures of a box as the chip sends them, each in the shape (rows, columns, 3): only the bits it has.

        Args:
            colour: The colour of the box.
            ahead: Where its face is, m from the robot's middle.
            width: The width of its face, m.
            count: How many pictures.
        """
        await self.place()
        with self.box(colour, ahead=ahead, width=width):
            taken = [(await self.robot.image()).pixels for _ in range(count)]
        return as_sent(np.array(taken))

    async def drive(self, steps: float, pose: Pose | None = None, *, is_turning: bool = False) -> None:
        """Drive from *pose* on, steps/s; the robot has its speed when this returns. 0 stands."""
        await self.place(pose)
        if steps:
            speed = steps / STEPS_PER_REVOLUTION
            await self.robot.set_speed(-speed if is_turning else speed, speed)
            await self.robot.sleep(0.2)

    async def readings(self, name: str, count: int, period: float = 0.0) -> Numbers:
        """Return *count* readings, a row each, asked for every *period* s, or one after the other."""
        ask, field = getattr(self.robot, name), FIELDS[name]
        found = []
        for _ in range(count):
            began = self.robot.time
            reading = await ask()
            found.append(np.atleast_1d(getattr(reading, field.name) if field.name else [*reading])[: field.most])
            if (rest := began + period - self.robot.time) > 0:
                await self.robot.sleep(rest)
        return field.scale * np.array(found, float)


def as_sent(pictures: NDArray[np.uint8]) -> Numbers:
    """Return pictures with those bits only that RGB565 has."""
    return (pictures & np.array([0xF8, 0xFC, 0xF8], np.uint8)).astype(float)


@contextlib.asynccontextmanager
async def bench(url: str) -> AsyncIterator[Bench]:
    """Open a robot on the bench that :func:`url_of` names, on a loop in simulated time."""
    async with Epuck(Link(url, settings=LinkSettings(keep_moving=True))) as robot:
        transport = robot.session.transport
        assert isinstance(transport, SimTransport)
        world = transport.simulation.world
        assert world is not None
        papers = [str(each.colour) for each in world.scene.paint if isinstance(each, Patch)]
        yield Bench(robot, world, papers)


def url_of(firmware: str, *, quality: str, seed: int, papers: Sequence[str], folder: Path) -> str:
    """Return the URL of a robot on the bench, and write its world's file."""
    file = folder / f"{firmware}{'-papers' if papers else ''}.toml"
    if not file.exists():
        generation = 2 if profile_named(firmware).name.startswith("epuck2") else 1
        model = EpuckModel(quality=quality, generation=generation, ground_module=True)
        write_file(file, written_scene(scene_of(model, papers)).encode())
    return str(Url("sim", str(file), (("speed", "max"), ("firmware", firmware), ("seed", str(seed)))))
