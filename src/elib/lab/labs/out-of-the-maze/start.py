"""Drive to the first wall, and print what the ground sensors see."""

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    print("the floor:", robot.ground()[:3])
    robot.set_speed(0.3, 0.3)
    near = robot.proximity()
    while max(near.front_right, near.front_left) < 200:
        robot.sleep(0.05)
        near = robot.proximity()
    robot.stop()
    print("a wall ahead; to the left", near.left, "and to the right", near.right)
