"""Drive for two seconds, and print what the robot sees meanwhile."""

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    robot.set_speed(0.3, 0.3)  # rev/s; one turn of a wheel is 12.9 cm
    for _ in range(20):
        near = robot.proximity()
        print(near.front_left, near.front_right)
        robot.sleep(0.1)
    robot.stop()
