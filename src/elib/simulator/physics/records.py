"""The records that the kernels of the simulator work on: each is declared here once, with its units.

Interpreted, a record is a Python object with slots. Compiled, it is one entry of a NumPy structured array whose fields
have the same names and the same order (:mod:`elib.simulator.physics.engine`). So ``robot.x`` means the same in both.

A new sensor needs one line in :class:`SensorView` and one file in :mod:`elib.simulator.physics.sensors`.
"""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from dataclasses import dataclass, field, fields
from math import inf
from typing import Any, Final, NamedTuple

from elib.base.body import FASTEST_2

SIZE = "size"
"""Metadata of a field that holds several numbers: how many."""

MAX_DEFECTS: Final = 8
"""Defects that a robot can have at the same time (:mod:`elib.simulator.physics.defects`)."""

SENSOR = "sensor"
"""Metadata of a field that a file of the same name in ``sensors/`` fills."""


def _numbers(size: int, zero: float, **metadata: Any) -> Any:
    return field(default_factory=lambda: [zero] * size, metadata={SIZE: size, **metadata})


def floats(size: int) -> Any:
    """Return a field that holds *size* floats."""
    return _numbers(size, 0.0)


def counts(size: int) -> Any:
    """Return a field of :class:`SensorView` that holds *size* whole numbers of one sensor."""
    return _numbers(size, 0, **{SENSOR: True})


def values(size: int) -> Any:
    """Return a field of :class:`SensorView` that holds *size* floats of one sensor."""
    return _numbers(size, 0.0, **{SENSOR: True})


def value() -> Any:
    """Return a field of :class:`SensorView` that holds the one float of a sensor."""
    return field(default=0.0, metadata={SENSOR: True})


@dataclass(slots=True, eq=False)
class Robot:
    """One robot. Lengths in m, speeds in m/s."""

    x: float = 0.0  # Where its centre is.
    y: float = 0.0
    heading_x: float = 1.0  # Cosine of the heading. The heading is kept as a unit vector.
    heading_y: float = 0.0  # Sine of the heading.
    before_x: float = 0.0  # The pose one tick ago.
    before_y: float = 0.0
    before_heading_x: float = 1.0
    before_heading_y: float = 0.0
    last_step_x: float = 0.0  # How far it moved in the tick before the last one: acceleration needs two moves.
    last_step_y: float = 0.0
    left_speed: float = 0.0  # Of the nominal wheel's rim.
    right_speed: float = 0.0
    left_travel: float = 0.0  # What a wheel rolled since the last tick, at speeds that were changed meanwhile, m.
    right_travel: float = 0.0
    covered: float = 0.0  # How much of the running tick that was, s.
    left_scale: float = 1.0  # This robot's wheel radius over the nominal one.
    right_scale: float = 1.0
    axle: float = 0.0  # From wheel to wheel.
    radius: float = 0.0  # Of its body.
    left_steps: float = 0.0  # Motor steps issued since the start, with the fraction of the next one.
    right_steps: float = 0.0
    volume: float = 0.0  # Of the sound that it plays, counts at 0.1 m; 0 is silence.
    silent_from: float = inf  # When that sound ends, s.
    frequency: float = 0.0  # Of that sound, Hz; 0 if it has no tone.
    slot: float = 0.0  # Time between the samplings of two pairs of its infrared sensors, s.
    grip: float = 0.0  # What its wheels can still push in this tick, kg m.
    touched: int = -1  # Iteration of the contact solver that last moved it; 0 overlapped; -1 touched nothing.
    key: int = 0  # Of its noise.
    digest: int = 0  # Of all its infrared readings so far.
    seen: int = -1  # Tick of its infrared readings; -1 for none.
    defects: int = 0  # How many it has.
    lane: int = 0  # Which scratch its sensors work on: robots of different lanes can be sensed at the same time.
    gain: list[float] = floats(8)  # Of its infrared sensors, factors.
    offset: list[float] = floats(8)  # What they read in the open, counts.
    darkness: list[float] = floats(8)  # What they read with their emitters off, over what others read.
    energy: float = 1.0  # What is left of it, 0..1; a robot without any stands.
    full: float = 1.0  # What it begins with.
    was_told: int = 0  # 1 if it became empty, and has not recovered.
    score: float = 0.0  # Points that it earned.
    zones: int = 0  # In which it is: a bit for each.
    pen: int = -1  # The colour in which it draws; -1 for none.
    black: list[float] = floats(5)  # What its ground sensors read over black, counts.
    white: list[float] = floats(5)  # The same over white.
    defect: list[float] = floats(4 * MAX_DEFECTS)  # Of each: a bit for each number, factor, shift and noise.


