# fails: no-contact: it drives on until the robot is pushed against the wall, because that is nearer than its eyes see
import math

import elib
from elib.base.body import RADIUS


def side(robot):
    for _ in range(2):
        start = robot.pose()
        robot.set_speed(0.3, 0.3)
        while robot.distances().ahead > 0.02:
            robot.sleep(0.05)
        robot.sleep(0.6)
        robot.stop()
        end = robot.pose()
        robot.drive(-0.03)
        robot.turn(math.pi)
    length = math.dist((start.x, start.y), (end.x, end.y)) + 0.03 + 2 * RADIUS
    robot.drive(length / 2 - RADIUS - 0.03)
    return length


with elib.connect() as robot:
    robot.distances()
    length = side(robot)
    robot.turn(math.pi / 2)
    print(f"room {length:.3f} {side(robot):.3f}")
