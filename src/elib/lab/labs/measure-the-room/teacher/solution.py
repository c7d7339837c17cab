"""Drive from wall to wall along the room, then across it, and print how far the walls are apart."""

import math

import elib
from elib.base.body import SENSOR_DIRECTIONS, SENSOR_RADIUS


def to_wall(robot: elib.BlockingEpuck) -> float:
    """Drive to the wall ahead, and stand square to it; return how far it is from the middle of the robot, m."""
    near = robot.distances()
    while near.ahead > 0.02:
        robot.set_speed(0.3, 0.3)
        robot.sleep(0.05)
        near = robot.distances()
    robot.stop()
    for _ in range(5):
        near = robot.distances()
        robot.turn(max(-0.2, min(0.2, 10 * (near.front_right - near.front_left))))
    near = robot.distances()
    away = SENSOR_RADIUS + (near.front_left + near.front_right) / 2
    return away * math.cos(SENSOR_DIRECTIONS[0])  # both look a little aside


def side(robot: elib.BlockingEpuck) -> float:
    """Return how far the wall ahead is from the one behind, m; the robot then stands in the middle between them."""
    before = to_wall(robot)
    robot.turn(math.pi)
    start = robot.pose()
    after = to_wall(robot)
    end = robot.pose()
    length = before + math.dist((start.x, start.y), (end.x, end.y)) + after
    robot.turn(math.pi)
    robot.drive(length / 2 - after)
    return length


with elib.connect() as robot:
    robot.distances()  # nothing is near: the robot learns what its sensors read in the open
    length = side(robot)
    robot.turn(math.pi / 2)
    print(f"room {length:.3f} {side(robot):.3f}")
