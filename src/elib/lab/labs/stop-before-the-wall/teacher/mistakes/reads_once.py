# fails: close: it reads the sensors once and then asks its own variable for ever, which never changes
import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    near = robot.proximity()
    robot.set_speed(0.2, 0.2)
    while near.front_left < 500:
        robot.sleep(0.1)
    robot.stop()
