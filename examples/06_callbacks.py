"""Let callbacks take the answers: one for success, one for failure, and a state for both."""

from typing import Any

import elib

URL = elib.robot_url("sim://?speed=max")  # or what the command line names


def on_reply(near: elib.Proximity, state: Any) -> None:
    """Take a reading; this runs in a thread of its own and may take long."""
    print(f"{state}: front right {near.front_right}, front left {near.front_left}")


def on_error(error: elib.ElibError, state: Any) -> None:
    """Print why there is no answer."""
    print(f"{state}: {error.message}")


with elib.connect(URL) as robot:
    robot.callback(on_reply, on_error, "first").proximity()
    robot.callback(on_reply, on_error, "hasty").within(0.0001).proximity()
    robot.sleep(0.5)
    robot.callback(on_reply, on_error, "last").proximity()
    robot.sleep(0.5)
