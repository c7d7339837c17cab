"""Turn round in eight steps, and print what the two front sensors see of the light."""

import math

import elib

with elib.connect() as robot:
    for step in range(8):
        light = robot.ambient_light()
        print(f"{step * 45:3} degrees: {light.front_left} {light.front_right}")
        robot.turn(math.pi / 4)
