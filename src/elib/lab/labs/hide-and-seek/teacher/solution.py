"""Seek along the walls and close to all that comes up; hide in a corner behind the robot that seeks."""

import elib

SEEKS = 0.6  # rev/s
FLEES = 0.95
CLOSE = 900  # counts: a centimetre


def seek(robot: elib.BlockingEpuck) -> None:
    """Follow the walls on the right, and come so close to what is ahead that it would be caught."""
    turns = 0.0  # s until which it looks for the wall
    while True:
        near = robot.proximity()
        beside = near.right + near.diagonal_right
        if max(near.front_right, near.front_left) > CLOSE:
            robot.turn(1.0)
        elif beside > 120:
            bend = max(-0.3, min(0.3, 0.0005 * (beside - 500)))
            robot.set_speed(SEEKS - bend, SEEKS + bend)
            turns = robot.time + 1.0
        elif robot.time < turns:
            robot.set_speed(SEEKS, SEEKS / 3)
        else:
            robot.set_speed(SEEKS, SEEKS)
        robot.sleep(0.05)


def hide(robot: elib.BlockingEpuck) -> None:
    """Turn back, drive past the other robot into the corner behind it, and stand there."""
    robot.turn(2.47)
    robot.set_speed(FLEES, FLEES)
    while max(robot.proximity()) < CLOSE:
        robot.sleep(0.05)
    robot.stop()


with elib.connect() as robot:
    robot.calibrate_proximity()
    seek(robot) if max(robot.ground()[:3]) < 700 else hide(robot)
