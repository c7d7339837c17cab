"""Where each number of a world lies in the flat sequences that the kernels share.

Every thing is a record of floats, one behind the other: robot i's x is ``robots[i * ROBOT + X]``. Interpreted,
the sequences are lists; compiled, arrays. The numbers below are the only place that says what lies where.
"""

from __future__ import annotations

from typing import Final, Protocol


class Floats(Protocol):
    """A flat sequence of floats: a list, or an array once compiled."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> float: ...
    def __setitem__(self, index: int, value: float, /) -> None: ...


class Ints(Protocol):
    """A flat sequence of integers."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> int: ...
    def __setitem__(self, index: int, value: int, /) -> None: ...


# A robot. Lengths in m, speeds in m/s.
X: Final = 0
Y: Final = 1
HEADING_X: Final = 2  # Cosine of the heading: it is kept as a unit vector.
HEADING_Y: Final = 3
BEFORE_X: Final = 4  # The pose one tick ago.
BEFORE_Y: Final = 5
BEFORE_HEADING_X: Final = 6
BEFORE_HEADING_Y: Final = 7
LAST_STEP_X: Final = 8  # What it moved in the tick before the last one, m: acceleration is a difference of two.
LAST_STEP_Y: Final = 9
LEFT_SPEED: Final = 10  # Of the nominal wheel's rim, m/s.
RIGHT_SPEED: Final = 11
LEFT_TRAVEL: Final = 12  # Rolled since the last tick at speeds that were changed meanwhile, m.
RIGHT_TRAVEL: Final = 13
COVERED: Final = 14  # How much of the running tick that was, s.
LEFT_SCALE: Final = 15  # This robot's wheel radius over the nominal one.
RIGHT_SCALE: Final = 16
AXLE: Final = 17  # m
RADIUS: Final = 18  # m
LEFT_STEPS: Final = 19  # Motor steps issued since the start, with the fraction of the next one.
RIGHT_STEPS: Final = 20
AWAKE: Final = 21  # The pass of the last tick in which it was last pushed by a contact; 0 if it touched nothing.
VOLUME: Final = 22  # Of the sound it plays, counts at 0.1 m; 0 is silent.
SLOT: Final = 23  # Time between the samplings of two pairs of its infrared sensors, s.
LISTED_X: Final = 24  # Where it was when its neighbours were listed, m.
LISTED_Y: Final = 25
ROBOT: Final = 26

# What its infrared sensors differ in, behind all other fixed numbers, if they differ at all.
GAIN: Final = 0  # Eight factors.
OFFSET: Final = 8  # Eight readings in the open, counts.
TRAITS: Final = 16

# A wall, or a side of a box.
WALL_X: Final = 0  # One end, m.
WALL_Y: Final = 1
TANGENT_X: Final = 2  # Unit vector towards the other end.
TANGENT_Y: Final = 3
LENGTH: Final = 4  # m
WALL_TOP: Final = 5  # Height above the floor, m.
WALL_ABSORBS: Final = 6  # 1 / reflectance for infrared light.
WALL_COLOUR: Final = 7  # 65536 red + 256 green + blue.
WALL: Final = 8
EDGE: Final = 4  # The first walls are the arena's edge: robots and things are kept inside it by comparisons instead.

# A cylinder. (x, y first, as for a robot.)
DISC_RADIUS: Final = 2  # m
DISC_TOP: Final = 3  # Height above the floor, m.
DISC_ABSORBS: Final = 4
DISC_COLOUR: Final = 5
DISC: Final = 6

# A box or a cylinder that can be pushed. Its sides, or its disc, lie behind the fixed ones in their sequences and
# follow it. (x, y, heading first, as for a robot.)
REACH: Final = 4  # Radius of the circle around it, m.
HALF_WIDTH: Final = 5  # m; 0 for a cylinder.
HALF_DEPTH: Final = 6
LIGHTNESS: Final = 7  # 1 / mass, 1/kg.
TURNABLE: Final = 8  # 1 / moment of inertia about its centre, 1/(kg m2); 0 for a cylinder.
FIRST: Final = 9  # Index of its first wall or of its disc.
WAS: Final = 10  # Its x, y, heading x, y at the start of the tick.
STIRRED: Final = 14  # 1 if a contact moved it since it was last looked at in this tick.
BODY_LISTED_X: Final = 15  # Where it was when it was hung into the grid, m.
BODY_LISTED_Y: Final = 16
BODY: Final = 17

# A lamp. (x, y first.)
LIGHT_TOP: Final = 2  # Height above the floor, m.
INTENSITY: Final = 3
LIGHT: Final = 4

# A source of sound. (x, y first.)
SOUND_VOLUME: Final = 2  # Counts at 0.1 m.
SOUND: Final = 3

