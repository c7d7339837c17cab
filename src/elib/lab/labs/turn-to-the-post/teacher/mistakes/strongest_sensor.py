# fails: faces: it turns to the sensor that sees most, but the post may stand between two sensors
import math

import elib

DIRECTIONS = (-17, -46, -90, -151, 151, 90, 46, 17)

with elib.connect() as robot:
    first = robot.proximity()
    robot.turn(math.pi)
    second = robot.proximity()
    near = [max(now - before, 0) for now, before in zip(second, first, strict=True)]
    robot.turn(math.radians(DIRECTIONS[near.index(max(near))]))
