"""Drive 10 cm straight ahead and stop."""

import elib

with elib.connect() as robot:
    robot.drive(0.10)
