"""The infrared sensors with their emitters off: the room's light and that of lamps, in counts of the 12-bit converter.

The law is that of ARGoS' simulated sensor: a lamp of intensity I at distance d, seen under an angle a from the
sensor's axis, gives

    s = exp(-2 d / I) (1 - a / 90 degrees)    for d < 2.5 m and a < 90 degrees, else 0,

the lamps add up, and the reading falls with light (e-puck.md, 4):

    counts = base (1 - min(1, sum of s)), where the base differs a little from sensor to sensor.

d and a are those of the line in space from the sensor, 33 mm above the floor, to the lamp. What crosses this line
casts a shadow, if it is tall enough there: walls, boxes, cylinders and other robots. The robot's own body shades
its far side by the angle alone.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.simulator.physics.body import HEIGHT, RADIUS
from elib.simulator.physics.defects import AMBIENT_LIGHT_AT, spoiled_counts
from elib.simulator.physics.elementary import QUARTER_TURN, arc_cosine, exponential
from elib.simulator.physics.engine import kernel, phase
from elib.simulator.physics.noise import AMBIENT, gauss, tick_key
from elib.simulator.physics.profiles import COUNT
from elib.simulator.physics.raycast import SENSOR_HEIGHT
from elib.simulator.physics.records import Lamp, Records, Robot, Scratch, Segment, Setting

REACH: Final = 2.5
"""A lamp farther away gives nothing, m (ARGoS)."""

AMBIENT_DEVIATION: Final = 2.1
"""Noise of one reading of the room's light, counts: the difference of two has the 3 of a standing robot
(measured-robots: infrared.noise_at_rest)."""

RIM: Final = RADIUS
"""All sensors lie within it, m."""


@kernel
def read(world: Records, i: int) -> None:
    """Read the infrared sensors of robot *i* with their emitters off.

    What :func:`lamplight` finds, with 2 counts of noise; 0..4095, higher is darker.
    """
    lamplight(world, i, True)
    robot = world.robots[i]
    key = tick_key(robot.key, world.setting[0].tick)
    scratch = world.scratch[robot.lane]
    for s in range(COUNT):
        counts = darkness(key, s, world.setting[0].sensor_noise, scratch.room[s])
        world.views[i].ambient_light[s] = spoiled_counts(world.setting[0], robot, AMBIENT_LIGHT_AT + s, counts)


@kernel
def darkness(key: int, sensor: int, noise: float, room: float) -> int:
    """Return one sensor's reading with its emitter off, counts, 0..4095, higher is darker.

    Args:
        key: The robot's noise key of this tick.
        sensor: Its number.
        noise: Factor on the noise.
        room: The reading without noise, counts.
    """
    level = room + noise * AMBIENT_DEVIATION * gauss(key, AMBIENT + sensor)
    return int(min(max(level, 0.0), 4095.0) + 0.5)


@phase
def lamplight(world: Records, i: int, is_shaded: bool) -> None:
    """Find what each infrared sensor of robot *i* reads in the light of the room and of all lamps, without noise.

    Without *is_shaded* nothing casts a shadow: then the readings are the least that they can be. They go into ``room``
    of the robot's scratch.
    """
    robot = world.robots[i]
    scratch = world.scratch[robot.lane]
    setting = world.setting[0]
    for s in range(COUNT):
        scratch.place_x[s] = robot.x + robot.heading_x * setting.place_x[s] - robot.heading_y * setting.place_y[s]
        scratch.place_y[s] = robot.y + robot.heading_y * setting.place_x[s] + robot.heading_x * setting.place_y[s]
        scratch.room[s] = 0.0
    for k in range(len(world.lamps)):
        lamp = world.lamps[k]
        if (lamp.switch < 0 or world.zones[lamp.switch].is_on) and light_up(setting, robot, lamp, scratch):
            if is_shaded:
                shade(world, i, lamp)
            for s in range(COUNT):
                scratch.room[s] += scratch.share[s]
    for s in range(COUNT):
        scratch.room[s] = setting.ambient * robot.darkness[s] * (1.0 - min(scratch.room[s], 1.0))


@kernel
def light_up(setting: Setting, robot: Robot, lamp: Lamp, scratch: Scratch) -> bool:
    """Find what each sensor gets of a lamp if nothing is in the way; return whether any gets some.

    exp(-2 d / I) (1 - a / 90 degrees), nearer than 2.5 m and less than 90 degrees from the sensor's axis (ARGoS).
    """
    dx = lamp.x - robot.x
    dy = lamp.y - robot.y
    if dx * dx + dy * dy > (REACH + RIM) * (REACH + RIM):
        return False
    rise = lamp.height - SENSOR_HEIGHT
    is_lit = False
    for s in range(COUNT):
        axis_x = robot.heading_x * setting.axis_x[s] - robot.heading_y * setting.axis_y[s]
        axis_y = robot.heading_y * setting.axis_x[s] + robot.heading_x * setting.axis_y[s]
        dx = lamp.x - scratch.place_x[s]
        dy = lamp.y - scratch.place_y[s]
        facing = dx * axis_x + dy * axis_y
        square = dx * dx + dy * dy + rise * rise
        scratch.share[s] = 0.0
        if facing > 0.0 and 0.0 < square < REACH * REACH:
            distance = sqrt(square)
            angle = arc_cosine(facing / distance)
            scratch.share[s] = exponential(-2.0 * distance / lamp.intensity) * (1.0 - angle / QUARTER_TURN)
            is_lit = True
    return is_lit


@phase
def shade(world: Records, i: int, lamp: Lamp) -> None:
    """Take the lamp's light from every sensor of robot *i* where something stands in its way."""
    robot = world.robots[i]
    scratch = world.scratch[robot.lane]
    dx = lamp.x - robot.x
    dy = lamp.y - robot.y
    if dx * dx + dy * dy <= RIM * RIM:  # The lamp hangs over the robot.
        return
    for k in range(len(world.walls)):
        wall = world.walls[k]
        if may_hide(wall, robot, lamp):
            for s in range(COUNT):
                if scratch.share[s] > 0.0 and wall_hides(wall, scratch, s, lamp):
                    scratch.share[s] = 0.0
    for k in range(len(world.discs)):
        disc = world.discs[k]
        shade_by_disc(disc.x - robot.x, disc.y - robot.y, disc.radius, disc.height, robot, scratch, lamp)
    for k in range(len(world.robots)):
        other = world.robots[k]
        if k != i:
            shade_by_disc(other.x - robot.x, other.y - robot.y, other.radius, HEIGHT, robot, scratch, lamp)


