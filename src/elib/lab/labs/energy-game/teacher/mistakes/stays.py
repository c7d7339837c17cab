# fails: eats: it stays on the first feeder for ever, which gives less than the robot uses once it is empty

import elib

CRUISE = 0.4  # rev/s

with elib.connect() as robot:
    floor = min(robot.ground()[:3])
    robot.set_speed(CRUISE, CRUISE)
    while max(robot.ground()[:3]) > 0.8 * floor:
        robot.sleep(0.1)
    robot.drive(0.07)
    robot.sleep(90)
