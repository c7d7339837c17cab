"""The settings of a simulation: the keys of a ``sim://`` URL, which are also options of ``elib simulate``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Self

from elib.base.errors import ArgumentError
from elib.base.rules import Delay, Probability, Seed, Whole, check, fields_of
from elib.base.timebase import Speed, parse_speed
from elib.link.transport.url import Url
from elib.simulator.physics.body import Quality

DEFAULT_WORLD = "arena"


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """The settings of a simulation.

    Attributes:
        world: Name of a world of the gallery, or the path of a TOML file.
        firmware: Name of the firmware that the robots run.
        seed: Seed of every random number: the same seed gives the same run. None: the seed of the world.
        robots: How many robots the world holds; None: as many as the world names.
        robot: Which of them is meant, counted from 1, in a world that all who open it on one event loop share;
            None: the first one of a world of its own.
        hardware: File with constant readings that replaces world and physics, or None.
        speed: ``"real"``, ``"max"`` or a factor, 0.001 to 1000.
        latency: Delay of the link each way, s.
        jitter: Standard deviation of that delay, s.
        baud: Speed of the serial line, bit/s; 0 does not pace it. Over Wi-Fi it has no effect.
        loss: Probability that a whole answer is lost; over Wi-Fi it comes 0.5 s later instead.
        fault: Script of timed faults: the name of one that comes with elib, or the path of a TOML file; or None.
        profile: File of a robot profile, as ``elib fit`` writes it: wheels, link and infrared curve of one true robot,
            which all robots here then have; or None.
        quality: How good the robots are: ``ideal``, ``good``, ``typical`` or ``bad``; the seed draws their faults.
            None: as the world says.
        view: Show the world live in the browser. A process of its own then simulates it in real time, and ends with
            this one. The key takes no value: ``sim://corridor?view``.

    Raises:
        ArgumentError: A value is out of its range, or is not a number.
    """

    world: str = DEFAULT_WORLD
    firmware: str = "asercom-1.2.2"
    seed: Seed | None = None
    robots: Annotated[int, Whole(1, 10_000)] | None = None
    robot: Annotated[int, Whole(1, 10_000)] | None = None
    hardware: str | None = None
    speed: Speed = "real"
    latency: Delay = 0.0
    jitter: Delay = 0.0
    baud: Annotated[int, Whole(0, 10_000_000, "bit/s")] = 115200
    loss: Probability = 0.0
    fault: str | None = None
    profile: str | None = None
    quality: Quality | None = None
    view: bool = False

    def __post_init__(self) -> None:
        check(self)
        if self.profile is not None and self.hardware is not None:
            raise ArgumentError("profile and hardware exclude each other", hint="constant readings need no profile")
        if self.quality is not None and self.hardware is not None:
            raise ArgumentError("quality and hardware exclude each other", hint="constant readings have no quality")
        if self.robot is not None and self.robots is not None and self.robot > self.robots:
            raise ArgumentError(f"robot is {self.robot}, but there are robots={self.robots}, counted from 1")
        if parse_speed(self.speed) == "max" and self.view:
            raise ArgumentError(
                "speed is max, but a person watches a view in real time", hint="leave speed=max out, or view"
            )

    @classmethod
    def from_text(cls, world: str, keys: Mapping[str, str]) -> Self:
        """Read the settings from text, as a URL or a command line gives it.

        Raises:
            ArgumentError: A value is out of its range, or is not a number.
        """
        values: dict[str, object] = {**keys}
        for field in fields_of(SimulationSettings):
            if field.name in keys and field.name != "view":
                values[field.name] = field.rule.read(keys[field.name])
        if "speed" in keys:
            values["speed"] = parse_speed(keys["speed"])
        if "view" in keys:
            if keys["view"] not in ("", "1"):
                raise ArgumentError(f"view is {keys['view']!r}; it takes no value", hint=f"write sim://{world}?view")
            values["view"] = True
        return cls(world=world, **values)  # type: ignore[arg-type]  # checked by the class itself


FLAGS = ("view",)
"""The keys of a ``sim://`` URL that stand without a value."""
KEYS = tuple(name for name in SimulationSettings.__dataclass_fields__ if name != "world")
"""The keys of a ``sim://`` URL."""


def settings_of(url: Url) -> SimulationSettings:
    """Return the settings of a ``sim://`` URL.

    Raises:
        ArgumentError: A value is out of its range.
    """
    return SimulationSettings.from_text(url.target or DEFAULT_WORLD, url.keys)
