"""Turn until the post is straight ahead: all eight sensors together tell where it is."""

import math

import elib

# Where the eight sensors look, degrees from straight ahead, positive to the left.
DIRECTIONS = (-17, -46, -90, -151, 151, 90, 46, 17)
LOOKS = 10  # one reading is noisy; the mean of ten is less so


def look(robot: elib.BlockingEpuck) -> list[float]:
    """Return the mean of what each sensor reads."""
    sums = [0] * 8
    for _ in range(LOOKS):
        sums = [total + count for total, count in zip(sums, robot.proximity(), strict=True)]
        robot.sleep(0.1)
    return [total / LOOKS for total in sums]


def direction(near: list[float]) -> float:
    """Return where the post is, rad: the sum of eight arrows, each as long as what its sensor sees."""
    ahead = sum(count * math.cos(math.radians(degrees)) for count, degrees in zip(near, DIRECTIONS, strict=True))
    left = sum(count * math.sin(math.radians(degrees)) for count, degrees in zip(near, DIRECTIONS, strict=True))
    return math.atan2(left, ahead)


with elib.connect() as robot:
    first = look(robot)
    robot.turn(math.pi)  # what saw the post now looks into the open
    near = look(robot)
    open_air = [min(pair) for pair in zip(first, near, strict=True)]
    for _ in range(3):  # the first turn is rough, because the sensors behind are far apart
        robot.turn(direction([now - free for now, free in zip(near, open_air, strict=True)]))
        near = look(robot)
