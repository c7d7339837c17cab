# fails: lives: it drives over the feeders and does not stay on one for long enough

import elib

CRUISE = 0.5  # rev/s

with elib.connect() as robot:
    robot.calibrate_proximity()
    while True:
        near = robot.proximity()
        if near.front_right + near.front_left + near.diagonal_right + near.diagonal_left > 200:
            robot.set_speed(CRUISE / 2, -CRUISE / 2)
        else:
            robot.set_speed(CRUISE, CRUISE)
        robot.sleep(0.1)
