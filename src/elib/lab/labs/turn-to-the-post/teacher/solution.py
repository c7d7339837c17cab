"""Turn until the post is straight ahead: all eight sensors together tell where it is."""

import math

import elib

# Where the eight sensors look, degrees from straight ahead, positive to the left.
DIRECTIONS = (-17, -46, -90, -151, 151, 90, 46, 17)
LOOKS = 10  # one reading is noisy; the sum of ten is less so


def direction(robot: elib.BlockingEpuck) -> float:
    """Return where the post is, rad: the sum of eight arrows, each as long as what its sensor reads."""
    ahead = left = 0.0
    for _ in range(LOOKS):
        for count, degrees in zip(robot.proximity(), DIRECTIONS, strict=True):
            ahead += count * math.cos(math.radians(degrees))
            left += count * math.sin(math.radians(degrees))
        robot.sleep(0.1)
    return math.atan2(left, ahead)


with elib.connect() as robot:
    for _ in range(3):  # the first look is rough, because the sensors behind are far apart
        robot.turn(direction(robot))
