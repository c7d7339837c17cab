# fails: found: it has the number of the robot from one run, and in another world it is another robot
import elib


async def main(robots: elib.Swarm) -> None:
    await robots[0].set_led(0, True)
    await robots.all.sleep(1)


elib.swarm().run(main)
