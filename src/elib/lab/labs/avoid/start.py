"""Drive straight on and stop at the first obstacle. A good robot would turn away and go on."""

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    robot.set_speed(0.3, 0.3)
    near = robot.proximity()
    while near.front_left + near.front_right < 400:
        robot.sleep(0.05)
        near = robot.proximity()
    robot.stop()
    print("something is near:", near)
