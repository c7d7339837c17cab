"""Write a behaviour of your own: a controller, a loop that stops after a lost answer, and names for its states."""

import math

import elib
from elib.behaviours import OpenAir, RunContext, behaviour, play, react

URL = elib.robot_url("sim://arena?speed=max&loss=0.02")  # or what the command line names


def turn_away(near: elib.Proximity) -> float:
    """Return the angle to turn by, rad, positive to the left: away from what is near, 0 where the way is free."""
    left, right = near.front_left + near.diagonal_left, near.front_right + near.diagonal_right
    return 0.0 if left + right < 300 else math.radians(-100 if left > right else 100)


@behaviour
async def roam(robot: elib.Epuck, run: RunContext) -> None:
    """Go straight on, and turn away from whatever is near."""
    open_air = OpenAir()  # learns what each sensor reads in the open, and subtracts it

    async def step(view: elib.Epuck) -> None:
        angle = turn_away(open_air(await view.proximity()))
        run.state("turning" if angle else "driving")
        if angle:
            await robot.turn(angle + run.random.uniform(-0.3, 0.3))
        else:
            await view.set_speed(0.4, 0.4)

    await react(robot, step)


result = play(roam, URL, seconds=30)
print(f"ended by {result.reason} after {result.duration:.1f} s")
for time, state in result.states[:4]:
    print(f"{time:5.1f} s  {state}")
