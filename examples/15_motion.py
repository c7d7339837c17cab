"""Drive a square to the millimetre, go home, and cancel a motion: step counters decide where it ends, not a clock."""

import math

import elib

URL = elib.robot_url("sim://square?speed=max")  # or what the command line names


def say(what: str, pose: elib.Pose) -> None:
    """Print where the robot stands by its step counters; it began at (0, 0), looking along x."""
    print(f"{what}: x {pose.x * 100:z.1f} cm, y {pose.y * 100:z.1f} cm, {math.degrees(pose.heading):z.0f} degrees")


with elib.connect(URL) as robot:
    for corner in range(1, 5):
        robot.drive(0.15)  # m
        say(f"corner {corner}", robot.turn(math.pi / 2))  # rad, positive to the left
    say("away", robot.go_to(0.20, 0.10))
    say("home", robot.go_to(0, 0, heading=0))
    long_way = robot.begin.drive(1.0, speed=0.05)  # begun: the program goes on meanwhile
    robot.sleep(2.0)
    say("under way", robot.pose())
    long_way.cancel()  # stops the robot
    robot.sleep(0.5)
    stopped = robot.pose()
    robot.sleep(1.0)
    print("it stands still" if robot.pose() == stopped else "it still moves")
