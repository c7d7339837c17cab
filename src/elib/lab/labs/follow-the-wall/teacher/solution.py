"""Follow the wall on the right, round the corners of the room, until the lab's time is over."""

import elib

CRUISE = 0.4  # rev/s
GAIN = 0.0007  # how much faster one wheel is for each count too many
WANTED = 150  # counts of the two sensors to the right, about 3 cm from the wall
NEAR = 200  # counts in front: here is a corner


def follow(near: elib.Proximity) -> tuple[float, float]:
    """Return the speeds of the wheels, rev/s."""
    if max(near.front_right, near.front_left) > NEAR:
        return (-0.2, 0.2)  # turn left on the spot
    too_near = near.diagonal_right + near.right / 2 - WANTED
    turn = max(-0.2, min(0.2, GAIN * too_near))
    return (CRUISE - turn, CRUISE + turn)


with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    while True:
        robot.set_speed(*follow(robot.proximity()))
        robot.sleep(0.1)
