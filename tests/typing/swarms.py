"""What a type checker sees of one row through a swarm. Checked by mypy; never run."""

from typing import assert_type

import elib


async def a_swarm_gives_dicts_of_values() -> None:
    async with elib.swarm("sim://crowd?robots=20") as robots:
        assert_type(robots[0], elib.Epuck)
        assert_type(robots["epuck-3"], elib.Epuck)
        assert_type([robot.name for robot in robots[:5]], list[str])
        assert_type(await robots.all.proximity(), dict[str, elib.Proximity])
        assert_type((await robots.all.proximity())["epuck-1"].front_right, int)
        assert_type(await robots.in_turn.set_speed(0.5, 0.5), dict[str, None])
        assert_type(await robots.only("epuck-1", 2).all.within(0.2).image(), dict[str, elib.Image])
        assert_type(await robots.all.sensors(), dict[str, elib.Sensors])
        await robots.all.set_led(8, elib.LedAction.TOGGLE)
        await robots.all.set_speed("fast", 0)  # type: ignore[arg-type]
        await robots.all.set_speed(0.5)  # type: ignore[call-arg]


async def collected_it_gives_outcomes() -> None:
    async with elib.swarm(["serial:///dev/rfcomm0", "sim://arena"]) as robots:
        outcomes = await robots.all.collect.within(0.5).battery()
        assert_type(outcomes, elib.Outcomes[elib.Battery])
        assert_type(outcomes.answers["rfcomm0"].volts, float | None)
        assert_type(outcomes.errors, dict[str, Exception])


def programs_keep_their_results() -> None:
    async def count(robot: elib.Epuck) -> int:
        return len(await robot.proximity())

    async def main(robots: elib.Swarm) -> list[int]:
        assert_type(await robots.all.run(count), dict[str, int])
        assert_type(await robots.in_turn.collect.run(count), elib.Outcomes[int])
        return list((await robots.all.run(count)).values())

    assert_type(elib.swarm("sim://").run(main), list[int])
