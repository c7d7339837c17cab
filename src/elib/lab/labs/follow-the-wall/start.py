"""Drive straight on, and print what the three sensors on the right see."""

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    robot.set_speed(0.3, 0.3)
    for _ in range(40):
        near = robot.proximity()
        print(near.front_right, near.diagonal_right, near.right)
        robot.sleep(0.1)
