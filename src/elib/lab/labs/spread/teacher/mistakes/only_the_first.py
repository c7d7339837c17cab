# fails: apart: it drives robots[0] only, and the other robots stay where they are
import elib
from elib.behaviours import OpenAir


async def main(robots: elib.Swarm) -> None:
    robot = robots[0]
    begin, open_air = robot.time, OpenAir()
    while robot.time < begin + 30:
        near = open_air(await robot.proximity())
        if robot.time < begin + 6 or max(near.front_left, near.front_right) > 30:
            await robot.set_speed(0.3, -0.3)
        elif max(near) > 30:
            await robot.set_speed(0.4, 0.4)
        else:
            await robot.stop()
        await robot.sleep(0.1)


elib.swarm().run(main)