@kernel
def passes_over(top: float, along: float, length: float, rise: float) -> bool:
    """Return whether the light passes above *top* wherever it is farther than *along* from the robot's middle, m.

    Its height grows from the sensor, up to :data:`RIM` away from the middle, to the lamp.
    """
    return rise > 0.0 and (top - SENSOR_HEIGHT) * (length + RIM) < rise * (along - RIM)


@kernel
def may_hide(wall: Segment, robot: Robot, lamp: Lamp) -> bool:
    """Return whether any part of a wall may stand between the lamp and a sensor of the robot: a quick look."""
    to_x = lamp.x - robot.x
    to_y = lamp.y - robot.y
    length = sqrt(to_x * to_x + to_y * to_y)
    along_x = to_x / length
    along_y = to_y / length
    dx = wall.x - robot.x
    dy = wall.y - robot.y
    # Nothing of it lies beside the way of the light if both ends are on the same side, or before or behind it.
    across = dy * along_x - dx * along_y
    other = across + wall.length * (wall.tangent_y * along_x - wall.tangent_x * along_y)
    if (across > RIM and other > RIM) or (across < -RIM and other < -RIM):
        return False
    along = dx * along_x + dy * along_y
    other = along + wall.length * (wall.tangent_x * along_x + wall.tangent_y * along_y)
    if (along > length and other > length) or (along < -RIM and other < -RIM):
        return False
    return not passes_over(wall.height, min(along, other) - RIM, length, lamp.height - SENSOR_HEIGHT)


@kernel
def wall_hides(wall: Segment, scratch: Scratch, s: int, lamp: Lamp) -> bool:
    """Return whether a wall stands between the lamp and sensor *s*.

    The light's way from the sensor is t * way, 0 < t < 1. It crosses the wall's line at one t, if at all.
    """
    way_x = lamp.x - scratch.place_x[s]
    way_y = lamp.y - scratch.place_y[s]
    from_x = wall.x - scratch.place_x[s]
    from_y = wall.y - scratch.place_y[s]
    crossing = way_x * wall.tangent_y - way_y * wall.tangent_x
    to_wall = from_x * wall.tangent_y - from_y * wall.tangent_x
    along = from_x * way_y - from_y * way_x
    if crossing < 0.0:
        crossing = -crossing
        to_wall = -to_wall
        along = -along
    if not (0.0 < to_wall < crossing and 0.0 <= along <= wall.length * crossing):
        return False
    return (SENSOR_HEIGHT - wall.height) * crossing + (lamp.height - SENSOR_HEIGHT) * to_wall < 0.0


@kernel
def shade_by_disc(dx: float, dy: float, radius: float, top: float, robot: Robot, scratch: Scratch, lamp: Lamp) -> None:
    """Take the lamp's light from the sensors behind a round thing whose centre is (dx, dy) from the robot's, m."""
    to_x = lamp.x - robot.x
    to_y = lamp.y - robot.y
    rise = lamp.height - SENSOR_HEIGHT
    length = sqrt(to_x * to_x + to_y * to_y)
    along = (dx * to_x + dy * to_y) / length
    across = (dy * to_x - dx * to_y) / length
    beside = radius + RIM
    if across > beside or across < -beside or along < -beside or along > length + radius:
        return
    if passes_over(top, along - beside, length, rise):
        return
    for s in range(COUNT):
        if scratch.share[s] == 0.0:
            continue
        way_x = lamp.x - scratch.place_x[s]
        way_y = lamp.y - scratch.place_y[s]
        from_x = robot.x + dx - scratch.place_x[s]
        from_y = robot.y + dy - scratch.place_y[s]
        square = way_x * way_x + way_y * way_y
        middle = from_x * way_x + from_y * way_y
        under = middle * middle - square * (from_x * from_x + from_y * from_y - radius * radius)
        if under <= 0.0 or square == 0.0:
            continue
        half = sqrt(under)
        enters = max((middle - half) / square, 0.0)
        leaves = min((middle + half) / square, 1.0)
        lowest = enters if rise > 0.0 else leaves
        if enters < leaves and SENSOR_HEIGHT + rise * lowest < top:
            scratch.share[s] = 0.0
