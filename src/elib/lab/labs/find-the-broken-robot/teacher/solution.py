"""Let each robot read its sensors while it stands, turn round once, and see whether the lamp is where it was."""

import cmath
import math
import statistics

import elib
from elib.base.body import SENSOR_DIRECTIONS

STILL, WILD = 0.1, 40  # counts: each sensor has a noise of some 3
ASTRAY = 0.5  # rad


async def lamp(robot: elib.Epuck) -> complex:
    """Return where the lamp is, as a complex number whose angle is the direction. A low reading is bright."""
    light = await robot.ambient_light()
    return sum((4095 - count) * cmath.rect(1, way) for count, way in zip(light, SENSOR_DIRECTIONS, strict=True))


async def examine(robot: elib.Epuck) -> None:
    readings = []
    for _ in range(20):
        readings.append(await robot.proximity())
        await robot.sleep(0.1)
    noise = [statistics.pstdev(sensor) for sensor in zip(*readings, strict=True)]
    before = await lamp(robot)
    await robot.turn(2 * math.pi)
    turned = cmath.phase(await lamp(robot) / before)
    await robot.set_led(0, min(noise) < STILL or max(noise) > WILD or abs(turned) > ASTRAY)


async def main(robots: elib.Swarm) -> None:
    await robots.all.run(examine)
    await robots.all.sleep(1)


elib.swarm().run(main)
