# fails: on-the-line: it looks twice a second at nearly full speed, and is off the line before it looks again
import elib

with elib.connect() as robot:
    dark = 0.85 * max(robot.ground()[:3])
    while True:
        left, centre, right = robot.ground()[:3]
        if left < dark:
            robot.set_speed(0.3, 0.9)
        elif right < dark:
            robot.set_speed(0.9, 0.3)
        else:
            robot.set_speed(0.9, 0.9)
        robot.sleep(0.4)
