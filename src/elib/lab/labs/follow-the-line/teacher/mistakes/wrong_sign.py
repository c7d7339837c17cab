# fails: once-round: it turns to the right when the line is on the left, and leaves it at once
import elib

with elib.connect() as robot:
    dark = 0.85 * max(robot.ground()[:3])
    while True:
        left, centre, right = robot.ground()[:3]
        if left < dark:
            robot.set_speed(0.4, 0.1)
        elif right < dark:
            robot.set_speed(0.1, 0.4)
        else:
            robot.set_speed(0.3, 0.3)
        robot.sleep(0.05)
