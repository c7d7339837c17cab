# fails: found: it takes the robot that sees most for the broken one, but no two good robots read the same
import elib


async def main(robots: elib.Swarm) -> None:
    sums = {robot.name: sum(await robot.proximity()) for robot in robots}
    for robot in robots:
        await robot.set_led(0, sums[robot.name] == max(sums.values()))
    await robots.all.sleep(1)


elib.swarm().run(main)
