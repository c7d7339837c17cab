# fails: home: it takes the bearing of each tag as if the robot had not turned between two pictures
import cmath
import math

import elib

TAGS = {0: 0.25 + 0.695j, 1: 0.65 + 0.695j, 2: 0.895 + 0.35j, 3: 0.65 + 0.005j, 4: 0.25 + 0.005j, 5: 0.005 + 0.35j}

with elib.connect() as robot:
    robot.set_camera(40, 40, 8, "grey")
    pairs = []
    for _ in range(30):
        seen = [tag for tag in robot.tags(0.075) if tag.number in TAGS]
        pairs += [(TAGS[tag.number], 0.03 + cmath.rect(tag.distance, tag.bearing)) for tag in seen]
        robot.turn(math.radians(12))
    there = sum(tag for tag, _ in pairs) / len(pairs)
    here = sum(place for _, place in pairs) / len(pairs)
    turn = cmath.phase(sum((tag - there) * (place - here).conjugate() for tag, place in pairs))
    place = there - here * cmath.rect(1, turn)
    robot.set_pose(place.real, place.imag, turn + robot.pose().heading)
    robot.go_to(0.65, 0.25)
