"""Drives to compare and to fit: of virtual robots whose true values only the test knows."""

import math
import random
from dataclasses import dataclass
from pathlib import Path

from elib.base.body import AXLE
from elib.behaviours import run_behaviour
from elib.behaviours.calibration_drive import calibration_drive
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.physics import World
from elib.simulator.physics.noise import AXLE_LENGTH, WHEEL, gauss, robot_key

WORLD = """
[arena]
size = [1.0, 1.0]

[epuck]
profile = "{profile}"
wheel_spread = {spread}
axle_spread = {spread}
gain_spread = {gains}

[[robot]]
position = [0.5, 0.5]
heading = 0
"""
SPREAD = 0.01


@dataclass(frozen=True)
class Hidden:
    """A recorded drive, and the true values of its robot."""

    file: Path
    left: float
    right: float
    axle: float
    latency: float
    world: World


def hidden_robot(
    folder: Path, seed: int, *, profile: str = "enki", gains: float = 0.05, keys: str = "", duration: float = 120.0
) -> Hidden:
    """Record a drive of a robot whose wheels, axle and link are drawn from a seed."""
    world = folder / f"hidden-{profile}.toml"
    world.write_text(WORLD.format(profile=profile, spread=SPREAD, gains=gains), encoding="utf-8")
    file = folder / f"{profile}-{seed}.mcap"
    latency = random.Random(seed).uniform(0.005, 0.060)
    drive(f"sim://{world}?speed=max&seed={seed}&latency={latency:.5f}{keys}", file, duration=duration)
    key = robot_key(seed, 0)
    return Hidden(
        file,
        1 + SPREAD * gauss(key, WHEEL),
        1 + SPREAD * gauss(key, WHEEL + 1),
        AXLE * (1 + SPREAD * gauss(key, AXLE_LENGTH)),
        latency,
        World.load(str(world), seed=seed),
    )


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
