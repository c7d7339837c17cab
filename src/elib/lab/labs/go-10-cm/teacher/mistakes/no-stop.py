# fails: stop: the program leaves the robot driving
import elib

with elib.connect(keep_moving=True) as robot:
    robot.drive(0.10)
    robot.set_speed(0.02, 0.02)
