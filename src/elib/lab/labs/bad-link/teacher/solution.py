"""Wander for half a minute over a bad link: a robot that does not see must not drive."""

import elib

CRUISE = 0.25  # rev/s


def avoid(near: elib.Proximity) -> tuple[float, float]:
    """Return the speeds of the wheels, rev/s."""
    right = near.front_right + near.diagonal_right
    left = near.front_left + near.diagonal_left
    if near.front_right + near.front_left > 300:  # something is in the way: turn on the spot
        return (CRUISE / 2, -CRUISE / 2)
    return (max(-CRUISE, CRUISE - right / 1500), max(-CRUISE, CRUISE - left / 1500))


with elib.reconnecting() as robot:
    quick = robot.within(0.3)  # an answer usually takes 0.1 s
    is_calibrated = False
    while robot.time < 40:
        try:
            if not is_calibrated:
                robot.calibrate_proximity()  # takes 3 s, so not quick; if its answer is lost, do it again
                is_calibrated = True
            quick.set_speed(*avoid(quick.proximity()))
        except (elib.ReplyTimeout, elib.RemoteProtocolError, elib.LinkLost):
            robot.within(10).stop()  # the link may need a while to come back
        robot.sleep(0.1)
    robot.within(10).stop()
