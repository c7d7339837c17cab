# fails: no-contact: it looks once a second, and drives 5 cm from one look to the next
import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    while robot.time < 60:
        near = robot.proximity()
        if near.front_left + near.front_right + near.diagonal_left + near.diagonal_right > 300:
            robot.set_speed(0.2, -0.2)
        else:
            robot.set_speed(0.4, 0.4)
        robot.sleep(1)
