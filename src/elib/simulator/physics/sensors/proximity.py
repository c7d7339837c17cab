"""The eight infrared sensors: the light of their emitters that comes back, in counts of the 12-bit converter.

A sensor's reading is the weighted mean of what its rays see, each by the table of the profile
(:mod:`elib.simulator.physics.profiles`), then

    counts = gain * light + offset + noise, at most what the sensor reads with its emitter off,

because the firmware sends the difference of two measurements. Gain and offset are those of each sensor: real robots
are never alike, and none reads 0 in the open. The front sensors of an e-puck2 glitch while its wheels turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from elib.base.infrared import GAIN_SPREAD, SPACING
from elib.simulator.physics.defects import PROXIMITY_AT, spoiled_counts
from elib.simulator.physics.elementary import exponential
from elib.simulator.physics.engine import kernel, phase
from elib.simulator.physics.noise import (
    GAIN,
    GLITCH,
    MASK,
    OFFSETS,
    PROXIMITY,
    SATURATION,
    STRIDE,
    gauss,
    mix,
    spread_between,
    tick_key,
    uniform,
)
from elib.simulator.physics.profiles import COUNT
from elib.simulator.physics.raycast import cast, see_near
from elib.simulator.physics.records import Records, Response, Robot, Scratch, SensorView, Setting
from elib.simulator.physics.sensors.ambient_light import AMBIENT_DEVIATION, darkness, lamplight

AMBIENT_MARGIN: Final = 4 * AMBIENT_DEVIATION
"""More than any noise of the reading with the emitter off, counts: below it that need not be looked up."""


MIN_GAIN: Final = 0.2
"""No sensor has less."""

OFFSET_SPREAD: Final = 120.0
"""Standard deviation of what the sensors of typical robots read in the open, counts; the mean is 200, and what they
read is log-normal: robots read 70 to 570, none 0 (measured-robots: infrared.open_offset)."""

MEDIAN_OFFSET: Final = 1.4292
"""Median of what they read in the open over its standard deviation: (200 / 120) / sqrt(1 + (120 / 200)^2)."""

OFFSET_BEND: Final = 0.5545
"""Standard deviation of its logarithm: sqrt(ln(1 + (120 / 200)^2))."""

DARKNESS_SPREAD: Final = 0.008
"""Relative standard deviation of what typical robots read with their emitters off, and so of the most that they read:
30 of 3790 counts (measured-robots: infrared.saturation)."""

LOST: Final = 0.10
"""Share of the readings of a typical e-puck2's front sensors that lose the light while the wheels turn: four of five
all of it, the others 70 % at least (measured-robots: infrared.glitches_while_driving_epuck2)."""

RAISED: Final = 0.12
"""Share of them that see 1.5 to 5 times the light, half of them less than 2.6 times (the same: of all readings that are
divided by the median of nine, the 90th, 95th and 99th percentile are 1.9, 3.0 and 4.4 to 5.5)."""

ENTRIES: Final = 1.0 / SPACING
"""Entries of the response table in a metre."""


@kernel
def vary_infrared(setting: Setting, robot: Robot) -> None:
    """Draw in what the infrared sensors of this specimen differ."""
    key = robot.key
    gains = spread_between(setting.spread, setting.gain_spread, GAIN_SPREAD)
    offsets = spread_between(setting.spread, setting.offset_spread, OFFSET_SPREAD)
    for s in range(COUNT):
        robot.gain[s] = max(1.0 + gains * gauss(key, GAIN + s), MIN_GAIN)
        robot.offset[s] = 0.0
        if offsets > 0.0:
            robot.offset[s] = offsets * MEDIAN_OFFSET * exponential(OFFSET_BEND * gauss(key, OFFSETS + s))
        robot.darkness[s] = 1.0 + setting.spread * DARKNESS_SPREAD * gauss(key, SATURATION + s)


@kernel
def glitch(key: int, sensor: int, spread: float) -> float:
    """Return the factor on the light that a front sensor of an e-puck2 sees in this tick while its wheels turn.

    Args:
        key: The robot's noise key of this tick.
        sensor: Its number.
        spread: Factor on how often it is not 1.
    """
    chance = uniform(key, GLITCH + sensor)
    lost = LOST * spread
    if chance < lost:
        return 0.3 * max(5.0 * chance / lost - 4.0, 0.0)
    chance = (chance - lost) / (RAISED * spread)
    return 1.5 + (1.0 + 2.5 * chance) * chance if chance < 1.0 else 1.0


@kernel
def read(world: Records, i: int) -> None:
    """Read the sensors of robot *i*, once a tick.

    The firmware samples one pair after the other, (0, 4), (1, 5), (2, 6), (3, 7). A reading is as old as its place in
    that row says, so a moving robot is looked up where it was then. What it looks at counts where it is now.
    """
    robot = world.robots[i]
    if robot.seen == world.setting[0].tick:
        return
    robot.seen = world.setting[0].tick
    look(world, i)
    respond(world, i)
    if robot.defects > 0:
        spoil(world, i)
    digest(robot, world.views[i])


@kernel
def forget(world: Records) -> None:
    """Forget the readings of this tick, after something changed that they depend on."""
    for i in range(len(world.robots)):
        world.robots[i].seen = -1


@kernel
def look(world: Records, i: int) -> None:
    """Find what comes back to each sensor of robot *i*, counts, and the deviation of its noise there."""
    setting = world.setting[0]
    robot = world.robots[i]
    scratch = see_near(world, i)
    last = setting.last_response
    dark = world.response[last].counts
    aim(setting, robot, scratch)
    for s in range(COUNT):
        scratch.light[s] = dark
        scratch.deviation[s] = world.response[last].deviation
    for k in range(setting.infrared_fans):
        fan = world.fans[k]
        cast(world, scratch, setting.sensors, fan)
        scale = fan.cosine * ENTRIES
        for s in range(COUNT):
            if k == 0 and scratch.ahead[s] < fan.reach:
                entry = scratch.ahead[s] * scratch.absorbs_ahead[s] * ENTRIES
                scratch.light[s] += setting.middle_share * (response(world.response, last, entry) - dark)
                scratch.deviation[s] = world.response[int(min(entry, 1.0 * last))].deviation
            if scratch.left[s] < fan.reach:
                entry = scratch.left[s] * scratch.absorbs_left[s] * scale
                scratch.light[s] += fan.share * (response(world.response, last, entry) - dark)
            if scratch.right[s] < fan.reach:
                entry = scratch.right[s] * scratch.absorbs_right[s] * scale
                scratch.light[s] += fan.share * (response(world.response, last, entry) - dark)


@kernel
def aim(setting: Setting, robot: Robot, scratch: Scratch) -> None:
    """Find where each sensor was when it was sampled, and where it looked, by the straight line of the last tick.

    The loop has no branches, so that Numba can work on several sensors at once.
    """
    share = robot.slot / setting.step
    for s in range(setting.sensors):
        age = share * setting.age[s]
        heading_x = robot.heading_x - age * (robot.heading_x - robot.before_heading_x)
        heading_y = robot.heading_y - age * (robot.heading_y - robot.before_heading_y)
        x = robot.x - age * (robot.x - robot.before_x)
        y = robot.y - age * (robot.y - robot.before_y)
        scratch.place_x[s] = x + heading_x * setting.place_x[s] - heading_y * setting.place_y[s]
        scratch.place_y[s] = y + heading_y * setting.place_x[s] + heading_x * setting.place_y[s]
        scratch.axis_x[s] = heading_x * setting.axis_x[s] - heading_y * setting.axis_y[s]
        scratch.axis_y[s] = heading_y * setting.axis_x[s] + heading_x * setting.axis_y[s]


@kernel
def response(table: Sequence[Response], last: int, entry: float) -> float:
    """Return the counts at a place between the entries of the response table."""
    if entry >= last:
        return table[last].counts
    below = int(entry)
    near = table[below].counts
    return near + (entry - below) * (table[below + 1].counts - near)


@kernel
def respond(world: Records, i: int) -> None:
    """Turn the light that comes back to the sensors of robot *i* into their readings."""
    setting = world.setting[0]
    robot = world.robots[i]
    scratch = world.scratch[robot.lane]
    view = world.views[i]
    noise = setting.sensor_noise
    margin = AMBIENT_MARGIN * noise
    # An e-puck2's sensors 0 and 7.
    is_shaken = (
        setting.spread > 0.0 and setting.generation == 2 and (robot.left_speed != 0.0 or robot.right_speed != 0.0)
    )
    is_lit = len(world.lamps) > 0
    is_shaded = False
    if is_lit:
        lamplight(world, i, False)
    key = tick_key(robot.key, setting.tick)
    word = 0
    for s in range(COUNT):
        light = scratch.light[s] * robot.gain[s]
        if is_shaken and s % 7 == 0:
            light *= glitch(key, s, setting.spread)
        light += robot.offset[s]
        if noise > 0.0:
            if s % 3 == 0:  # Three sensors share a word, ten bits each.
                word = mix((key + (PROXIMITY + s) * STRIDE) & MASK)
            light += scratch.deviation[s] * noise * world.tables[0].quantiles[word & 1023]
            word >>= 10
        room = setting.ambient * robot.darkness[s]
        if is_lit:
            room = scratch.room[s]
            if light > room - margin and not is_shaded:  # Only then do shadows matter, which cost a lot.
                is_shaded = True
                lamplight(world, i, True)
                room = scratch.room[s]
        if light > room - margin:
            light = min(light, darkness(key, s, noise, room))
        view.proximity[s] = int(max(light, 0.0) + 0.5)


@phase
def spoil(world: Records, i: int) -> None:
    """Spoil the readings of a robot in which something is broken: apart, so that others pay only for the question."""
    robot, view = world.robots[i], world.views[i]
    for s in range(COUNT):
        view.proximity[s] = spoiled_counts(world.setting[0], robot, PROXIMITY_AT + s, view.proximity[s])


@kernel
def digest(robot: Robot, view: SensorView) -> None:
    """Digest the readings of this tick."""
    n = view.proximity
    front = n[0] | n[1] << 12 | n[2] << 24 | n[3] << 36
    rear = n[4] | n[5] << 12 | n[6] << 24 | n[7] << 36
    word = ((robot.digest ^ front) * 0x735A2D97) & 0xFFFFFFFFFFFF
    word = (((word ^ (word >> 23)) ^ rear) * 0x21F0AAAD) & 0xFFFFFFFFFFFF
    robot.digest = word ^ (word >> 23)
