"""Seek by driving ahead and turning where something is; hide at the first wall that comes up."""

import elib

SEEKS = 0.45  # rev/s
FLEES = 0.7


def ahead(near: elib.Proximity) -> float:
    """Return how near something is in front, counts."""
    return near.front_right + near.front_left + near.diagonal_right + near.diagonal_left


with elib.connect() as robot:
    robot.calibrate_proximity()
    seeks = max(robot.ground()[:3]) < 700
    robot.set_speed(SEEKS, SEEKS) if seeks else robot.set_speed(FLEES, FLEES)
    while True:
        near = robot.proximity()
        if ahead(near) > 700 and not seeks:
            robot.stop()
            break
        if ahead(near) > 700:
            is_right = near.front_right + near.diagonal_right > near.front_left + near.diagonal_left
            robot.turn(1.8 if is_right else -1.8)
            robot.set_speed(SEEKS, SEEKS)
        robot.sleep(0.05)
