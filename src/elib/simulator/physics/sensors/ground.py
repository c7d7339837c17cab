"""The ground module: three sensors that look at the floor, and two at the edges that see where it ends.

Each shines infrared light at the floor and reads what comes back, 0..1000 counts, more is brighter:

    counts = black + (white - black) f(b).

In the infrared, paint of any colour is white, and only black pigment is dark: red, green, blue and yellow tape read
what white paper reads, within 20 counts, on three robots (measured-robots: ground.coloured_tape). So b is not the
luminance of the floor's colour but its value or its saturation, whichever is larger. f is 0 over black and 1 over white
paper (measured-robots: ground.printed_grey). What a sensor reads over black differs much between robots, and between
the sensors of one robot; what it reads over white does not (measured-robots: ground.thirty_robots).

No one has measured the cliff sensors. They are assumed to be like the other three. A hole, and what lies beyond the
floor, gives next to nothing.
"""

from __future__ import annotations

from typing import Final

from elib.base.body import GROUND_SENSORS
from elib.simulator.physics.defects import GROUND_AT, spoiled
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.floor import HOLE_MARK
from elib.simulator.physics.noise import GROUND, GROUND_BLACK, GROUND_BLACKS, GROUND_WHITE, gauss, tick_key
from elib.simulator.physics.records import Records, Robot, Setting
from elib.simulator.physics.zones import FIRST_INK, map_cell

COUNT: Final = 5

PLACE_X: Final = tuple(x for x, _ in GROUND_SENSORS)
PLACE_Y: Final = tuple(y for _, y in GROUND_SENSORS)

BLACK: Final = 325.0
WHITE: Final = 960.0
"""Counts over black and over white paper: means of 90 sensors (measured-robots: ground.thirty_robots)."""

BLACK_SPREAD: Final = 118.0
WHITE_SPREAD: Final = 8.0
"""Their standard deviations among typical robots, counts (measured-robots: ground.thirty_robots)."""

OWN: Final = 0.6
SHARED: Final = 0.8
"""Parts of a sensor's deviation over black that are its own, and that all sensors of its robot share. Their squares
add up to 1. Inside a robot the deviation is 73 counts, between robots 87 (measured-robots: ground.thirty_robots)."""

SKEW: Final = 0.25
"""The deviations over black have a long tail upwards: g + 0.25 (g2 - 1) for a normal g puts 5, 50 and 95 % of the
sensors at 189, 297 and 556 counts; 90 real ones are at 179, 294 and 585."""

SKEWED: Final = 1.0606601717798212  # sqrt(1 + 2 * 0.25**2): the deviation of that.

DARKEST: Final = 79.0
BRIGHTEST: Final = 750.0
"""The lowest and the highest reading over black of 90 sensors, counts: no robot is drawn beyond them."""

SHARES: Final = (0.0, 0.085, 0.17, 0.25, 0.35, 0.45, 0.655, 0.895, 0.985, 1.0, 1.0)
"""f at b = 0, 0.1 ... 1: a laser print of eight greys (measured-robots: ground.printed_grey)."""

BRIGHT: Final = 230
"""Brightest part of a colour, of 255, from which on b is 0.9 or more, and f is 1."""

HUELESS: Final = 51
"""Paint whose brightest part is below this, of 255, has hardly a hue: its saturation is taken against this, so that the
noise of a picture does not turn black into a colour. Chosen."""

NOTHING: Final = 5.0
"""Counts over a hole. Chosen: some light always finds its way back."""

STANDING: Final = 0.7
DRIVING: Final = 1.1
"""Standard deviation of the noise of a robot that stands, and what driving adds to it, counts (measured-robots:
ground.white)."""

HOLD: Final = 0.2
"""s that the noise stays as it is. Two readings 22 ms apart then have a correlation of 0.89 (measured-robots:
ground.white, 0.81..0.95)."""


@kernel
def read(world: Records, i: int) -> None:
    """Read the ground and cliff sensors of robot *i*: left, centre, right, cliff left, cliff right, 0..1000.

    counts = black + (white - black) f(b), as the head of this file says; 5 over a hole. The noise has a deviation of
    0.7 counts while the robot stands, and of 1.8 while a typical one drives. It changes every 0.2 s.
    """
    robot = world.robots[i]
    setting = world.setting[0]
    key = tick_key(robot.key, int(setting.tick * setting.step / HOLD))
    deviation = STANDING
    if robot.left_speed != 0.0 or robot.right_speed != 0.0:
        deviation += setting.spread * DRIVING
    deviation *= setting.sensor_noise
    ground = world.views[i].ground
    seen, share = HOLE_MARK, 0.0
    for s in range(COUNT):
        x = robot.x + PLACE_X[s] * robot.heading_x - PLACE_Y[s] * robot.heading_y
        y = robot.y + PLACE_X[s] * robot.heading_y + PLACE_Y[s] * robot.heading_x
        colour = floor_at(world, x, y)
        level = NOTHING
        if colour < HOLE_MARK:
            if colour != seen:  # most sensors see the same as the one before
                seen, share = colour, brightness(colour)
            black = robot.black[s]
            level = black + (robot.white[s] - black) * share
        if deviation > 0.0:
            level += deviation * gauss(key, GROUND + s)
        level = spoiled(setting, robot, GROUND_AT + s, level)
        ground[s] = int(min(max(level, 0.0), 1000.0) + 0.5)


@kernel
def brightness(colour: int) -> float:
    """Return how bright a floor of this colour, 65536 red + 256 green + blue, is in the infrared, 0 black..1 white."""
    red, green, blue = colour >> 16, (colour >> 8) & 255, colour & 255
    high = max(red, green, blue)
    if high >= BRIGHT:
        return 1.0
    low = min(red, green, blue)
    tenths = 10.0 * max(high / 255.0, (high - low) / max(high, HUELESS))
    k = min(int(tenths), 9)
    return SHARES[k] + (tenths - k) * (SHARES[k + 1] - SHARES[k])


@kernel
def vary_ground(setting: Setting, robot: Robot) -> None:
    """Draw what each ground sensor of a robot reads over black and over white."""
    shared = SHARED * gauss(robot.key, GROUND_BLACKS)
    for s in range(COUNT):
        robot.black[s] = BLACK
        robot.white[s] = WHITE
        if setting.spread > 0.0:
            g = shared + OWN * gauss(robot.key, GROUND_BLACK + s)
            black = BLACK + setting.spread * BLACK_SPREAD * (g + SKEW * (g * g - 1.0)) / SKEWED
            robot.black[s] = min(max(black, DARKEST), BRIGHTEST)
            robot.white[s] = WHITE + setting.spread * WHITE_SPREAD * gauss(robot.key, GROUND_WHITE + s)


@kernel
def floor_at(world: Records, x: float, y: float) -> int:
    """Return the floor's colour at a place, 65536 red + 256 green + blue; HOLE_MARK or more for a hole."""
    setting = world.setting[0]
    if setting.has_pens:
        cell = map_cell(setting, x, y)
        if cell >= 0 and world.states[FIRST_INK + cell] > 0:
            return world.states[FIRST_INK + cell] - 1
    if setting.floor_columns == 0:
        return setting.floor_colour
    column = x * setting.floor_scale
    row = y * setting.floor_scale
    if 0.0 <= column < setting.floor_columns and 0.0 <= row < setting.floor_rows:
        return world.floor[int(row) * setting.floor_columns + int(column)]
    return HOLE_MARK
