# fails: found: it compares the step counters, which do not notice that a wheel slips
import elib


async def examine(robot: elib.Epuck) -> None:
    before = await robot.encoders()
    await robot.turn(3)
    after = await robot.encoders()
    await robot.set_led(0, abs(after.left - before.left + after.right - before.right) > 40)


async def main(robots: elib.Swarm) -> None:
    await robots.all.run(examine)
    await robots.all.sleep(1)


elib.swarm().run(main)
