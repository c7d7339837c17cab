# fails: map: it believes its odometry: a wheel that is a little larger bends the map
import elib
from elib.behaviours.wall_following import follow

grid = elib.Grid()
with elib.connect() as robot:
    robot.calibrate_proximity()
    wheels = elib.Wheels(0, 0)
    while robot.time < 105:
        wheels = follow(robot.proximity(), wheels, cruise=0.35)
        robot.set_speed(*wheels)
        grid.add(robot.pose(), robot.distances())
        robot.sleep(0.05)
print(grid.to_text())
