# fails: survives: the first lost answer raises a ReplyTimeout, which the program does not catch, so it ends
import elib

CRUISE = 0.25


def avoid(near):
    right = near.front_right + near.diagonal_right
    left = near.front_left + near.diagonal_left
    if near.front_right + near.front_left > 300:
        return (CRUISE / 2, -CRUISE / 2)
    return (max(-CRUISE, CRUISE - right / 1500), max(-CRUISE, CRUISE - left / 1500))


with elib.connect() as robot:
    robot.calibrate_proximity()
    while robot.time < 40:
        robot.set_speed(*avoid(robot.proximity()))
        robot.sleep(0.1)
    robot.stop()
