"""Record a run, replay it without the robot, and continue from its middle; it needs the extra ``record``."""

import tempfile
from pathlib import Path

import elib
from elib.behaviours import OpenAir

URL = elib.robot_url("sim://?speed=max")  # or what the command line names


def approach(robot: elib.BlockingEpuck) -> list[int]:
    """Drive until something is near; return what was seen on the way."""
    seen: list[int] = []
    open_air = OpenAir()  # learns what each sensor reads in the open, and subtracts it
    robot.set_speed(0.5, 0.5)
    near = robot.proximity()
    while max(open_air(near)) < 300 and len(seen) < 200:
        seen.append(sum(near))
        robot.sleep(0.05)
        near = robot.proximity()
    robot.stop()
    return seen


with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "approach.mcap"
    with elib.connect(URL) as robot:
        robot.record(file)
        live = approach(robot)

    with elib.connect(f"replay://{file}?speed=max") as robot:
        print("the same again:", approach(robot) == live)

    with elib.connect(f"replay://{file}?fork=1.0&speed=max") as robot:
        print("looks at the same wall from further off:", sum(robot.proximity()) < max(live))
