"""Wander for a minute without touching anything: what is near slows the wheel of the other side."""

import elib

CRUISE = 0.3  # rev/s


def avoid(near: elib.Proximity) -> tuple[float, float]:
    """Return the speeds of the wheels, rev/s."""
    right = near.front_right + near.diagonal_right
    left = near.front_left + near.diagonal_left
    if near.front_right + near.front_left > 300:  # something is in the way: turn on the spot
        return (CRUISE / 2, -CRUISE / 2)
    return (max(-CRUISE, CRUISE - right / 1000), max(-CRUISE, CRUISE - left / 1000))


with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    while robot.time < 60:
        robot.set_speed(*avoid(robot.proximity()))
        robot.sleep(0.1)
