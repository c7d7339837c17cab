"""Drive, and turn away from what is near, for a minute: two states, each a function that names the next one."""

import elib


def drive(robot, run):
    """Drive straight on."""
    if run.entered:
        robot.set_speed(0.4, 0.4)
    distances = robot.distances()
    if distances.ahead < 0.04:
        return "turn"
    return None  # stay


def turn(robot, run):
    """Turn on the spot."""
    robot.turn(1.0)
    return "drive"


if __name__ == "__main__":
    result = elib.play(elib.states(drive, turn), seconds=60)
    print(f"It ended after {result.duration:.0f} s, and changed its state {len(result.states) - 1} times.")