@dataclass(slots=True, eq=False)
class SensorView:
    """What one robot reads, and what its control function answers; the function knows the robot by this alone.

    Only the sensors that the controller asked for are read again in each tick.

    Attributes:
        proximity: Infrared light that comes back to the eight sensors, counts, 0..4095, higher is nearer.
        ambient_light: Infrared light with the emitters off, counts, 0..4095, higher is darker.
        ground: Left, centre, right, cliff left, cliff right, counts, 0..1000, higher is brighter.
        microphones: Right, left, rear, front, counts peak to peak, 0..4095.
        distance: What the time-of-flight sensor measures, m, 0..2; 2 where it sees nothing.
        acceleration: Forward, to the left and upwards, m/s2.
        rotation: About the upright axis, rad/s, positive to the left.
        number: The number of the robot, counted from 0.
        time: Since the start, s.
        left: Out: speed of the left wheel, steps/s; 0 unless the control function sets it.
        right: Out: speed of the right wheel, steps/s; 0 unless the control function sets it.
        fitness: In and out: 0 at first; it keeps what the control function wrote.
    """

    proximity: list[int] = counts(8)
    ambient_light: list[int] = counts(8)
    ground: list[int] = counts(5)
    microphones: list[int] = counts(4)
    distance: float = value()
    acceleration: list[float] = values(3)
    rotation: float = value()
    number: int = 0
    time: float = 0.0
    left: float = 0.0
    right: float = 0.0
    fitness: float = 0.0


@dataclass(slots=True, eq=False)
class Segment:
    """A wall, or one side of a box."""

    x: float = 0.0  # One end, m.
    y: float = 0.0
    tangent_x: float = 1.0  # Unit vector towards the other end.
    tangent_y: float = 0.0
    length: float = 0.0  # m
    height: float = 0.0  # Above the floor, m.
    absorbs: float = 1.0  # 1 / reflectance for infrared light.
    colour: int = 0  # 65536 red + 256 green + blue.
    face: int = 0  # What cameras see on it: its number in State.faces.


@dataclass(slots=True, eq=False)
class Disc:
    """A cylinder."""

    x: float = 0.0  # m
    y: float = 0.0
    radius: float = 0.0
    height: float = 0.0  # Above the floor, m.
    absorbs: float = 1.0  # 1 / reflectance for infrared light.
    colour: int = 0  # 65536 red + 256 green + blue.


