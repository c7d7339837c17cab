# fails: wanders: it stops at the first obstacle and waits for it to go away
import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    while robot.time < 60:
        near = robot.proximity()
        if near.front_left + near.front_right + near.diagonal_left + near.diagonal_right > 300:
            robot.stop()
        else:
            robot.set_speed(0.4, 0.4)
        robot.sleep(0.1)
