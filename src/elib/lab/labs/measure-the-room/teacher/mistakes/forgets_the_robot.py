# fails: size: it adds only what it drove, and forgets its own body and the gap to the wall at both ends
import math

import elib


def to_wall(robot):
    robot.set_speed(0.3, 0.3)
    while robot.distances().ahead > 0.03:
        robot.sleep(0.05)
    robot.stop()


def side(robot):
    to_wall(robot)
    robot.turn(math.pi)
    start = robot.pose()
    to_wall(robot)
    end = robot.pose()
    length = math.dist((start.x, start.y), (end.x, end.y))
    robot.turn(math.pi)
    robot.drive(length / 2)
    return length


with elib.connect() as robot:
    robot.distances()
    length = side(robot)
    robot.turn(math.pi / 2)
    print(f"room {length:.3f} {side(robot):.3f}")
