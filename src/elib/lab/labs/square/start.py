"""The first side of the square. What comes next, and how often?"""

import elib

with elib.connect() as robot:
    robot.drive(0.20)  # m
    print(robot.pose())
