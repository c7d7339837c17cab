"""Let every robot drive away from what it sees, until it sees nothing."""

import math

import elib

# Where the eight sensors look, degrees from straight ahead, positive to the left.
DIRECTIONS = (-17, -46, -90, -151, 151, 90, 46, 17)
CRUISE = 0.4  # rev/s
NEAR = 15  # counts of a mean of readings; less is noise
ROUND, ON, SECONDS = 6.5, 0.3, 45  # s to look all round, to drive on when nothing is near any more, and in all


def scatter(near: list[float]) -> tuple[float, float]:
    """Return the speeds of the wheels, rev/s: away from everything near."""
    pushes = [math.sqrt(count) if count > NEAR else 0.0 for count in near]
    ahead = -sum(push * math.cos(math.radians(degrees)) for push, degrees in zip(pushes, DIRECTIONS, strict=True))
    left = -sum(push * math.sin(math.radians(degrees)) for push, degrees in zip(pushes, DIRECTIONS, strict=True))
    if not any(pushes):
        return (0.0, 0.0)
    direction = math.atan2(left, ahead)
    if abs(direction) > 1:
        return (-0.2, 0.2)  # turn on the spot, always to the left: left and right in turns would lead nowhere
    return (CRUISE * min(1, 1 - direction), CRUISE * min(1, 1 + direction))


async def spread(robot: elib.Epuck) -> None:
    mean: list[float] = list(await robot.proximity())
    open_air = mean  # the least that each sensor has read so far
    begin = seen = robot.time
    while robot.time < begin + SECONDS:
        mean = [0.7 * before + 0.3 * now for before, now in zip(mean, await robot.proximity(), strict=True)]
        open_air = [min(pair) for pair in zip(open_air, mean, strict=True)]
        speeds = scatter([now - free for now, free in zip(mean, open_air, strict=True)])
        if robot.time < begin + ROUND:
            speeds = (-0.2, 0.2)
        elif any(speeds):
            seen = robot.time if min(speeds) >= 0 else 0.0  # after a turn on the spot it is free already
        elif robot.time < seen + ON:
            speeds = (CRUISE, CRUISE)
        await robot.set_speed(*speeds)
        await robot.sleep(0.15)


async def main(robots: elib.Swarm) -> None:
    await robots.all.run(spread)
    await robots.all.stop()


elib.swarm().run(main)
