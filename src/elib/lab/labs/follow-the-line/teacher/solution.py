"""Follow the black line with the ground sensors, until the lab's time is over."""

import elib

CRUISE = 0.3  # rev/s
STEERING = 0.6  # share of the speed that a wheel gains or loses when the line is under an outer sensor


def darkness(count: int, floor: int) -> float:
    """Return 0 over the bare floor and about 1 over the line; small differences are noise."""
    return max(0.0, 1 - count / floor - 0.4)


with elib.connect() as robot:
    floor = max(robot.ground()[:3])  # the line is narrower than the three sensors: one of them sees the floor
    side = 0.0  # where the line is, from -1 on the right to 1 on the left
    while True:
        left, centre, right = (darkness(count, floor) for count in robot.ground()[:3])
        if left + centre + right > 0:
            side = (left - right) / (left + centre + right)
        else:
            side = 2 if side > 0 else -2  # lost: turn towards where it was last seen
        robot.set_speed(CRUISE * (1 - STEERING * side), CRUISE * (1 + STEERING * side))
        robot.sleep(0.05)
