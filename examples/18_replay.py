"""Record a run, replay it without the robot, and continue from its middle; it needs the extra ``record``."""

import tempfile
from pathlib import Path

import elib

URL = elib.robot_url("sim://?speed=max")  # or what the command line names


def approach(robot: elib.BlockingEpuck) -> list[int]:
    """Drive until something is near; return what was seen on the way."""
    seen: list[int] = []
    robot.calibrate_proximity()  # in the open: what the sensors read there is 0 from now on
    robot.set_speed(0.5, 0.5)
    while max(robot.proximity()) < 300 and len(seen) < 200:
        seen.append(max(robot.proximity()))
        robot.sleep(0.05)
    robot.stop()
    return seen


with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "approach.mcap"
    with elib.connect(URL) as robot:
        robot.record(file)
        live = approach(robot)

    with elib.connect(f"replay://{file}?speed=max") as robot:
        print("the same again:", approach(robot) == live)

    with elib.connect(f"replay://{file}?fork=4.0&speed=max") as robot:
        print("looks at the same wall from further off:", max(robot.proximity()) < max(live))
