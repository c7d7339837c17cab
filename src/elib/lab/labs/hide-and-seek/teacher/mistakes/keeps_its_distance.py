# fails: catches: it turns away from the robot that hides as from a wall, before it is near enough

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    if max(robot.ground()[:3]) < 700:
        while True:
            near = robot.proximity()
            if max(near) > 80:
                robot.turn(1.8)
            robot.set_speed(0.6, 0.6)
            robot.sleep(0.05)
    else:
        robot.turn(2.47)
        robot.set_speed(0.95, 0.95)
        while max(robot.proximity()) < 900:
            robot.sleep(0.05)
        robot.stop()
