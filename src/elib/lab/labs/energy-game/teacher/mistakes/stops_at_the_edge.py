# fails: lives: it stops where its sensors see the feeder, and its middle is not there yet

import elib

CRUISE = 0.4  # rev/s

with elib.connect() as robot:
    robot.calibrate_proximity()
    floor = min(robot.ground()[:3])
    while True:
        near = robot.proximity()
        if near.front_right + near.front_left + near.diagonal_right + near.diagonal_left > 200:
            robot.set_speed(CRUISE / 2, -CRUISE / 2)
        elif max(robot.ground()[:3]) < 0.8 * floor:
            robot.stop()
            robot.sleep(4.5)
            robot.drive(0.25)
        else:
            robot.set_speed(CRUISE, CRUISE)
        robot.sleep(0.1)
