# fails: close: it takes the reading for a distance, but higher is nearer, so it stops at once
import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    robot.set_speed(0.2, 0.2)
    while robot.proximity().front_left > 500:
        robot.sleep(0.05)
    robot.stop()
