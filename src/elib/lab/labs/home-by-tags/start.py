"""Turn round once, and print each tag that the camera sees."""

import math

import elib

with elib.connect() as robot:
    robot.set_camera(40, 40, 8, "grey")
    for _ in range(18):
        for tag in robot.tags(0.075):  # the black square is 7.5 cm wide
            heading = robot.pose().heading + tag.bearing
            print(
                "tag", tag.number, "is", round(tag.distance, 2), "m away, at", round(math.degrees(heading)), "degrees"
            )
        robot.turn(math.radians(20))
