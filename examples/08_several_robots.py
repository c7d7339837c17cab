"""Drive several robots at once; give their URLs on the command line, or use three virtual robots."""

import elib

URLS = elib.robot_urls(*(f"sim://?speed=max&seed={seed}" for seed in (1, 2, 3)))


async def turn_and_look(robot: elib.Epuck) -> int:
    """Turn once on the spot and return the nearest thing seen, counts."""
    await robot.set_speed(0.2, -0.2)
    nearest = 0
    for _ in range(60):
        nearest = max(nearest, *await robot.proximity())
        await robot.sleep(0.1)
    return nearest


async def main(robots: elib.Swarm) -> None:
    seen = await robots.all.run(turn_and_look)  # if one robot fails, the others stop
    for name, nearest in seen.items():
        print(f"{name}: nearest {nearest} counts")


elib.swarm(URLS).run(main)
