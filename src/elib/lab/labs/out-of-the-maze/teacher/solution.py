"""Leave a maze: keep a hand on the wall to the right, and stop on the black square."""

import elib

CRUISE = 0.4  # rev/s
GAIN = 0.0007  # how much faster one wheel is for each count too many
WANTED = 150  # counts of the two sensors to the right, about 3 cm from the wall
NEAR = 200  # counts in front: a corner, or a dead end
BLACK = 0.85  # of what a ground sensor gives over the pale floor: over black, even the worst one gives less


def follow(near: elib.Proximity) -> tuple[float, float]:
    """Return the speeds of the wheels, rev/s."""
    if max(near.front_right, near.front_left) > NEAR:
        return (-0.2, 0.2)  # turn left on the spot
    too_near = near.diagonal_right + near.right / 2 - WANTED
    turn = max(-0.2, min(0.2, GAIN * too_near))
    return (CRUISE - turn, CRUISE + turn)


with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    floor = max(robot.ground()[:3])
    while max(robot.ground()[:3]) > BLACK * floor:
        robot.set_speed(*follow(robot.proximity()))
        robot.sleep(0.1)
    robot.drive(0.04)  # the sensors are 3 cm ahead of the middle
