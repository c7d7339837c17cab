# fails: apart: each robot wanders for ever, also when no other is near, so they meet again
import elib
from elib.behaviours import OpenAir


async def scatter(robot: elib.Epuck) -> None:
    open_air = OpenAir()
    while True:
        near = open_air(await robot.proximity())
        left = near.front_left + near.diagonal_left
        right = near.front_right + near.diagonal_right
        if left + right < 100:
            await robot.set_speed(0.4, 0.4)
        elif left > right:
            await robot.set_speed(0.3, -0.3)
        else:
            await robot.set_speed(-0.3, 0.3)
        await robot.sleep(0.1)


async def main(robots: elib.Swarm) -> None:
    await robots.all.run(scatter)


elib.swarm().run(main)
