# fails: home: it drives to the tag that is nearest to home, and does not know on which side of it home is
import math

import elib

with elib.connect() as robot:
    robot.set_camera(40, 40, 8, "grey")
    while not (seen := [tag for tag in robot.tags(0.075) if tag.number == 3]):
        robot.turn(math.radians(12))
    robot.turn(seen[0].bearing)
    robot.drive(seen[0].distance - 0.10)