# What does not change while a world runs ("fixed", floats).
STEP: Final = 0  # Length of a tick, s.
WIDTH: Final = 1  # Of the arena, m.
DEPTH: Final = 2
MOTOR_NOISE: Final = 3  # Relative standard deviation of a wheel's travel in a tick.
SENSOR_NOISE: Final = 4  # Factor on every sensor's noise.
ROOM: Final = 5  # What an infrared sensor reads in the room's light, counts.
IR_REACH: Final = 6  # Of an infrared ray, m.
GRID_SCALE: Final = 7  # Cells a metre of the grid of moving things.
CELL_SCALE: Final = 8  # Cells a metre of the grid of fixed things.
SPREAD: Final = 9  # Sine of the angle between a sensor's axis and its outermost ray.
WIDEST: Final = 10  # Cosine of that angle.
LONGEST_ROLL: Final = 12  # What a wheel may roll in a tick at most, noise and all, m.
PLACE_X: Final = 16  # Of the eight infrared sensors in the robot's frame, m.
PLACE_Y: Final = 24
AXIS_X: Final = 32  # Their directions, unit vectors.
AXIS_Y: Final = 40
CLEAR: Final = 11  # What an infrared sensor reads in the open, counts.
AGE: Final = 48  # How many slots before the end of a tick each is sampled.
RAYS: Final = 56  # Up to five rays: cosine and sine from the axis, table places a metre, weight. The middle one, then
# pairs, left before right.
RAY: Final = 4
QUANTILES: Final = 76  # 1024 equally likely values of mean 0 and deviation 1.
WALL_FAR: Final = 1100  # For each direction how far off a wall may be for each sensor in its list, m.
SPEEDS: Final = 1676  # Of a wheel's rim at each whole number of wanted steps/s, m/s.
RESPONSE: Final = 2777  # The profile's counts, then its deviations, LAST + 1 entries each.

# Whole numbers ("numbers"): a head, a record a robot, the grid of moving things, room for kernels, the lists of each
# robot's neighbours and of the walls around it.
TICK: Final = 0
ROBOTS: Final = 1  # How many.
BODIES: Final = 2
GRID_COLUMNS: Final = 3
GRID_ROWS: Final = 4
CELL_COLUMNS: Final = 5
CELL_ROWS: Final = 6
LAST: Final = 7  # Index of the last entry of the response table.
RAY_COUNT: Final = 8  # 1, 3 or 5
GENERATION: Final = 9  # 1: e-puck, 2: e-puck2.
LIGHTS: Final = 13  # How many shine.
WALLS: Final = 14  # How many of all kinds.
DISCS: Final = 15
NEXT_AT: Final = 10  # Where the chains of the grid begin: the next thing in the same cell, or -1.
PLACE_AT: Final = 11  # Where each thing's cell stands.
HEADS_AT: Final = 12  # Where the first thing of each cell stands.
UNEVEN: Final = 16  # Where in the fixed numbers it stands what infrared sensors differ in; 0 if they do not.
SLATE_AT: Final = 17  # Where room for kernels begins.
NEAR_AT: Final = 18  # Where it stands for each robot where the list of its neighbours begins; behind the last, its end.
PAIRS_AT: Final = 19  # Where the list of those begins that may touch before lists are made anew: i, j, i, j ...
PAIRS_END: Final = 20  # Where it ends.
NEAR_END: Final = 21  # Where the room for these lists ends.
NEAR_LACK: Final = 22  # 1 if that room was too small: the lists are not whole then, and nothing must be run.
SIGHT_AT: Final = 23  # Where it stands for each robot where the list of the fixed walls begins that it may see before
# lists are made anew: robot, wall, robot, wall ...; behind the last, its end.
TOUCH_AT: Final = 24  # Where the list of the walls inside the arena begins that robots may touch: robot, wall ...
TOUCH_END: Final = 25  # Where it ends.
WALL_LISTS: Final = 26  # For each direction the infrared sensors that can see a wall there.
DISC_LISTS: Final = 602  # The same of a near disc, then of a far one.
CHANNELS: Final = 1760  # For each infrared sensor what its word of noise adds to the key, and how far it is shifted.
SHIFTS: Final = 1768
HEAD: Final = 1776

KEY: Final = 0  # Of the robot's noise.
DIGEST: Final = 1  # Of its infrared readings delivered so far.
SEEN: Final = 2  # Tick of the readings below; -1 for none.
READINGS: Final = 3  # Eight, counts.
NOW: Final = 11  # The key of its noise in that tick.
NUMBER: Final = 12

# The grid of fixed things ("cells"), three numbers a cell and one behind the last. For the cell whose three begin at c:
# the walls that a robot may touch cells[cells[c]:cells[c + 1]], all that it may see up to cells[c + 2], then the discs
# up to cells[c + 3]; each in the order in which they were built.
CELL: Final = 3
