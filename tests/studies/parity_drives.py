"""Drives to compare and to fit: of virtual robots whose true values only the test knows."""

import math
import random
import statistics
from dataclasses import dataclass
from pathlib import Path

from elib.behaviours import run_behaviour
from elib.behaviours.calibration_drive import calibration_drive
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.physics import World
from elib.simulator.physics.profiles import SPACING
from elib.simulator.physics.profiles import profile as response

WORLD = """
[arena]
size = [1.0, 1.0]

[epuck]
profile = "{profile}"
wheel_spread = {spread}
axle_spread = {spread}

[[robot]]
position = [0.5, 0.5]
heading = 0
"""
SPREAD = 0.01
"""Of wheels and axle: twice what typical robots have, so that a profile of nominal ones would be far off."""


@dataclass(frozen=True)
class Hidden:
    """A recorded drive, and the true values of its robot."""

    file: Path
    latency: float
    left: float
    right: float
    axle: float
    counts: tuple[float, ...]
    gains: tuple[float, ...]
    offsets: tuple[float, ...]

    def light(self, distance: float) -> float:
        """Return the counts that a sensor of mean gain reads of a wall, without what it reads in the open."""
        return self._mean * (self.counts[round(distance / SPACING)] - self.counts[-1])

    @property
    def open_air(self) -> list[float]:
        """Counts that each sensor reads in the open."""
        return [gain * self.counts[-1] + offset for gain, offset in zip(self.gains, self.offsets, strict=True)]

    @property
    def shares(self) -> list[float]:
        """The gains divided by their mean, because a common factor belongs to the curve."""
        return [gain / self._mean for gain in self.gains]

    @property
    def _mean(self) -> float:
        return statistics.geometric_mean(self.gains)


def hidden_robot(
    folder: Path, seed: int, *, profile: str = "measured", keys: str = "", duration: float = 120.0
) -> Hidden:
    """Record a drive of a typical robot that is drawn from a seed, like the latency of its link."""
    place = folder / f"hidden-{profile}.toml"
    place.write_text(WORLD.format(profile=profile, spread=SPREAD), encoding="utf-8")
    file = folder / f"{profile}-{seed}.mcap"
    latency = round(random.Random(seed).uniform(0.005, 0.060), 5)
    drive(f"sim://{place}?speed=max&seed={seed}&latency={latency}{keys}", file, duration=duration)
    robot = World.load(str(place), seed=seed)._state.world.robots[0]
    scales = robot.left_scale, robot.right_scale, robot.axle
    return Hidden(file, latency, *scales, response(profile).counts, tuple(robot.gain), tuple(robot.offset))


def drive(url: str, file: Path, *, duration: float = 120.0) -> Path:
    """Record a calibration drive."""

    async def main(robot: Epuck) -> None:
        with robot.record(file):
            await run_behaviour(calibration_drive, robot, options={"duration": duration})

    run_on(url, main)
    return file


def off(found: float, true: float) -> float:
    """Return the relative error."""
    return math.nan if true == 0 else abs(found / true - 1)
