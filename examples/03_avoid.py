"""Wander for ten seconds without hitting anything: a controller, and a loop around it."""

import elib


def avoid(near: elib.Proximity, cruise: float = 0.4) -> elib.Wheels:
    """Return the speeds, rev/s: what is near slows the wheel of the other side, so the robot turns away."""
    right = (near.front_right + near.diagonal_right) / 800
    left = (near.front_left + near.diagonal_left) / 800
    return elib.Wheels(max(-cruise, cruise - right), max(-cruise, cruise - left))


async def main(robot: elib.Epuck) -> None:
    await robot.calibrate_proximity()  # in the open: what the sensors read there is 0 from now on
    began = robot.time
    nearest = 0
    while robot.time < began + 10:
        near = await robot.proximity()
        await robot.set_speed(*avoid(near))
        await robot.sleep(0.05)
        nearest = max(nearest, *near)
    print(f"wandered for {robot.time - began:.1f} s; the nearest thing gave {nearest} counts")


elib.run(main, default="sim://?speed=max")
