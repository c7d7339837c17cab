# fails: faces: it takes the sensors the wrong way round, and turns to the right for a post on the left
import math

import elib

DIRECTIONS = (17, 46, 90, 151, -151, -90, -46, -17)

with elib.connect() as robot:
    first = robot.proximity()
    robot.turn(math.pi)
    second = robot.proximity()
    near = [max(now - before, 0) for now, before in zip(second, first, strict=True)]
    ahead = sum(count * math.cos(math.radians(degrees)) for count, degrees in zip(near, DIRECTIONS, strict=True))
    left = sum(count * math.sin(math.radians(degrees)) for count, degrees in zip(near, DIRECTIONS, strict=True))
    robot.turn(math.atan2(left, ahead))
