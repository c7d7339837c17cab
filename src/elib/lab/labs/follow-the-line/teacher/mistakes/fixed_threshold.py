# fails: on-the-line: it takes all below 900 for the line, but a grey floor gives less than that without a line
import elib

with elib.connect() as robot:
    while True:
        left, centre, right = robot.ground()[:3]
        if left < 900:
            robot.set_speed(0.1, 0.4)
        elif right < 900:
            robot.set_speed(0.4, 0.1)
        else:
            robot.set_speed(0.3, 0.3)
        robot.sleep(0.05)
