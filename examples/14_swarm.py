"""Let a crowd of robots scatter: all in one world, each with its own connection."""

import elib
from elib.behaviours import OpenAir

URLS = elib.robot_urls("sim://crowd?robots=8&speed=max")  # or what the command line names


async def wander(robot: elib.Epuck) -> float:
    """Turn away from whatever is near for 10 s, and return the distance driven, m."""
    end = robot.time + 10
    open_air = OpenAir()  # learns what each sensor reads in the open, and subtracts it
    while robot.time < end:
        near = open_air(await robot.proximity())
        left, right = near.front_left + near.diagonal_left, near.front_right + near.diagonal_right
        await robot.set_speed(*((0.5, 0.5) if left + right < 200 else (0.4, -0.4) if left > right else (-0.4, 0.4)))
        await robot.sleep(0.1)
    steps = await robot.encoders()
    return (steps.left + steps.right) / 2 * 0.1288e-3


async def main(robots: elib.Swarm) -> None:
    print(f"{len(robots)} robots, {robots.names[0]} to {robots.names[-1]}")
    await robots.in_turn.set_body_led(elib.LedAction.ON)  # one after another
    driven = await robots.all.run(wander)  # at the same time; if one fails, all stop
    print(f"they drove {min(driven.values()):.2f} to {max(driven.values()):.2f} m")
    outcomes = await robots.all.collect.within(0.5).battery()  # whatever happens to any of them
    print(f"{len(outcomes.answers)} told their battery, {len(outcomes.errors)} did not")


elib.swarm(URLS).run(main)
