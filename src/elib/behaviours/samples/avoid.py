"""Drive around and avoid what is near, for twenty seconds."""

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()  # put it in the open: what the sensors read there is 0 from now on
    end = robot.time + 20
    while robot.time < end:
        near = robot.proximity()  # eight sensors: a higher number is nearer
        left = max(near.front_left, near.diagonal_left)
        right = max(near.front_right, near.diagonal_right)
        if left > 300:
            robot.set_speed(0.4, -0.4)  # left wheel, right wheel: turn to the right
        elif right > 300:
            robot.set_speed(-0.4, 0.4)  # turn to the left
        else:
            robot.set_speed(0.5, 0.5)  # turns of the wheel in a second: straight on
        robot.sleep(0.05)
    print("It drove for 20 seconds, and stops now.")
