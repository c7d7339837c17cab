"""Begin several calls, work meanwhile, and collect the answers when you need them."""

import elib

URL = elib.robot_url("sim://?speed=max")  # or what the command line names

with elib.connect(URL) as robot:
    picture = robot.begin.image()
    near = robot.begin.within(2.0).proximity()  # sent when the picture is complete: one request at a time
    print("begun:", picture, near)
    squares = sum(number**2 for number in range(1000))  # your own work, while the robot answers
    print(f"the sum is {squares}; the picture has {picture.end().width} columns")
    print(f"front right {near.end().front_right}")
