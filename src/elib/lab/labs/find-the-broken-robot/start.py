"""Print how bright each robot sees the lamp, and what its infrared sensors read."""

import elib


async def main(robots: elib.Swarm) -> None:
    for robot in robots:
        print(robot.name, await robot.ambient_light(), await robot.proximity())


elib.swarm().run(main)
