"""Begin several calls, work meanwhile, and collect the answers when they are wanted."""

import sys

import elib

URL = sys.argv[1] if len(sys.argv) > 1 else "sim://?speed=max"

with elib.connect(URL) as robot:
    picture = robot.begin.image()
    near = robot.begin.within(2.0).proximity()  # sent when the picture is complete: one request at a time
    print("begun:", picture, near)
    squares = sum(number**2 for number in range(1000))  # your own work, while the robot answers
    print(f"the sum is {squares}; the picture has {picture.end().width} columns")
    print(f"front right {near.end().front_right}")
