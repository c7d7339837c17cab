# fails: home: a square has four sides, and range(3) counts three
import math

import elib

with elib.connect() as robot:
    for _ in range(3):
        robot.drive(0.20)
        robot.turn(math.pi / 2)
