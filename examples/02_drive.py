"""Drive a square by the wheel encoders."""

import math

import elib

URL = elib.robot_url("sim://square?speed=max")  # or what the command line names
STEPS_PER_METRE = 1000 / 0.1288  # a turn of the wheel is 1000 steps and 12.88 cm
AXLE = 0.053  # m between the wheels


def move(robot: elib.BlockingEpuck, left: float, right: float, metres: float) -> None:
    """Turn the wheels at these speeds, rev/s, until each has driven this distance."""
    robot.set_encoders(0, 0)
    robot.set_speed(left, right)
    while abs(robot.encoders().left) < metres * STEPS_PER_METRE:
        robot.sleep(0.02)
    robot.stop()


with elib.connect(URL) as robot:
    began = robot.time
    for corner in range(1, 5):
        move(robot, 0.5, 0.5, metres=0.10)
        move(robot, -0.2, 0.2, metres=AXLE * math.pi / 4)
        print(f"corner {corner} after {robot.time - began:.1f} s")
