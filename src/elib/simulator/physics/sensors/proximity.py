"""The eight infrared sensors: the light of their emitters that comes back, in counts of the 12-bit converter.

A sensor's reading is the weighted mean of what its rays see, each by the table of the profile
(:mod:`elib.simulator.physics.profiles`), then

    counts = gain * light + offset + noise, at most what the sensor reads with its emitter off,

because the firmware sends the difference of two measurements.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from elib.base.infrared import SPACING
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import MASK, PROXIMITY, STRIDE, mix, tick_key
from elib.simulator.physics.profiles import COUNT
from elib.simulator.physics.raycast import PRESSED, cast, see_near
from elib.simulator.physics.records import Records, Response, Robot, Scratch, SensorView, Setting
from elib.simulator.physics.sensors.ambient_light import AMBIENT_DEVIATION, darkness, lamplight

AMBIENT_MARGIN: Final = 4 * AMBIENT_DEVIATION
"""More than any noise of the reading with the emitter off, counts: below it that need not be looked up."""


ENTRIES: Final = 1.0 / SPACING
"""Entries of the response table in a metre."""


FAR: Final = 1e9
"""m. Clearance of a sensor around which there is nothing."""

MARGIN: Final = 1e-6
"""m. Rounding must not leave out what a ray can meet."""


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
    aim(setting, robot, scratch)
    sort_out(world, scratch)
    for s in range(COUNT):
        scratch.light[s] = world.response[last].counts
        scratch.deviation[s] = world.response[last].deviation
        scratch.ahead[s] = world.fans[0].reach
        if scratch.clearance[s] > 0.0:
            continue
        x = scratch.place_x[s]
        y = scratch.place_y[s]
        axis_x = scratch.axis_x[s]
        axis_y = scratch.axis_y[s]
        light = 0.0
        for k in range(setting.infrared_fans):
            fan = world.fans[k]
            ahead, left, right, absorbs, absorbs_left, absorbs_right = cast(world, scratch, x, y, axis_x, axis_y, fan)
            if k == 0:
                scratch.ahead[s] = ahead
                entry = ahead * absorbs * ENTRIES
                light = setting.middle_share * response(world.response, last, entry)
                scratch.deviation[s] = world.response[int(min(entry, 1.0 * last))].deviation
            scale = fan.cosine * ENTRIES
            light += fan.share * response(world.response, last, left * absorbs_left * scale)
            light += fan.share * response(world.response, last, right * absorbs_right * scale)
        scratch.light[s] = light


@kernel
def aim(setting: Setting, robot: Robot, scratch: Scratch) -> None:
    """Find where each sensor was when it was sampled, and where it looked, by the straight line of the last tick.

    These loops over all sensors have no branches, so that Numba can work on several sensors at once.
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
        # A sensor that was sampled before the last tick looks along a vector longer than 1: nothing is left out then.
        scratch.clearance[s] = FAR if age <= 1.0 else 0.0


@kernel
def sort_out(world: Records, scratch: Scratch) -> None:
    """Find which sensors can see anything at all: most cannot, and need cast no rays."""
    count = world.setting[0].sensors
    fan = world.fans[world.setting[0].infrared_fans - 1]  # The widest one.
    cosine = fan.cosine
    sine = fan.sine
    reach = fan.reach
    for k in range(scratch.first_wall, scratch.end_wall):
        x = world.visible_walls[k].x
        y = world.visible_walls[k].y
        tangent_x = world.visible_walls[k].tangent_x
        tangent_y = world.visible_walls[k].tangent_y
        for s in range(count):
            closing = tangent_x * scratch.axis_y[s] - tangent_y * scratch.axis_x[s]
            sliding = tangent_x * scratch.axis_x[s] + tangent_y * scratch.axis_y[s]
            gap = tangent_x * (y - scratch.place_y[s]) - tangent_y * (x - scratch.place_x[s])
            closing = closing if gap > -PRESSED else -closing
            # The ray that closes fastest: the outermost one, unless the shortest way to the wall's line lies between.
            fastest = 1.0 if closing > cosine else closing * cosine + abs(sliding) * sine
            scratch.clearance[s] = min(scratch.clearance[s], abs(gap) - reach * fastest - MARGIN)
    for k in range(scratch.first_disc, scratch.end_disc):
        x = world.visible_discs[k].x
        y = world.visible_discs[k].y
        radius = world.visible_discs[k].radius
        for s in range(count):
            from_x = x - scratch.place_x[s]
            from_y = y - scratch.place_y[s]
            closing = from_x * scratch.axis_x[s] + from_y * scratch.axis_y[s]
            aside = from_y * scratch.axis_x[s] - from_x * scratch.axis_y[s]
            # How far the disc is beyond the outermost ray, or behind the sensor.
            beyond = max(abs(aside) * cosine - closing * sine, -closing) - radius
            scratch.clearance[s] = min(scratch.clearance[s], beyond - MARGIN)


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
    room = setting.ambient
    is_uneven = setting.gain_spread > 0.0 or setting.offset_spread > 0.0
    is_lit = len(world.lamps) > 0
    is_shaded = False
    if is_lit:
        lamplight(world, i, False)
    key = tick_key(robot.key, setting.tick)
    word = 0
    for s in range(COUNT):
        light = scratch.light[s]
        if is_uneven:
            light = light * robot.gain[s] + robot.offset[s]
        if noise > 0.0:
            if s % 3 == 0:  # Three sensors share a word, ten bits each.
                word = mix((key + (PROXIMITY + s) * STRIDE) & MASK)
            light += scratch.deviation[s] * noise * world.tables[0].quantiles[word & 1023]
            word >>= 10
        if is_lit:
            room = scratch.room[s]
            if light > room - margin and not is_shaded:  # Only then do shadows matter, which cost a lot.
                is_shaded = True
                lamplight(world, i, True)
                room = scratch.room[s]
        if light > room - margin:
            light = min(light, darkness(key, s, noise, room))
        view.proximity[s] = int(max(light, 0.0) + 0.5)


@kernel
def digest(robot: Robot, view: SensorView) -> None:
    """Digest the readings of this tick."""
    n = view.proximity
    front = n[0] | n[1] << 12 | n[2] << 24 | n[3] << 36
    rear = n[4] | n[5] << 12 | n[6] << 24 | n[7] << 36
    word = ((robot.digest ^ front) * 0x735A2D97) & 0xFFFFFFFFFFFF
    word = (((word ^ (word >> 23)) ^ rear) * 0x21F0AAAD) & 0xFFFFFFFFFFFF
    robot.digest = word ^ (word >> 23)
