# fails: no-contact: it drives a distance that it guessed, and does not look how near the box is
import math

import elib

with elib.connect() as robot:
    robot.set_camera(40, 40, 8, elib.CameraMode.COLOUR)
    while True:
        pixels = robot.image().pixels.astype(int)
        is_red = (pixels[:, :, 0] > 2 * pixels[:, :, 1]) & (pixels[:, :, 0] > 2 * pixels[:, :, 2])
        if is_red.sum() > 20:
            break
        robot.turn(math.radians(25))
    robot.turn(math.radians(30) * (0.5 - is_red.nonzero()[1].mean() / 39))
    robot.drive(0.27)
