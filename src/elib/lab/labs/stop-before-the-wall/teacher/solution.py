"""Drive until the wall in front is 2 cm away, and stop."""

import elib

NEAR = 500  # what a wall at 2 cm gives

with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    robot.set_speed(0.2, 0.2)
    near = robot.proximity()
    while max(near.front_left, near.front_right) < NEAR:
        robot.sleep(0.05)
        near = robot.proximity()
    robot.stop()