@dataclass(slots=True, eq=False)
class Thing:
    """A box or a cylinder that can be pushed. Its sides, or its disc, follow it."""

    x: float = 0.0  # Centre, m.
    y: float = 0.0
    heading_x: float = 1.0  # Cosine and sine of its angle.
    heading_y: float = 0.0
    before_x: float = 0.0  # The pose at the start of the tick.
    before_y: float = 0.0
    before_heading_x: float = 1.0
    before_heading_y: float = 0.0
    speed_x: float = 0.0  # Speed along x and y, m/s.
    speed_y: float = 0.0
    spin: float = 0.0  # Rate of turn, rad/s, positive to the left.
    reach: float = 0.0  # Radius of the circle around it, m.
    half_width: float = 0.0  # Of a box, m; 0 for a cylinder.
    half_depth: float = 0.0
    lightness: float = 0.0  # 1 / mass, 1/kg.
    turnable: float = 0.0  # 1 / moment of inertia about its centre, 1/(kg m2); 0 for a cylinder.
    friction: float = 0.0  # Force over weight at which it begins to slide or roll.
    hold: float = 0.0  # What friction can still take of the pushes of this tick, kg m.
    first: int = 0  # Index of its first side among the walls, or of its disc.
    moved: int = 0  # 1 if a contact moved it since the solver last looked at it in this tick.
    switch: int = -1  # Number of the zone that opens it; -1 for none.
    open: float = 0.0  # How far it is open, 0..1.
    pace: float = 0.0  # What it opens in a second.
    hinge_x: float = 0.0  # The end about which it swings, or its centre, while it is closed, m.
    hinge_y: float = 0.0
    arm: float = 0.0  # From there to its centre, m.
    slide_x: float = 0.0  # How far it slides, m.
    slide_y: float = 0.0
    closed_x: float = 1.0  # Its heading while it is closed.
    closed_y: float = 0.0
    open_x: float = 1.0  # The same while it is open.
    open_y: float = 0.0
    collect: int = -1  # Number of the zone that collects it, -2 for robots; -1 for none.
    score: float = 0.0  # Points for that.
    gift: float = 0.0  # Energy for that.
    respawn: int = -1  # Number of the zone in which it comes back; -1 if it does not.
    after: float = 0.0  # When, s.
    back: int = -1  # Tick from which on it may come back; -1 while it is there.


@dataclass(slots=True, eq=False)
class Listing:
    """What is near one robot or thing: it holds until something has strayed too far from where it was listed."""

    x: float = 0.0  # Where it was when its neighbours were listed, m.
    y: float = 0.0
    rim: float = 0.0  # Radius of the circle around it, m.
    reach: float = 0.0  # Another one's rim matters to it at this distance from its middle, m.
    next: int = -1  # The next one in the same cell of the hash, or -1.
    first_near: int = 0  # Its neighbours are lists[first_near:end_near]: robots, then things, in rising order.
    # Where there is no room for so many, they are all robots and things, and it is one of them.
    end_near: int = 0
    first_wall: int = 0  # The fixed walls around it are lists[first_wall:end_wall]. Only of a robot.
    end_wall: int = 0


@dataclass(slots=True, eq=False)
class Cell:
    """What stands near one cell of the floor."""

    first_wall: int = 0  # The fixed walls are lists[first_wall:end_wall].
    end_wall: int = 0
    first_disc: int = 0  # The fixed cylinders are lists[first_disc:end_disc].
    end_disc: int = 0


@dataclass(slots=True, eq=False)
class Lamp:
    """A lamp that shines."""

    x: float = 0.0  # Place, m.
    y: float = 0.0
    height: float = 0.0  # Above the floor, m.
    intensity: float = 0.0  # How far it reaches: at half this many metres its light has fallen to 1/e.
    switch: int = -1  # Number of the zone that switches it; -1 if it always shines.


@dataclass(slots=True, eq=False)
class ZoneState:
    """What is known of a zone."""

    is_on: int = 0  # 1 while it is switched on.
    hand: int = 0  # 1 or -1 if a program has switched it on or off, whatever is in it.
    count: int = 0  # Robots in it.
    key: int = -2  # What switches it on: number of a thing; -2 for robots; -1 for a thing that is gone.
    stays: int = 0  # 1 if it stays on when that has left.
    store: float = inf  # Energy that it can still give.
    full: float = inf  # What it began with.
    refill: float = 0.0  # What comes back, 1/s.
    energy: float = 0.0  # What it gives each robot, 1/s.
    score: float = 0.0  # Points for coming in.
    rate: float = 0.0  # Points for being in it, 1/s.
    left: float = 0.0  # From where to where it reaches, m.
    right: float = 0.0
    low: float = 0.0
    high: float = 0.0


@dataclass(slots=True, eq=False)
class Tone:
    """A source of sound that is not silent."""

    x: float = 0.0  # Place, m.
    y: float = 0.0
    volume: float = 0.0  # Counts at 0.1 m.
    every: float = 0.0  # It begins again after so many s; 0 if it is steady.
    lasts: float = 0.0  # How long it then sounds, s.
    switch: int = -1  # Number of the zone that switches it; -1 if it always sounds.


