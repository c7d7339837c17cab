"""Explore a room: straight on, and a turn of any size at an obstacle."""

import elib


@elib.behaviour(world="maze")
async def explore(robot: elib.Epuck, run: elib.RunContext) -> None:
    """Explore a room until the time is over."""
    await robot.calibrate_proximity()  # put it in the open: what the sensors read there is 0 from now on
    while True:
        near = await robot.proximity()
        if max(near.front_left, near.front_right) > 300:
            run.state("turning")
            await robot.set_speed(-0.4, 0.4)
            await robot.sleep(run.random.uniform(0.3, 1.5))  # seconds; the same seed gives the same turns
        else:
            run.state("driving")
            await robot.set_speed(0.5, 0.5)
            await robot.sleep(0.05)


if __name__ == "__main__":
    result = elib.play(explore, seconds=30)
    print(f"It ended after {result.duration:.0f} s, and was in {len(result.states)} states.")
