"""Look around for the red box, drive to it, and stop in front of it."""

import math

import elib

NEAR = 150  # counts in front more than in the open: something is about 3 cm away
CRUISE = 0.3  # rev/s
STEERING = 0.3  # rev/s for each rad


def find_red(robot: elib.BlockingEpuck) -> float | None:
    """Take a picture; return in which direction something red is, rad to the left; None if there is nothing red."""
    picture = robot.image()
    red = picture.find("red")
    return red.bearing if red else None


with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    robot.set_camera(40, 40, 8, elib.CameraMode.COLOUR)
    while (direction := find_red(robot)) is None:
        robot.turn(math.radians(12))
    robot.turn(direction)
    near = robot.proximity()
    while max(near.front_left, near.front_right) < NEAR:
        direction = find_red(robot) or 0.0  # so near, the box may fill the picture, or hide in its own shadow
        robot.set_speed(CRUISE - STEERING * direction, CRUISE + STEERING * direction)
        near = robot.proximity()
    robot.stop()
