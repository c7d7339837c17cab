# fails: found: much red alone is not red: a white wall has much of all three colours
import math

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    robot.set_camera(40, 40, 8, elib.CameraMode.COLOUR)
    while (robot.image().pixels[:, :, 0] > 60).sum() < 20:
        robot.turn(math.radians(25))
    near = robot.proximity()
    while max(near.front_left, near.front_right) < 250:
        robot.set_speed(0.2, 0.2)
        robot.sleep(0.05)
        near = robot.proximity()
    robot.stop()
