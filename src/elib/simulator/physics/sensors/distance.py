"""The time-of-flight sensor of the e-puck2, looking forward.

Its light fills a cone, and all that comes back counts: five rays across the cone, each weighted by the light that it
brings back. So a thing that is narrower than the cone reads too far where something stands behind it. The sensor is 33
mm above the floor; lower things it does not see.
"""

from __future__ import annotations

from typing import Final

from elib.base.timeofflight import CALIBRATION, OFFSET, PLACE
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.defects import DISTANCE_AT, spoiled
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import DISTANCE, DISTANCE_OFFSET, NO_ECHO, gauss, tick_key, uniform
from elib.simulator.physics.raycast import cast, see_all
from elib.simulator.physics.records import Records

CONE = 0.44
"""Full width of the cone, rad (Webots): its rays stand at 0, 1/4 and 1/2 of it on both sides."""

REACH: Final = 2.0
"""m (data sheet of the VL53L0X). What is farther is not seen."""

TOUCHING: Final = 0.001
"""m. Nothing is nearer: the light of a ray has an end."""

TRUE: Final = tuple(true for true, _, _ in CALIBRATION)
READS: Final = tuple(reading for _, reading, _ in CALIBRATION)
DEVIATION: Final = tuple(deviation for _, _, deviation in CALIBRATION)
"""Noise of a reading there, m."""

UNSURE: Final = 0.9
NO_ECHO_SHARE: Final = 0.05
"""From so far on, m, a typical robot sees nothing in this share of its readings (measured-robots:
time_of_flight.epuck2: 1 % of all readings up to 1 m)."""


@kernel
def read(world: Records, i: int) -> None:
    """Read the time-of-flight sensor of robot *i*, m, before its own bias; 2 where it sees nothing.

    Along a ray at the angle a to the axis that meets something at r, the depth is z = r cos a, and the light that comes
    back falls with its square. So d = sum(1/z) / sum(1/z^2) over the rays that meet something: a wall straight ahead
    gives its distance. With equal weights this reads tubes of 3 and 5 cm as measured, to 8 mm (measured-robots:
    time_of_flight.narrow_objects). The robot's offset and the noise, whose deviation lies on straight lines between the
    rows of the table, are those of what the sensor reads.
    """
    robot = world.robots[i]
    setting = world.setting[0]
    scratch = see_all(world, i, REACH + RADIUS)
    axis_x = scratch.axis_x[0] = robot.heading_x
    axis_y = scratch.axis_y[0] = robot.heading_y
    scratch.place_x[0] = robot.x + axis_x * PLACE[0] - axis_y * PLACE[1]
    scratch.place_y[0] = robot.y + axis_y * PLACE[0] + axis_x * PLACE[1]
    first = len(world.fans) - 2
    near = 0.0
    light = 0.0
    for k in range(first, first + 2):
        fan = world.fans[k]
        cast(world, scratch, 1, fan)
        if k == first and scratch.ahead[0] < REACH:
            inverse = 1.0 / max(scratch.ahead[0], TOUCHING)
            near += inverse
            light += inverse * inverse
        for length in (scratch.left[0], scratch.right[0]):
            if length < REACH:
                inverse = 1.0 / max(length * fan.cosine, TOUCHING)
                near += inverse
                light += inverse * inverse
    distance = near / light if light > 0.0 else REACH
    noise = setting.sensor_noise
    if distance < REACH and (noise > 0.0 or setting.spread > 0.0):
        key = tick_key(robot.key, setting.tick)
        if distance > UNSURE and uniform(key, NO_ECHO) < setting.spread * NO_ECHO_SHARE:
            distance = REACH
        else:
            row = 1
            while TRUE[row] <= distance:
                row += 1
            width = TRUE[row] - TRUE[row - 1]
            share = (distance - TRUE[row - 1]) / width
            deviation = DEVIATION[row - 1] + (DEVIATION[row] - DEVIATION[row - 1]) * share
            error = noise * deviation * gauss(key, DISTANCE)
            error += setting.spread * OFFSET * gauss(robot.key, DISTANCE_OFFSET)
            distance += error * width / (READS[row] - READS[row - 1])
            distance = min(max(distance, TRUE[0]), REACH)
    if robot.defects > 0:
        distance = min(max(spoiled(setting, robot, DISTANCE_AT, distance), 0.0), REACH)
    world.views[i].distance = distance
