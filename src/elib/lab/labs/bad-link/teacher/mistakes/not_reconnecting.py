# fails: survives: connect() does not open a lost link again, so every later call fails
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
    quick = robot.within(0.3)
    while robot.time < 40:
        try:
            quick.set_speed(*avoid(quick.proximity()))
        except (elib.ReplyTimeout, elib.RemoteProtocolError):
            robot.within(5).stop()
        robot.sleep(0.1)
    robot.within(5).stop()
