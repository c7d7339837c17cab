"""Control of a running simulation by a person, a page or a test: move things, change lights, time and links.

Things are moved between two ticks of the world, never within one. Faults that are set here come on top of those of the
link's own settings and of a fault script. They belong to the simulation: every :class:`Control` of it sees and changes
the same ones. :mod:`elib.simulator.emulator.control_server` offers these methods to other programs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeVar

from msgspec import Struct

from elib.base.errors import ArgumentError, LinkError, SimulationError
from elib.base.rules import Delay, Number, Probability, Rule, Whole, rule_of
from elib.link.protocol.profiles import profile_named
from elib.simulator.emulator.clock import RATE
from elib.simulator.emulator.simulated_hardware import SimulatedHardware
from elib.simulator.emulator.simulation import Simulation, VirtualRobot, as_scene
from elib.simulator.physics import Box, Colour, Cylinder, Defect, EpuckModel, Light, Pose, Snapshot, Sound, Wall, World
from elib.simulator.physics.body import Ambient
from elib.simulator.physics.defects import Amount, Deviation, Factor
from elib.simulator.physics.fittings import Frequency, Intensity, Volume, Zone
from elib.simulator.physics.geometry import Length, Painted, Place, WallEnd
from elib.simulator.physics.scene import Scene

T = TypeVar("T", bound=Callable[..., object])
_Thing = TypeVar("_Thing", Box, Cylinder, Light, Sound, Wall)


@dataclass(frozen=True, slots=True)
class _Which(Rule):
    """Which thing is meant."""

    def __str__(self) -> str:
        return "a name, or an index from 0"

    def accept(self, value: object) -> str | int:
        """Return *value*, cut to a size that names nothing if it is larger than any name or index."""
        if isinstance(value, str):
            return value[:64]
        if isinstance(value, int) and not isinstance(value, bool):
            return min(max(value, -1), 1 << 40)
        raise self.refuse(value)


Which = Annotated[int | str, _Which()]
Heading = Annotated[float, Number(-1000, 1000, "rad")]
ZoneName = Annotated[str, rule_of(Zone, "name")]


Part = Annotated[str, rule_of(Defect, "of")]
PartNumber = Annotated[int, Whole(0, 7)]
Selector = Annotated[int, Whole(0, 15)]
RemoteKey = Annotated[int, Whole(0, 127)]
RemoteAddress = Annotated[int, Whole(0, 31)]
Seconds = Annotated[float, Number(0.001, 1, "s")]
WorldRate = Annotated[float, RATE]

ADDED = Colour.parse("#c8963c")
"""Colour of a box or a wall that was added by hand: it stands out on every floor."""


MAX_BY_HAND = 500
"""Boxes, and walls, of a world that can have another one: each that comes or goes lays the whole floor out again."""


ORDERS: dict[str, Callable[..., object]] = {}
"""The methods of :class:`Control` that other programs may ask for, by their names."""


def order(method: T) -> T:
    """Let other programs ask for a method of :class:`Control`: its arguments are checked by their annotations."""
    ORDERS[method.__name__] = method
    return method


class LinkState(Struct, frozen=True, rename={"is_connected": "connected", "is_cut": "cut"}):
    """How a robot is connected."""

    is_connected: bool  # whether it has a program, or a port that a program can open
    is_cut: bool  # whether its link is cut, so that no program can reach it
    latency: float = 0.0  # delay of its answers that was set by hand, s
    jitter: float = 0.0  # standard deviation of that delay, s
    loss: float = 0.0  # probability of a loss that was set by hand
    script: tuple[str, ...] = ()  # what its fault script does to it now, such as `("loss", "cut")`
    broken: tuple[str, ...] = ()  # what is broken in it now, in words


class Control:
    """Controls *simulation*, for callers on its event loop.

    Robots are named (``epuck-1``) or counted from 0; so are boxes, cylinders, lights and sounds.
    Every method raises ArgumentError if there is no such robot or thing, a number is out of its range, something stands
    in the new place, or no program can connect to the robot. Methods that move or change a thing raise SimulationError
    if the simulation has constant readings and no world.

    Args:
        simulation: What is controlled.
    """

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.names = simulation.names  # names of all robots, in order

    @property
    def world(self) -> World:
        """The world.

        Raises:
            SimulationError: The simulation has constant readings instead of a world.
        """
        if self.simulation.world is None:
            raise SimulationError("this simulation has constant readings and no world", hint="leave --hardware out")
        return self.simulation.world

    @property
    def ambient(self) -> float:
        """What the infrared sensors read in the room's light, counts."""
        world = self.simulation.world
        return 0.0 if world is None else world.ambient

    def snapshot(self, *, beams: bool = False) -> Snapshot:
        """Return the world as it is now.

        Args:
            beams: Whether to cast the rays of the infrared sensors too.

        Raises:
            SimulationError: There is no world.
        """
        world = self.world
        self.simulation.catch_up()
        return world.snapshot(beams=beams)

    def keep(self) -> None:
        """Keep what the world is now, so that it can go back to it."""
        self.simulation.past.keep(self.world)

    def link(self, robot: int | str) -> LinkState:
        """Return how a robot is connected.

        Raises:
            ArgumentError: There is no such robot.
        """
        index = self.robot(robot)
        virtual = self.simulation.robots.get(index)
        if virtual is None:
            return LinkState(is_connected=False, is_cut=False)
        faults = virtual.manual_faults
        script = () if virtual.player is None else virtual.player.active
        link = virtual.link
        broken = tuple(str(defect) for defect in virtual.broken)
        return LinkState(link.is_connected, link.is_down, faults.latency, faults.jitter, faults.loss, script, broken)

    def is_cut(self, index: int) -> bool:
        """Return whether no program can reach a robot, which is given by its index."""
        return index in self.simulation.robots and self.simulation.robots[index].link.is_down

    def robot(self, robot: int | str) -> int:
        """Return the index of a robot.

        Raises:
            ArgumentError: There is no such robot.
        """
        if isinstance(robot, str):
            if robot in self.names:
                return self.names.index(robot)
        elif 0 <= robot < len(self.names):
            return robot
        last = self.names[-1] if self.names else "none"
        raise ArgumentError(f"there is no robot {robot!r}", hint=f"they are called epuck-1 to {last}, or 0 and up")

    @order
    def move_robot(self, robot: Which, x: Place, y: Place, heading: Heading | None = None) -> None:
        """Lift a robot and put it down elsewhere; its wheels go on turning.

        Args:
            robot: Name or index of the robot.
            x: New x, m.
            y: New y, m.
            heading: New heading, rad; None keeps the old one.
        """
        index, world = self.robot(robot), self.world
        x, y = _place(x, y)
        self.simulation.catch_up()
        heading = world.pose(index).heading if heading is None else heading
        world.move_robot(index, Pose(x, y, math.remainder(heading, math.tau) if math.isfinite(heading) else heading))

    @order
    def move_box(self, box: Which, x: Place, y: Place, angle: Heading | None = None) -> None:
        """Put a box down elsewhere.

        Args:
            box: Name or index of the box.
            x: New x of its centre, m.
            y: New y of its centre, m.
            angle: New angle, rad; None keeps the old one.
        """
        boxes = self._ready().laid_out()["boxes"]  # a door as it is closed
        index = _index("box", box, boxes)
        self.world.move_box(index, Pose(*_place(x, y), boxes[index].angle if angle is None else angle))

    @order
    def move_cylinder(self, cylinder: Which, x: Place, y: Place) -> None:
        """Put a cylinder down elsewhere.

        Args:
            cylinder: Name or index of the cylinder.
            x: New x, m.
            y: New y, m.
        """
        index = _index("cylinder", cylinder, self.snapshot().cylinders)
        self.world.move_cylinder(index, *_place(x, y))

    @order
    def add_box(
        self,
        x: Place,
        y: Place,
        *,
        angle: Heading = 0.0,
        width: Length = 0.1,
        depth: Length = 0.1,
        pushable: bool = True,
        colour: Painted = ADDED,
    ) -> int:
        """Put another box into the world, and return its index.

        Args:
            x: x of its centre, m.
            y: y of its centre, m.
            angle: From the world's x axis to its own, rad.
            width: Along its own x axis, m.
            depth: Along its own y axis, m.
            pushable: Whether it gives way to a robot.
            colour: The colour of its sides.

        Raises:
            ArgumentError: A number is out of its range, a robot stands there, or the world has too many.
            SimulationError: There is no world.
        """
        box = Box(x, y, width, depth, angle, colour=colour, is_pushable=pushable)
        world = self._ready()
        _require_few("boxes", len(world.scene.boxes))
        world.add_box(box)
        return len(self.world.scene.boxes) - 1

    @order
    def remove_box(self, box: Which) -> None:
        """Take a box out of the world; those counted behind it move up."""
        self.world.remove_box(_index("box", box, self.snapshot().boxes))

    @order
    def add_wall(self, x1: WallEnd, y1: WallEnd, x2: WallEnd, y2: WallEnd, *, colour: Painted = ADDED) -> int:
        """Put another wall into the world, and return its index.

        Args:
            x1: x of one end, m.
            y1: y of that end, m.
            x2: x of the other end, m.
            y2: y of that end, m.
            colour: The colour of its sides.

        Raises:
            ArgumentError: A robot stands there, or the world has too many.
            SimulationError: There is no world.
        """
        world = self._ready()
        _require_few("walls", len(world.scene.walls))
        world.add_wall(Wall(x1, y1, x2, y2, colour=colour))
        return len(self.world.scene.walls) - 1

    @order
    def move_wall(self, wall: Which, x1: WallEnd, y1: WallEnd, x2: WallEnd, y2: WallEnd) -> None:
        """Put the ends of a wall elsewhere; arguments as of :meth:`add_wall`.

        Raises:
            ArgumentError: There is no such wall, or a robot stands there.
            SimulationError: There is no world.
        """
        world = self._ready()
        index = _index("wall", wall, world.scene.walls)
        world.move_wall(index, replace(world.scene.walls[index], x1=x1, y1=y1, x2=x2, y2=y2))

    @order
    def remove_wall(self, wall: Which) -> None:
        """Take a wall out of the world; those counted behind it move up."""
        world = self._ready()
        world.remove_wall(_index("wall", wall, world.scene.walls))

    def scene(self) -> Scene:
        """Return the world as it is now as a scene: another simulation that starts with it goes on from here.

        Raises:
            SimulationError: There is no world, or a robot stands in something.
        """
        self.simulation.catch_up()
        return as_scene(self.world)

    @order
    def set_light(
        self,
        light: Which,
        *,
        intensity: Intensity | None = None,
        x: Place | None = None,
        y: Place | None = None,
        height: Length | None = None,
    ) -> None:
        """Change a lamp; an argument that is None changes nothing.

        Args:
            light: Name or index of the lamp.
            intensity: Intensity, 0..10; 0 switches the lamp off.
            x: New x, m.
            y: New y, m.
            height: Height above the floor, m, more than 0.
        """
        lights = self._ready().laid_out()["lights"]
        index = _index("light", light, lights)
        changes = _given(x=x, y=y, height=height, intensity=intensity)
        self.world.set_light(index, replace(lights[index], **changes))

    @order
    def set_sound(
        self,
        sound: Which,
        *,
        volume: Volume | None = None,
        frequency: Frequency | None = None,
        x: Place | None = None,
        y: Place | None = None,
    ) -> None:
        """Change a source of sound; an argument that is None changes nothing.

        Args:
            sound: Name or index of the source.
            volume: Volume at 0.1 m, counts peak to peak, 0..4095; 0 silences the source.
            frequency: Frequency, Hz, 0..8000; 0 is a noise without a tone.
            x: New x, m.
            y: New y, m.
        """
        sounds = self._ready().laid_out()["sounds"]
        index = _index("sound", sound, sounds)
        changes = _given(x=x, y=y, volume=volume, frequency=frequency)
        self.world.set_sound(index, replace(sounds[index], **changes))

    @order
    def switch(self, zone: ZoneName, *, on: bool | None = None) -> None:
        """Switch a zone of the world on or off, and with it its doors, lamps and sounds.

        Args:
            zone: Name of the zone.
            on: Whether it is on from now on, whatever is in it; None leaves it to what is in it again.
        """
        self._ready().switch(zone, on)

    @order
    def set_ambient(self, ambient: Ambient) -> None:
        """Set what the infrared sensors read in the room's light.

        Args:
            ambient: The reading, counts, 0..4095; higher is darker.
        """
        ambient = _checked(EpuckModel, ambient=ambient)["ambient"]
        world = self.world
        self.simulation.catch_up()
        world.set_ambient(ambient)

    @order
    def turn_selector(self, robot: Which, position: Selector) -> None:
        """Turn the rotary switch of a robot. Its firmware reads it when it is asked, and when it starts.

        Args:
            robot: Name or index of the robot.
            position: 0..15.
        """
        self.hardware(robot).turn_selector(position)

    @order
    def press_remote(self, robot: Which, key: RemoteKey, *, address: RemoteAddress = 0) -> None:
        """Press a key of an infrared remote control that points at a robot.

        Args:
            robot: Name or index of the robot.
            key: Number of the key, 0..63 for the e-puck1, 0..127 for the e-puck2.
            address: Address of the device that the remote control is for, 0..31.
        """
        self.hardware(robot).receive(address, key)

    @order
    def press_button(self, robot: Which, *, pressed: bool = True) -> None:
        """Hold the user button of an e-puck2 down, or release it.

        Args:
            robot: Name or index of the robot.
            pressed: Whether it is held down from now on.

        Raises:
            ArgumentError: There is no such robot, it has no button, or no program ever opened it.
            SimulationError: There is no world.
        """
        hardware = self.hardware(robot)
        if not self.has_button(robot):
            raise ArgumentError(f"{self.names[self.robot(robot)]} has no button", hint="only the e-puck2 has one")
        if pressed:
            hardware.press_button()
        else:
            hardware.release_button()

    @order
    def restart(self, robot: Which) -> None:
        """Switch a robot off and on. It stops, and its program loses a connection over Wi-Fi.

        Raises:
            ArgumentError: There is no such robot, no program ever opened it, or its battery is empty.
        """
        virtual = self._connected(robot)
        if virtual.player is not None and virtual.player.is_dead:
            raise ArgumentError(f"the battery of {self.names[virtual.index]} is empty", hint="its fault script says so")
        virtual.link.power_cycle()

    def has_button(self, robot: Which) -> bool:
        """Return whether a robot has a user button that its firmware can read."""
        return "button" not in profile_named(self._connected(robot).firmware).absent

    def hardware(self, robot: Which) -> SimulatedHardware:
        """Return the hardware of a robot."""
        hardware = self._connected(robot).hardware
        if not isinstance(hardware, SimulatedHardware):
            raise SimulationError("this simulation has constant readings and no world", hint="leave --hardware out")
        return hardware

    @order
    def pause(self) -> None:
        """Let the world stand still, with the robots' firmwares and links.

        Calls of programs in this process wait; programs outside get no answer.

        Raises:
            SimulationError: The simulation computes its own time (``speed=max``).
        """
        self.simulation.change_clock(self.simulation.clock.pause)

    @order
    def resume(self) -> None:
        """End a pause."""
        self.simulation.change_clock(self.simulation.clock.resume)

    @order
    def step(self, seconds: Seconds | None = None) -> None:
        """Let a paused world go on by some time.

        Args:
            seconds: 0.001..1 s, rounded to whole ticks; None for one tick.

        Raises:
            ArgumentError: The world is not paused, or *seconds* is out of its range.
            SimulationError: There is no world.
        """
        self.simulation.step(self.world.scene.step if seconds is None else seconds)

    @order
    def set_speed(self, speed: WorldRate) -> None:
        """Let the world run faster or slower; programs keep their own time.

        Args:
            speed: 0.1..10 times as fast as the clock of the programs in this process.

        Raises:
            ArgumentError: *speed* is out of its range.
            SimulationError: The speed was chosen when the simulation was started.
        """
        self.simulation.change_clock(lambda: self.simulation.clock.set_rate(speed))

    @order
    def set_faults(
        self,
        robot: Which,
        *,
        latency: Delay | None = None,
        jitter: Delay | None = None,
        loss: Probability | None = None,
    ) -> None:
        """Make a robot's link worse, in addition to its settings and its fault script.

        An argument that is None changes nothing.

        Args:
            robot: Name or index of the robot.
            latency: Added delay of its answers, 0..60 s.
            jitter: Standard deviation of the added delay, 0..60 s.
            loss: Probability that a whole answer is lost, 0..1.
        """
        faults = self._connected(robot).manual_faults
        for name, value in _checked(Control.set_faults, latency=latency, jitter=jitter, loss=loss).items():
            setattr(faults, name, value)

    @order
    def set_defect(
        self,
        robot: Which,
        of: Part,
        number: PartNumber | None = None,
        *,
        factor: Factor = 1.0,
        shift: Amount = 0.0,
        noise: Deviation = 0.0,
        stuck: Amount | None = None,
    ) -> None:
        """Break a part of a robot, on top of its fault script; with nothing wrong, mend what was broken so by hand.

        Keys are those of :class:`~elib.simulator.physics.Defect`; a *number* of None stands for all.
        """
        numbers = () if number is None else (number,)
        defect = Defect(of, numbers, factor=factor, shift=shift, noise=noise, stuck=stuck)
        self._connected(robot).break_parts(f"hand {of} {number}", () if defect == Defect(of, numbers) else (defect,))

    @order
    def mend_parts(self, robot: Which) -> None:
        """Mend all parts of a robot, also those that a fault script broke: it may break some again when it goes on."""
        virtual = self._connected(robot)
        for by in list(virtual.defects):
            virtual.break_parts(by, ())

    @order
    def cut(self, robot: Which) -> None:
        """Cut a robot's link: its program loses it, and no program can open it until :meth:`mend`."""
        self._connected(robot).link.take_down("hand")

    @order
    def mend(self, robot: Which) -> None:
        """Let programs open a robot again. What a fault script cut stays cut as long as the script says.

        Raises:
            LinkError: Its port cannot be opened again; the link stays cut.
        """
        link = self._connected(robot).link
        try:
            link.bring_up("hand")
        except LinkError:
            link.take_down("hand")
            raise

    def _ready(self) -> World:
        """Return the world, run up to now."""
        self.simulation.catch_up()
        return self.world

    def _connected(self, robot: int | str) -> VirtualRobot:
        index = self.robot(robot)
        if index not in self.simulation.robots:
            raise ArgumentError(f"{self.names[index]} has no link: no program ever opened it", hint="open it first")
        return self.simulation.robots[index]


def _checked(taker: Callable[..., object], **values: float | None) -> dict[str, float]:
    """Return those values that are not None, by the rules of what takes them."""
    return {name: rule_of(taker, name).require(value, name) for name, value in _given(**values).items()}


def _require_few(what: str, count: int) -> None:
    if count >= MAX_BY_HAND:
        raise ArgumentError(f"the world has {count} {what}", hint=f"by hand none is added beyond {MAX_BY_HAND}")


def _place(x: float, y: float) -> tuple[float, float]:
    found = _checked(Box, x=x, y=y)
    return found["x"], found["y"]


def _given(**values: float | None) -> dict[str, Any]:
    """Return those values that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def _index(what: str, thing: int | str, things: Sequence[_Thing]) -> int:
    if isinstance(thing, str):
        for index, candidate in enumerate(things):
            if thing and getattr(candidate, "name", "") == thing:
                return index
    elif 0 <= thing < len(things):
        return thing
    there = f"counted from 0 to {len(things) - 1}" if things else "there is none in this world"
    raise ArgumentError(f"there is no {what} {thing!r}", hint=there)
