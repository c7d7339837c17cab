"""Test a program over a bad link: it must survive lost, late and halved answers, and enough of them."""

import elib
from elib.behaviours import OpenAir
from elib.testing import faults_of, with_faults


async def wander(robot: elib.Epuck, seconds: float) -> int:
    """Turn away from what is near; stop whenever a reading fails, and return how often that was."""
    failures, end = 0, robot.time + seconds
    open_air = OpenAir()  # learns what each sensor reads in the open, and subtracts it
    while robot.time < end:
        try:
            near = open_air(await robot.within(0.3).proximity())
            await robot.within(0.3).set_speed(0.3, 0.3 if max(near) < 300 else -0.3)
        except (elib.ReplyTimeout, elib.RemoteProtocolError):
            failures += 1
            await robot.within(2).stop()  # never drive blind
        await robot.sleep(0.1)
    return failures


async def test_it_survives_a_flaky_link(robot: elib.Epuck) -> None:
    failures = await wander(robot, 60)
    counts = faults_of(robot).counts
    print(f"{counts.lost} answers lost, {counts.delayed} late, {counts.halved} halved; {failures} failures met")
    assert counts.lost > 5, "the link was too good: this proves nothing"
    assert 0 < failures < 60, "it failed too often"
    assert robot.statistics.resyncs >= failures, "there were too few resyncs"


elib.run(test_it_survives_a_flaky_link, default=with_faults("flaky-bluetooth"))
print("passed")
