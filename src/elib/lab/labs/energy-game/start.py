"""Drive ahead for a moment, and print what the sensors on the floor and the lamps say."""

import elib

with elib.connect() as robot:
    robot.drive(0.1)
    print("floor:", robot.ground())
    print("light:", robot.ambient_light())
