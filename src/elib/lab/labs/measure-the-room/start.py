"""Drive to the wall ahead, and print how far the robot has driven and how far away the wall is."""

import elib

with elib.connect() as robot:
    near = robot.distances()  # nothing is near: the robot learns what its sensors read in the open
    while near.ahead > 0.03:
        robot.set_speed(0.3, 0.3)
        robot.sleep(0.05)
        near = robot.distances()
    robot.stop()
    print("driven", robot.pose().x, "m; then the wall is", near.ahead, "m away")
