# fails: on-the-line: it looks twice a second at nearly full speed, and is off the line before it looks again
import elib

with elib.connect() as robot:
    while True:
        left, centre, right = robot.ground()[:3]
        if left < 450:
            robot.set_speed(0.3, 0.9)
        elif right < 450:
            robot.set_speed(0.9, 0.3)
        else:
            robot.set_speed(0.9, 0.9)
        robot.sleep(0.4)
