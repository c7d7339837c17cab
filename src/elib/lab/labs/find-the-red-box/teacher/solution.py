"""Look around for the red box, drive to it, and stop in front of it."""

import math

import elib

VIEW = math.radians(30)  # what the camera sees from left to right
ENOUGH = 20  # red pixels; fewer may be noise
NEAR = 300  # counts in front: something is about 2 cm away
CRUISE = 0.2  # rev/s
STEERING = 0.3  # rev/s for each rad


def find_red(robot: elib.BlockingEpuck) -> tuple[int, float]:
    """Take a picture; return how many pixels are red, and in which direction they are, rad to the left."""
    pixels = robot.image().pixels.astype(int)
    red, green, blue = pixels[:, :, 0], pixels[:, :, 1], pixels[:, :, 2]
    is_red = (red > 2 * green) & (red > 2 * blue)
    if not is_red.any():
        return 0, 0.0
    columns = is_red.nonzero()[1]
    return len(columns), VIEW * (0.5 - columns.mean() / 39)


with elib.connect() as robot:
    robot.set_camera(40, 40, 8, elib.CameraMode.COLOUR)
    count, direction = find_red(robot)
    while count < ENOUGH:
        robot.turn(math.radians(25))
        count, direction = find_red(robot)
    robot.turn(direction)
    near = robot.proximity()
    while max(near.front_left, near.front_right) < NEAR:
        count, direction = find_red(robot)
        robot.set_speed(CRUISE - STEERING * direction, CRUISE + STEERING * direction)
        near = robot.proximity()
    robot.stop()
