# fails: go-10-cm: the robot drives backwards
import elib

with elib.connect() as robot:
    robot.drive(-0.10)
