"""Drive a square of 20 cm, always to the left, and come home."""

import math

import elib

with elib.connect() as robot:
    for _ in range(4):
        robot.drive(0.20)
        robot.turn(math.pi / 2)
