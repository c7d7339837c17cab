# fails: size: it measures from where it started to one wall, and takes twice that for the room
import math

import elib

with elib.connect() as robot:
    robot.distances()
    sides = []
    for _ in range(2):
        start = robot.pose()
        robot.set_speed(0.3, 0.3)
        while robot.distances().ahead > 0.03:
            robot.sleep(0.05)
        robot.stop()
        end = robot.pose()
        driven = math.dist((start.x, start.y), (end.x, end.y))
        sides.append(2 * (driven + 0.03 + 0.037))
        robot.drive(-driven)
        robot.turn(math.pi / 2)
    print("room", *sides)
