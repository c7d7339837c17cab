# fails: wanders: left and right are exchanged, so the robot turns towards what it sees, and stays there
import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    while robot.time < 60:
        near = robot.proximity()
        right = near.front_right + near.diagonal_right
        left = near.front_left + near.diagonal_left
        robot.set_speed(max(-0.4, 0.4 - left / 1000), max(-0.4, 0.4 - right / 1000))
        robot.sleep(0.1)
