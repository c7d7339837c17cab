"""Let every robot drive away from what it sees, until it sees nothing."""

import math

import elib

# Where the eight sensors look, degrees from straight ahead, positive to the left.
DIRECTIONS = (-17, -46, -90, -151, 151, 90, 46, 17)
CRUISE = 0.4  # rev/s
NEAR = 15  # counts of a mean of readings; less is noise
SECONDS = 35  # time to spread


def scatter(near: list[float]) -> tuple[float, float]:
    """Return the speeds of the wheels, rev/s: away from everything near."""
    pushes = [math.sqrt(count) if count > NEAR else 0.0 for count in near]
    if not any(pushes):
        return (0.0, 0.0)
    ahead = -sum(push * math.cos(math.radians(degrees)) for push, degrees in zip(pushes, DIRECTIONS, strict=True))
    left = -sum(push * math.sin(math.radians(degrees)) for push, degrees in zip(pushes, DIRECTIONS, strict=True))
    direction = math.atan2(left, ahead)
    if abs(direction) > 1:
        return (-0.2, 0.2)  # turn on the spot, always to the left: left and right in turns would lead nowhere
    return (CRUISE * min(1, 1 - direction), CRUISE * min(1, 1 + direction))


async def spread(robot: elib.Epuck) -> None:
    mean = [0.0] * 8
    end = robot.time + SECONDS
    while robot.time < end:
        near = await robot.proximity()
        mean = [0.7 * before + 0.3 * now for before, now in zip(mean, near, strict=True)]
        await robot.set_speed(*scatter(mean))
        await robot.sleep(0.15)


async def main(robots: elib.Swarm) -> None:
    await robots.all.run(spread)
    await robots.all.stop()


elib.swarm().run(main)
