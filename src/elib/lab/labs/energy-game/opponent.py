"""Wander, and rest for a while on each feeder that comes up."""

import elib

CRUISE = 0.5  # rev/s
REST = 2.0  # s on a feeder

with elib.connect() as robot:
    robot.calibrate_proximity()
    floor = min(robot.ground()[:3])
    while True:
        near = robot.proximity()
        if near.front_right + near.front_left + near.diagonal_right + near.diagonal_left > 200:
            robot.set_speed(CRUISE / 2, -CRUISE / 2)
        else:
            robot.set_speed(CRUISE, CRUISE)
        if max(robot.ground()[:3]) < 0.8 * floor:
            robot.drive(0.05)
            robot.sleep(REST)
            robot.drive(0.2)
        robot.sleep(0.1)
