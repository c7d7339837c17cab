# fails: round: it goes straight on where the wall ends, so it never gets round the corner that turns right
import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    while True:
        near = robot.proximity()
        if max(near.front_right, near.front_left) > 200:
            robot.set_speed(-0.2, 0.2)
        elif near.diagonal_right + near.right < 60:
            robot.set_speed(0.4, 0.4)
        else:
            turn = max(-0.2, min(0.2, 0.0007 * (near.diagonal_right + near.right / 2 - 150)))
            robot.set_speed(0.4 - turn, 0.4 + turn)
        robot.sleep(0.1)
