# fails: found: the left of a picture is the robot's left, so red on the right needs a turn to the right
import math

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    robot.set_camera(40, 40, 8, elib.CameraMode.COLOUR)
    near = robot.proximity()
    while max(near.front_left, near.front_right) < 250:
        red = robot.image().find("red")
        if red is None:
            robot.turn(math.radians(10))
        else:
            robot.set_speed(0.2 - 0.01 * (red.column - 20), 0.2 + 0.01 * (red.column - 20))
        near = robot.proximity()
    robot.stop()
