# fails: apart: in_turn waits until a robot is done before the next one begins, and the time is over before the last
import elib
from elib.behaviours import OpenAir


async def scatter(robot: elib.Epuck) -> None:
    begin, open_air = robot.time, OpenAir()
    while robot.time < begin + 30:
        near = open_air(await robot.proximity())
        if robot.time < begin + 6 or max(near.front_left, near.front_right) > 30:
            await robot.set_speed(0.3, -0.3)
        elif max(near) > 30:
            await robot.set_speed(0.4, 0.4)
        else:
            await robot.set_speed(0, 0)
        await robot.sleep(0.1)


async def main(robots: elib.Swarm) -> None:
    await robots.in_turn.run(scatter)


elib.swarm().run(main)
