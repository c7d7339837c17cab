"""What a simulation can be told: the keys of ``sim://``, the same as the flags of ``elib simulate``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Self

from elib.errors import ArgumentError
from elib.timebase import Speed, check_factor

RANGES: Mapping[str, tuple[float, float]] = {
    "seed": (0, 2**64 - 1),  # the noise of the physics counts in 64 bits
    "robots": (1, 10_000),
    "robot": (1, 10_000),
    "latency": (0, 60),
    "jitter": (0, 60),
    "baud": (0, 10_000_000),
    "loss": (0, 1),
}
"""Lowest and highest value of each number."""


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """A simulation to be built.

    Attributes:
        world: Name of a world of the gallery, or the path of a TOML file.
        firmware: Which firmware the robots run: ``btcom-1.1.3``, ``btcom-2.0``, ``asercom-1.2.2``, ``epuck2``.
        seed: Seed of every random number, 0 to 2**64 - 1: the same seed, the same run. None: the world's own.
        robots: How many robots the world holds, 1 to 10000; None: as many as the world names.
        robot: Which of them is meant, counted from 1, in a world that all who open it on one event loop share;
            None: the first one of a world of its own.
        hardware: File with constant readings that replaces world and physics, or None.
        speed: ``"real"``, ``"max"`` or a factor, 0.001 to 1000.
        latency: Delay of the link each way, 0 to 60 s.
        jitter: Standard deviation of that delay, 0 to 60 s.
        baud: Speed of the serial line, bit/s; 0 does not pace it.
        loss: Probability that a whole answer is lost, 0 to 1.
        fault: Script of timed faults: the name of one that comes with elib, or the path of a TOML file; or None.
        profile: File of a robot profile, as ``elib fit`` writes it: wheels, link and infrared curve of one true robot,
            which all robots here then have; or None.

    Raises:
        ArgumentError: A value is out of its range, or no number.
    """

    world: str = "arena"
    firmware: str = "asercom-1.2.2"
    seed: int | None = None
    robots: int | None = None
    robot: int | None = None
    hardware: str | None = None
    speed: Speed = "real"
    latency: float = 0.0
    jitter: float = 0.0
    baud: int = 115200
    loss: float = 0.0
    fault: str | None = None
    profile: str | None = None

    def __post_init__(self) -> None:
        for name, (low, high) in RANGES.items():
            value: float | None = getattr(self, name)
            if value is not None and not low <= value <= high:  # also when it is not a number
                raise ArgumentError(f"{name} is {value}; it must be from {low:g} to {high:g}")
        if self.profile is not None and self.hardware is not None:
            raise ArgumentError("profile and hardware exclude each other", hint="constant readings need no profile")
        if self.robot is not None and self.robots is not None and self.robot > self.robots:
            raise ArgumentError(f"robot is {self.robot}, but there are robots={self.robots}, counted from 1")
        parse_speed(self.speed)

    @classmethod
    def from_text(cls, world: str, keys: Mapping[str, str]) -> Self:
        """Read the settings from text, as a URL or a command line gives it.

        Raises:
            ArgumentError: A value is out of its range, or no number.
        """
        default = cls()
        text = {key: value for key, value in keys.items() if key in ("firmware", "hardware", "fault", "profile")}
        return cls(
            world=world,
            firmware=text.get("firmware", default.firmware),
            hardware=text.get("hardware"),
            fault=text.get("fault"),
            profile=text.get("profile"),
            seed=_whole("seed", keys) if "seed" in keys else None,
            robots=_whole("robots", keys) if "robots" in keys else None,
            robot=_whole("robot", keys) if "robot" in keys else None,
            baud=_whole("baud", keys) if "baud" in keys else default.baud,
            latency=_real("latency", keys, default.latency),
            jitter=_real("jitter", keys, default.jitter),
            loss=_real("loss", keys, default.loss),
            speed=parse_speed(keys.get("speed", default.speed)),
        )


KEYS = tuple(field.name for field in fields(SimulationSettings) if field.name != "world")
"""The keys of a ``sim://`` URL."""


def parse_speed(speed: str | float) -> Speed:
    """Return *speed* as ``"real"``, ``"max"`` or a factor.

    Raises:
        ArgumentError: It is none of these, or out of 0.001 to 1000.
    """
    if speed == "real":
        return "real"
    if speed == "max":
        return "max"
    return check_factor(speed)


def _whole(name: str, keys: Mapping[str, str]) -> int:
    text = keys[name]
    try:
        return int(text)
    except ValueError:
        raise ArgumentError(f"{name} is {text!r}; it must be a whole number") from None


def _real(name: str, keys: Mapping[str, str], default: float) -> float:
    text = keys.get(name, str(default))
    try:
        return float(text)
    except ValueError:
        raise ArgumentError(f"{name} is {text!r}; it must be a number") from None
