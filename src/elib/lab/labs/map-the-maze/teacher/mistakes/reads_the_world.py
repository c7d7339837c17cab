# fails: map: it opens the file of the given maze, which is not there when it is marked, and is of another maze
from pathlib import Path

import elib

with elib.connect() as robot:
    robot.drive(0.05)
world = Path("worlds/maze.toml")
if world.exists():
    grid = elib.Grid.of_world(world)
    grid.x, grid.y = grid.x - 0.1, grid.y - 0.1  # where the robot starts
else:
    grid = elib.Grid()
print(grid.to_text())
