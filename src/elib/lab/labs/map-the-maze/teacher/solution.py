"""Follow the wall on the right, let straight walls tell the heading, and print the map."""

import math

import elib
from elib.behaviours.wall_following import follow

STRETCH = 16  # looks: about 7 cm
DRIVE = 115  # s: once round


def wrong_by(looks: list[tuple[elib.Pose, float]]) -> float:
    """Return by how much the heading of odometry is wrong, rad; 0 where no straight wall tells it.

    Each look is a pose, and how far away the wall on the right was there.
    """
    (first, before), (last, now) = looks[0], looks[-1]
    turned = [math.remainder(pose.heading - last.heading, math.tau) for pose, _ in looks]
    beside = [each for _, each in looks]
    is_straight = max(beside) < 0.05 and max(beside) - min(beside) < 0.008 and max(turned) - min(turned) < 0.25
    if len(looks) < STRETCH or not is_straight:
        return 0.0
    away = math.atan2(now - before, math.dist((first.x, first.y), (last.x, last.y)))  # from the wall's direction
    wall = last.heading + sum(turned) / len(turned) - away
    return math.remainder(wall, math.tau / 4)  # walls stand at 0, 90, 180 and 270 degrees


grid = elib.Grid()
with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    looks, wheels = [], elib.Wheels(0, 0)
    while robot.time < DRIVE:
        wheels = follow(robot.proximity(), wheels, distance=0.025, cruise=0.35)
        robot.set_speed(*wheels)
        near, pose = robot.distances(), robot.pose()
        grid.add(pose, near)
        looks = [*looks[1 - STRETCH :], (pose, near.right)]
        if error := wrong_by(looks):
            robot.set_pose(pose.x, pose.y, pose.heading - error)
            looks = []
        robot.sleep(0.05)
    robot.stop()
print(grid.to_text())
