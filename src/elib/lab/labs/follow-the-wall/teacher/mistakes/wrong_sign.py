# fails: round: too near to the wall it turns to the wall, and too far away it turns away
import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    while True:
        near = robot.proximity()
        if max(near.front_right, near.front_left) > 200:
            robot.set_speed(-0.2, 0.2)
        else:
            turn = max(-0.2, min(0.2, 0.0007 * (150 - near.diagonal_right - near.right / 2)))
            robot.set_speed(0.4 - turn, 0.4 + turn)
        robot.sleep(0.1)
