"""Drive straight on for 3 s, and print what the ground sensors see when the line bends away."""

import elib

with elib.connect() as robot:
    robot.set_speed(0.3, 0.3)
    for _ in range(30):
        left, centre, right = robot.ground()[:3]
        print(left, centre, right)
        robot.sleep(0.1)
