"""Look round for tags, calculate where the robot is, drive home, and do it again there."""

import cmath
import math

import elib

SIZE = 0.075  # m, of the black square
CAMERA = 0.03  # m from the middle of the robot
HOME = (0.65, 0.25)
TAGS = {0: 0.25 + 0.695j, 1: 0.65 + 0.695j, 2: 0.895 + 0.35j, 3: 0.65 + 0.005j, 4: 0.25 + 0.005j, 5: 0.005 + 0.35j}


def look_round(robot: elib.BlockingEpuck) -> list[tuple[complex, complex]]:
    """Turn round once; return of each tag where it is in the room, and where it was seen from the robot."""
    seen = {}
    robot.set_pose(0, 0, 0)
    for _ in range(30):
        for tag in robot.tags(SIZE):
            if tag.number in TAGS:
                place = CAMERA + cmath.rect(tag.distance, tag.bearing)
                seen[tag.number] = place * cmath.rect(1, robot.pose().heading)
        robot.turn(math.radians(12))
    return [(TAGS[number], place) for number, place in seen.items()]


def locate(pairs: list[tuple[complex, complex]]) -> tuple[complex, float]:
    """Return where the robot was when it began to look round, and its heading, rad."""
    there = sum(tag for tag, _ in pairs) / len(pairs)
    here = sum(place for _, place in pairs) / len(pairs)
    turn = cmath.phase(sum((tag - there) * (place - here).conjugate() for tag, place in pairs))
    return there - here * cmath.rect(1, turn), turn


with elib.connect() as robot:
    robot.set_camera(40, 40, 8, "grey")
    for _ in range(2):  # from near, tags say more exactly where the robot is
        place, turn = locate(look_round(robot))
        robot.set_pose(place.real, place.imag, turn + robot.pose().heading)
        robot.go_to(*HOME)
