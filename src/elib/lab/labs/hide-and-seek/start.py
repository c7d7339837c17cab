"""Say who seeks and who hides; who seeks drives ahead for a moment."""

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    if max(robot.ground()[:3]) < 700:
        print("It seeks.")
        robot.drive(0.1)
    else:
        print("It hides.")