@dataclass(slots=True, eq=False)
class Fan:
    """Two side rays of a sensor, one on each side of its axis."""

    cosine: float = 1.0  # Of the angle between a ray and the axis.
    sine: float = 0.0
    share: float = 0.0  # Weight of each ray in the reading.
    reach: float = 0.0  # Of a ray, m.
    nothing: float = 0.0  # 1 / reach, 1/m.


@dataclass(slots=True, eq=False)
class Response:
    """One entry of the infrared response table."""

    counts: float = 0.0  # Reflected light.
    deviation: float = 0.0  # Standard deviation of its noise.


@dataclass(slots=True, eq=False)
class Scratch:
    """What is worked out for one robot on the way to its readings, or out of a contact. Each lane has one."""

    first_wall: int = 0  # Its visible walls are visible_walls[first_wall:end_wall].
    end_wall: int = 0
    first_disc: int = 0  # The same of visible_discs.
    end_disc: int = 0
    ahead: list[float] = floats(8)  # How far the middle ray of each sensor goes, m.
    left: list[float] = floats(8)  # The same of the rays to its left and right.
    right: list[float] = floats(8)
    absorbs_ahead: list[float] = floats(8)  # 1 / reflectance of what they meet.
    absorbs_left: list[float] = floats(8)
    absorbs_right: list[float] = floats(8)
    light: list[float] = floats(8)  # What comes back to each infrared sensor, counts.
    deviation: list[float] = floats(8)  # Of its noise.
    room: list[float] = floats(8)  # What each reads with its emitter off, without noise, counts.
    share: list[float] = floats(8)  # What the lamp at hand gives to each.
    place_x: list[float] = floats(8)  # Where each sits in the world, m.
    place_y: list[float] = floats(8)
    axis_x: list[float] = floats(8)  # Where it looks.
    axis_y: list[float] = floats(8)
    exit_x: float = 0.0  # Where a robot is on its way out of fixed things, m.
    exit_y: float = 0.0
    exit_count: int = 0  # How many it was pushed out of.
    normal_x: float = 0.0  # Of the contact before this one; 0 before the first one.
    normal_y: float = 0.0
    level: float = 0.0  # How far along that normal the robot must be, m.
    longest: float = 0.0  # Square of how far it may slide along a contact, m2.


@dataclass(slots=True, eq=False)
class Episode:
    """How far a world is in an episode of a task (:mod:`elib.simulator.physics.course`)."""

    key: int = 0  # Made of the seed: the first episode has it, the next ones have keys made of it.
    begun: int = 0  # How many episodes began since then.
    scene: int = 0  # Which of the task's scenes it has.
    delay: int = 0  # Ticks from a decision until the wheels follow it.
    tick: int = 0  # Ticks since it began.
    is_over: int = 0  # 1 if the task has ended it.


