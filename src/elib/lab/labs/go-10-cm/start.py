"""Drive 10 cm straight ahead and stop."""

import elib

with elib.connect() as robot:
    robot.set_speed(0.5, 0.5)  # rev/s of the left and the right wheel
    robot.sleep(1.0)
    robot.stop()
