# fails: home: its odometry begins at 0, 0 wherever the robot stands, so this is not the way home
import elib

with elib.connect() as robot:
    robot.go_to(0.65, 0.25)
