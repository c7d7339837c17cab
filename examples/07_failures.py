"""Handle the failures that a program should expect, on a link that loses every fifth answer."""

import sys

import elib

URL = elib.robot_url("sim://?speed=max&loss=0.2&seed=3")  # or what the command line names

try:
    with elib.connect(URL) as robot:
        heard = missed = 0
        for _ in range(50):
            try:
                robot.within(0.3).proximity()
                heard += 1
            except elib.ReplyTimeout:
                missed += 1  # the robot may have received it; for a reading that does not matter
        print(f"{heard} readings, {missed} missed, {robot.statistics.resyncs} resyncs")
        try:
            robot.set_speed(3, 3)
        except elib.ArgumentError as error:
            print("a wrong call:", error.message)
        try:
            robot.distance()
        except elib.Unsupported as error:
            print("a missing device:", error.message)
except elib.LinkError as error:
    sys.exit(f"no robot: {error}")
