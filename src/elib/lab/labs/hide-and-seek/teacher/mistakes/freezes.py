# fails: catches: it stands where it is when it has to hide, and the other robot comes straight on

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    if max(robot.ground()[:3]) < 700:
        robot.set_speed(0.6, 0.6)
        while max(robot.proximity()) < 900:
            robot.sleep(0.05)
        robot.stop()
