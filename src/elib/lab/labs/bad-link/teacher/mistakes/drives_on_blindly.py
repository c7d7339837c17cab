# fails: no-contact: without an answer it drives on, and does not see where
import elib

CRUISE = 0.5


def avoid(near):
    right = near.front_right + near.diagonal_right
    left = near.front_left + near.diagonal_left
    if near.front_right + near.front_left > 300:
        return (CRUISE / 2, -CRUISE / 2)
    return (max(-CRUISE, CRUISE - right / 1500), max(-CRUISE, CRUISE - left / 1500))


with elib.reconnecting() as robot:
    robot.calibrate_proximity()
    while robot.time < 40:
        try:
            robot.set_speed(*avoid(robot.proximity()))
        except elib.ElibError:
            pass
        robot.sleep(0.1)
    robot.within(5).stop()
