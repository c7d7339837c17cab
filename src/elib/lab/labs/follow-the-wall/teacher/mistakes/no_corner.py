# fails: no-contact: it looks to the right only, and scrapes along the wall in front
import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    while True:
        near = robot.proximity()
        turn = max(-0.2, min(0.2, 0.0007 * (near.diagonal_right + near.right / 2 - 150)))
        robot.set_speed(0.4 - turn, 0.4 + turn)
        robot.sleep(0.1)
