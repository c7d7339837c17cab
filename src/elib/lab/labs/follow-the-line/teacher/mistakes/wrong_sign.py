# fails: once-round: it turns to the right when the line is on the left, and leaves it at once
import elib

with elib.connect() as robot:
    while True:
        left, centre, right = robot.ground()[:3]
        if left < 450:
            robot.set_speed(0.4, 0.1)
        elif right < 450:
            robot.set_speed(0.1, 0.4)
        else:
            robot.set_speed(0.3, 0.3)
        robot.sleep(0.05)
