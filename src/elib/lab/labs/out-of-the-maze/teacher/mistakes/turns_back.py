# fails: out: it turns round at every wall, so it drives to and fro in one passage
import math

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    floor = max(robot.ground()[:3])
    while max(robot.ground()[:3]) > 0.85 * floor:
        near = robot.proximity()
        if max(near.front_right, near.front_left) > 200:
            robot.turn(math.pi)
        robot.set_speed(0.4, 0.4)
        robot.sleep(0.1)
    robot.stop()
