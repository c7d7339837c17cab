# fails: found: the left of a picture is the robot's left, so red on the right needs a turn to the right
import math

import elib

with elib.connect() as robot:
    robot.set_camera(40, 40, 8, elib.CameraMode.COLOUR)
    near = robot.proximity()
    while max(near.front_left, near.front_right) < 300:
        pixels = robot.image().pixels.astype(int)
        is_red = (pixels[:, :, 0] > 2 * pixels[:, :, 1]) & (pixels[:, :, 0] > 2 * pixels[:, :, 2])
        if is_red.sum() < 20:
            robot.turn(math.radians(10))
        else:
            column = is_red.nonzero()[1].mean()
            robot.set_speed(0.2 - 0.01 * (column - 20), 0.2 + 0.01 * (column - 20))
        near = robot.proximity()
    robot.stop()
