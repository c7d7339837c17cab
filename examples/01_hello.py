"""Read some sensors of an e-puck."""

import elib

URL = elib.robot_url("sim://?speed=max")  # or what the command line names

with elib.connect(URL) as robot:
    near = robot.proximity()
    print(f"{robot.firmware} at {robot.url}")
    print(f"front right {near.front_right}, front left {near.front_left}: higher is nearer")
    print("accelerometer in g: {:.2f} {:.2f} {:.2f}".format(*robot.accelerometer().g))
    print(f"selector at {robot.selector().position}")
