"""The drive that ``elib fit`` is made for."""

from itertools import pairwise
from pathlib import Path

import pytest

from elib.behaviours import RunResult, run_behaviour
from elib.behaviours.calibration_drive import CLOSE, LEG, REST, calibration_drive
from elib.link.session import Ended, TraceEvent
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.physics.body import RADIUS

Driven = tuple[RunResult, list[tuple[int, ...]], int, float, tuple[float, float, float]]


def driven(url: str, duration: float = 120.0) -> Driven:
    """The result, the speeds asked for, the greatest front reading, the greatest x, and the pose at the end."""

    async def main(robot: Epuck) -> Driven:
        speeds: list[tuple[int, ...]] = []
        nearest, furthest = 0, 0.0

        def see(time: float, event: TraceEvent) -> None:
            nonlocal nearest, furthest
            furthest = max(furthest, robot.session.transport.observe()[0].x)  # type: ignore[attr-defined]
            if isinstance(event, Ended) and event.request.name == "set_speed":
                speeds.append(event.request.numbers)
            elif isinstance(event, Ended) and event.request.name == "proximity" and event.value is not None:
                nearest = max(nearest, event.value[0], event.value[7])  # type: ignore[index]

        robot.trace(see)
        outcome = await run_behaviour(calibration_drive, robot, options={"duration": duration})
        pose = robot.session.transport.observe()[0]  # type: ignore[attr-defined]
        return outcome, speeds, nearest, furthest, (pose.x, pose.y, pose.heading)

    return run_on(url, main)


def test_it_drives_everything_and_comes_back_in_two_minutes() -> None:
    outcome, speeds, nearest, _, (x, y, heading) = driven("sim://square?speed=max&seed=1")
    assert outcome.reason == "done"
    assert 100 < outcome.duration <= 121
    assert {state for _, state in outcome.states} == {"turns", "wall", "leg", "arcs"}
    legs = [end - begin for (begin, state), (end, _) in pairwise(outcome.states) if state == "leg"]
    assert min(legs) >= 2 * (LEG + REST)
    assert any(left == right > 0 for left, right in speeds)
    assert any(left == -right > 0 for left, right in speeds)
    assert any(left == -right < 0 for left, right in speeds)
    assert any(left > right > 0 for left, right in speeds)
    assert any(right > left > 0 for left, right in speeds)
    assert nearest > CLOSE
    assert (x, y, heading) == (pytest.approx(0.5, abs=0.03), pytest.approx(0.5, abs=0.03), pytest.approx(0, abs=0.2))


@pytest.mark.parametrize("quality", ["typical", "bad"])
def test_over_a_slow_link_it_touches_no_wall_either(quality: str) -> None:
    furthest = driven(f"sim://square?speed=max&latency=0.06&quality={quality}", 60.0)[3]
    # The gap itself, m: counts say little of it, since gains differ.
    assert 1 - RADIUS - furthest == pytest.approx(0.006, abs=0.003)


def test_without_a_wall_it_turns_back(tmp_path: Path) -> None:
    world = tmp_path / "large.toml"
    world.write_text("[arena]\nsize = [3, 3]\n[[robot]]\nposition = [1.5, 1.5]\n", encoding="utf-8")
    outcome, _, nearest, _, (x, y, _) = driven(f"sim://{world}?speed=max", 60.0)
    assert outcome.reason == "done"
    assert nearest < CLOSE
    assert (x, y) == (pytest.approx(1.5, abs=0.03), pytest.approx(1.5, abs=0.03))


def test_a_lost_answer_does_not_end_it() -> None:
    assert driven("sim://square?speed=max&loss=0.05&seed=2", 60.0)[0].reason == "done"