@dataclass(slots=True, eq=False)
class Setting:
    """The numbers of the world as a whole."""

    tick: int = 0
    step: float = 0.0  # Length of a tick, s.
    width: float = 0.0  # Of the arena, m.
    depth: float = 0.0
    motor_noise: float = 0.0  # Relative standard deviation of a wheel's travel in a tick.
    sensor_noise: float = 0.0  # Factor on every sensor's noise.
    spread: float = 0.0  # Factor on all that tells real robots from ideal ones: 1 for typical robots.
    generation: int = 1  # Of the robots.
    ambient: float = 0.0  # What an infrared sensor reads in the room's light, counts.
    horizon: float = 0.0  # No infrared sensor sees farther from the middle of its robot, m.
    sensors: int = 8  # How many infrared sensors there are.
    place_x: list[float] = floats(8)  # Where each sits in the robot's frame, m.
    place_y: list[float] = floats(8)
    axis_x: list[float] = floats(8)  # Where it looks, a unit vector.
    axis_y: list[float] = floats(8)
    age: list[float] = floats(8)  # How many slots before the end of a tick it is sampled.
    infrared_fans: int = 1  # How many each infrared sensor has.
    middle_share: float = 1.0  # Weight of a sensor's middle ray.
    last_response: int = 0  # Index of the last entry of the response table.
    # The next four are negative where the spread says how much it is.
    wheel_spread: float = 0.0  # Relative standard deviation of the robots' wheel radii.
    axle_spread: float = 0.0  # The same of their axles.
    gain_spread: float = 0.0  # Standard deviation of the gains of their infrared sensors.
    offset_spread: float = 0.0  # The same of what these read in the open, counts.
    cell_scale: float = 0.0  # Cells a metre of the grid of fixed things.
    cell_columns: int = 0
    cell_rows: int = 0
    hash_scale: float = 0.0  # The same of the grid of moving things.
    hash_columns: int = 0
    hash_rows: int = 0
    first_own: int = 0  # Where in lists the walls of the first robot's own list begin.
    first_near: int = 0  # Where in lists the neighbours of the first robot begin.
    first_all: int = 0  # Where in lists the numbers of all robots and things begin, for those with too many neighbours.
    floor_colour: int = 0  # Of the bare floor, 65536 red + 256 green + blue.
    floor_columns: int = 0  # Of the floor's picture; 0 if nothing is painted.
    floor_rows: int = 0
    floor_scale: float = 0.0  # Pixels a metre.
    has_states: int = 0  # 1 if anything has a state (elib.simulator.physics.zones).
    has_energy: int = 0  # 1 if robots use energy.
    has_pens: int = 0  # 1 if a robot has a pen.
    idle: float = 0.0  # What they use of it, 1/s.
    driving: float = 0.0  # The same for each metre that their wheels roll, 1/m.
    key: int = 0  # Of what is drawn for the world as a whole.
    first_area: int = 0  # Where in floor the map of zones begins.
    map_columns: int = 0  # Of that map.
    map_rows: int = 0
    map_scale: float = 0.0  # Cells a metre.


@dataclass(slots=True, eq=False)
class Tables:
    """Numbers that are looked up, the same in all worlds whose robots have the same step motors."""

    quantiles: list[float] = floats(1024)  # Equally likely values of mean 0 and deviation 1.
    rim_speeds: list[float] = floats(FASTEST_2 + 1)  # Of a wheel at each whole number of wanted steps/s, m/s.


class Records(NamedTuple):
    """All records of one world: the one argument that every kernel takes.

    Interpreted, each part is a list; compiled, an array.
    """

    setting: Sequence[Setting]  # One entry.
    tables: Sequence[Tables]  # One entry.
    robots: Sequence[Robot]
    views: Sequence[SensorView]  # One a robot.
    walls: Sequence[Segment]  # The edge, interior walls, sides of fixed boxes, sides of pushable boxes.
    discs: Sequence[Disc]  # Fixed cylinders, then pushable ones.
    things: Sequence[Thing]
    lamps: Sequence[Lamp]
    tones: Sequence[Tone]
    fans: Sequence[Fan]  # Those of each infrared sensor, then two of the time-of-flight sensor.
    response: Sequence[Response]
    floor: Sequence[int]  # Pixels row by row from y = 0, colours; HOLE_MARK is added for a hole. Then the map of zones,
    # row by row from y = 0: a bit for each zone.
    cells: Sequence[Cell]  # Row by row from y = 0.
    heads: MutableSequence[int]  # For each cell of the hash the first robot or thing in it, or -1.
    listings: Sequence[Listing]  # Of each robot, then of each thing: in this order they are numbered as neighbours.
    lists: MutableSequence[int]  # Walls and cylinders of each cell, walls of each robot, neighbours of each listing.
    visible_walls: Sequence[Segment]  # Room for what a robot may see: turned so that it stands to the left of each.
    visible_discs: Sequence[Disc]
    scratch: Sequence[Scratch]  # One a lane.
    zones: Sequence[ZoneState]
    states: MutableSequence[int]  # How many events there were, and four numbers for each of the last ones; then what
    # pens drew, for each cell of the map of zones: colour + 1, or 0.


SENSORS = tuple(entry.name for entry in fields(SensorView) if SENSOR in entry.metadata)
"""Names of all sensors."""
