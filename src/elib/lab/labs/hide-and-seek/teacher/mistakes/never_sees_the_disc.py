# fails: catches: its limit for black is that of clean paint in a book, so it always hides

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    if max(robot.ground()[:3]) < 100:
        robot.set_speed(0.6, 0.6)
        while max(robot.proximity()) < 900:
            robot.sleep(0.05)
    else:
        robot.turn(2.47)
        robot.set_speed(0.95, 0.95)
        while max(robot.proximity()) < 900:
            robot.sleep(0.05)
    robot.stop()
