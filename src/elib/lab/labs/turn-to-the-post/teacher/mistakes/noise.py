# fails: faces: it turns until a front sensor sees something, but a sensor that sees nothing is not always 0
import math

import elib

with elib.connect() as robot:
    near = robot.proximity()
    while near.front_left + near.front_right < 20:
        robot.turn(math.radians(5))
        near = robot.proximity()
