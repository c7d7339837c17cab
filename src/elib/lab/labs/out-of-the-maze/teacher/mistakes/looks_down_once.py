# fails: stays: it reads the ground sensors once at the beginning, so it drives over the black square and on
import elib

with elib.connect() as robot:
    robot.calibrate_proximity()
    ground = robot.ground()
    floor = ground[0]
    while ground[0] > 0.85 * floor:
        near = robot.proximity()
        if max(near.front_right, near.front_left) > 200:
            robot.set_speed(-0.2, 0.2)
        else:
            turn = max(-0.2, min(0.2, 0.0007 * (near.diagonal_right + near.right / 2 - 150)))
            robot.set_speed(0.4 - turn, 0.4 + turn)
        robot.sleep(0.1)
    robot.stop()
