"""Look around for the red box, drive to it, and stop in front of it."""

import math

import elib

NEAR = 150  # counts in front more than in the open: something is about 3 cm away
CLOSE = 40  # the same at 6 cm: from there on a picture takes too long
CRUISE = 0.3  # rev/s
STEERING = 0.3  # rev/s for each rad


def find_red(robot: elib.BlockingEpuck) -> float | None:
    """Take a picture; return in which direction something red is, rad to the left; None if there is nothing red."""
    picture = robot.image()
    red = picture.find("red")
    if red is None:
        return None
    pixel = [int(value) for value in picture.pixels[int(red.row), int(red.column)]]
    is_red = pixel[0] > 1.4 * max(pixel[1:])  # to some cameras a grey wall is a little red
    return picture.bearing(red.column) if is_red else None


with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    robot.set_camera(40, 40, 8, elib.CameraMode.COLOUR)
    empty = robot.proximity()  # Each sensor has its own reading where nothing is near.

    def ahead() -> int:
        """Return how much more than in the open the two sensors in front read, the higher one."""
        near = robot.proximity()
        return max(near.front_left - empty.front_left, near.front_right - empty.front_right)

    while (direction := find_red(robot)) is None:
        robot.turn(math.radians(12))
    robot.turn(direction)
    while (near := ahead()) < NEAR:
        direction = (find_red(robot) if near < CLOSE else None) or 0.0  # So near, the box may hide in its own shadow.
        robot.set_speed(CRUISE - STEERING * direction, CRUISE + STEERING * direction)
    robot.stop()
