"""Drive straight on to the first wall, draw a map on the way, and print it."""

import elib

grid = elib.Grid()
with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    near = robot.distances()
    while near.ahead > 0.03:
        robot.set_speed(0.3, 0.3)
        grid.add(robot.pose(), near)
        robot.sleep(0.1)
        near = robot.distances()
    robot.stop()
print(grid.to_text())
