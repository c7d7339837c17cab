"""Follow the black line with the ground sensors, until the lab's time is over."""

import elib

CRUISE = 0.3  # rev/s
STEERING = 0.6  # share of the speed that a wheel gains or loses when the line is under an outer sensor
DARK = 0.85  # of what the floor gives: over black, even the worst sensor gives less

with elib.connect() as robot:
    floor = max(robot.ground()[:3])  # the line is narrower than the three sensors: one of them sees the floor
    black = [DARK * floor] * 3  # what each sensor gives over the line: it learns that on the way
    side = 0.0  # where the line is, from -1 on the right to 1 on the left
    while True:
        counts = robot.ground()[:3]
        black = [min(pair) for pair in zip(black, counts, strict=True)]
        shares = [(floor - count) / (floor - low) for count, low in zip(counts, black, strict=True)]
        left, centre, right = (share if share > 0.5 else 0.0 for share in shares)
        if left + centre + right > 0:
            side = (left - right) / (left + centre + right)
        else:
            side = 2 if side > 0 else -2  # lost: turn towards where it was last seen
        robot.set_speed(CRUISE * (1 - STEERING * side), CRUISE * (1 + STEERING * side))
        robot.sleep(0.05)
