# fails: out: it drives the way through the given maze by heart, and is lost in every other one
import math

import elib

LEFT, RIGHT = math.pi / 2, -math.pi / 2
WAY = ((0, 1), (LEFT, 1), (RIGHT, 1), (RIGHT, 1), (LEFT, 1), (LEFT, 2), (LEFT, 1), (RIGHT, 1), (RIGHT, 1))

with elib.connect() as robot:
    for angle, cells in WAY:
        robot.turn(angle)
        robot.drive(0.2 * cells)
