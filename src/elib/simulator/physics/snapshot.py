"""A world at one moment, frozen: what drawings and other servers get, so that they can disturb nothing."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module

from elib.base.pose import Pose
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.fittings import FLOOR_COLOUR, Light, Sound, Zone
from elib.simulator.physics.floor import Floor, packed
from elib.simulator.physics.geometry import Box, Colour, Cylinder, Polygon, Wall

DARK = Colour(0, 0, 0)
BARE = Floor(packed(FLOOR_COLOUR))


@dataclass(frozen=True, slots=True)
class Lamps:
    """What a robot shows.

    Attributes:
        ring: Colours of the eight ring LEDs, 0 front centre, then clockwise seen from above; black is off.
        body: The green light of the body.
        front: The front LED.
    """

    ring: tuple[Colour, ...] = (DARK,) * 8
    body: bool = False
    front: bool = False


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a zone or a thing of a world, or to a robot.

    Attributes:
        number: How many happened before it.
        time: When, s since the start.
        kind: `enter`, `leave`: a robot and a zone; `on`, `off`: a zone; `open`, `closed`: a door; `collect`: a puck,
            and the robot that gets its points; `respawn`: a puck; `empty`: a robot without energy.
        what: Name of the zone or thing; a thing without a name is its kind and index, such as `cylinder 2`.
        robot: The robot, from 0; None if it is about none.
    """

    number: int
    time: float
    kind: str
    what: str
    robot: int | None = None


@dataclass(frozen=True, slots=True)
class Beam:
    """The middle ray of one infrared sensor.

    Attributes:
        start: Where it leaves the robot, x and y, m.
        end: What it meets, or how far it goes, m.
        strength: Reflected light without noise as a part of full scale, 0..1.
        reading: What the sensor reads, counts: with its gain, what it reads in the open, and noise.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    strength: float
    reading: int


@dataclass(frozen=True, slots=True)
class RobotView:
    """One robot at that moment.

    Attributes:
        pose: Where it stands.
        radius: The radius of its body, m.
        touching: Whether it is in contact with something.
        lamps: What it shows.
        beams: Its infrared sensors, if they were asked for.
        energy: What is left of its energy, 0..1.
        score: Points that it earned.
    """

    pose: Pose
    radius: float = RADIUS
    touching: bool = False
    lamps: Lamps = Lamps()
    beams: tuple[Beam, ...] = ()
    energy: float = 1.0
    score: float = 0.0


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One world at one moment.

    Attributes:
        name: The name of the world.
        tick: Whole ticks since the start.
        time: Since the start, s.
        width: The width of the arena, m; x runs from 0 to it.
        depth: The depth of the arena, m; y runs from 0 to it.
        walls: Interior walls, then the sides of polygons.
        boxes: Blocks where they are now.
        cylinders: Posts and balls where they are now.
        robots: In order of insertion.
        lights: Lamps as they are now.
        sounds: Sources of sound as they are now.
        floor: What is painted on the floor.
        zones: As they are now: switched on or not, and with what is left to give.
        polygons: Fixed blocks.
    """

    name: str
    tick: int
    time: float
    width: float
    depth: float
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    robots: tuple[RobotView, ...] = ()
    lights: tuple[Light, ...] = ()
    sounds: tuple[Sound, ...] = ()
    floor: Floor = BARE
    zones: tuple[Zone, ...] = ()
    polygons: tuple[Polygon, ...] = ()

    def _repr_svg_(self) -> str:
        """Show the world in a notebook."""
        drawing = import_module("elib.simulator.drawing")  # it is above the physics, and goes by name
        return str(drawing.draw(self, None, size=450))
