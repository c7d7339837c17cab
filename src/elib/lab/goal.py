"""What every goal of a lab is: zones, what a run is judged by, and the class from which the kinds are derived."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, TypeAlias

from elib.base.rules import Degrees, Mistake, Number, Rule, Several, Text, Whole, nearest
from elib.simulator.drawing.top import Zone as MarkedZone
from elib.simulator.physics import Pose, Scene, Snapshot

MAX_NAMES = 50


@dataclass(frozen=True, slots=True)
class Names(Rule):
    """A list of names."""

    def __str__(self) -> str:
        return f"a list of 1 to {MAX_NAMES} names"

    def accept(self, value: object) -> tuple[str, ...]:
        """Return *value* as a tuple."""
        names = value if isinstance(value, list | tuple) else ()
        if 0 < len(names) <= MAX_NAMES and all(isinstance(each, str) and each for each in names):
            return tuple(names)
        raise self.refuse(value)

    def written(self, value: object) -> str:
        """Return the list."""
        assert isinstance(value, tuple)
        return f"[{', '.join(map(repr, value))}]"


Name = Annotated[str, Text(example='"target"')]
ZoneName = Annotated[str, Text(example='"target"')]
ZoneNames = Annotated[tuple[str, ...], Names(example='["first", "second"]')]
Metres = Annotated[float, Number(0, 1000, "m", example="0.1")]
Shift = Annotated[float, Number(-1000, 1000, "m", example="0.1")]
Seconds = Annotated[float, Number(0, 3600, "s", example="2")]
Share = Annotated[float, Number(0, 1, example="0.9")]
Angle = Annotated[float, Degrees(example="90")]
Turned = Annotated[float, Degrees(-36000, 36000, example="360")]
Count = Annotated[int, Whole(0, 1_000_000, example="10")]
LedNumbers = Annotated[tuple[int, ...], Several(Whole(0, 7), 1, 8, example="[0, 4]")]


@dataclass(frozen=True, slots=True)
class Zone(MarkedZone):
    """A part of the floor, which goals name.

    Attributes:
        variant: The only variant in which it is there, instead of the zone of this name; empty for all.
    """

    variant: str = ""

    def holds(self, pose: Pose) -> bool:
        """Return whether a robot's middle is in it."""
        if self.radius:
            return math.hypot(pose.x - self.x, pose.y - self.y) <= self.radius
        return abs(pose.x - self.x) <= self.width / 2 and abs(pose.y - self.y) <= self.depth / 2


@dataclass(frozen=True, slots=True)
class Run:
    """What happened in one variant, for the goals to judge.

    Attributes:
        step: Time between two ticks, s.
        poses: Where each robot was, from the start on: a row for each tick.
        touching: Which robots touched something: a set for each tick.
        lit: Which LEDs of the ring were on: for each tick and robot, a bit for each LED.
        speeds: Speeds of each robot's wheels at the end, m/s.
        snapshot: The world at the end.
        zones: The zones of this variant.
        stripes: The courses of the stripes on the floor.
        requests: How often each command was sent.
        output: What the program printed.
        time: Robot time at the program's end, s.
        has_ended: Whether the program ended by itself in time.
        exit_code: Its exit code, if it has one.
    """

    step: float
    poses: Sequence[Sequence[Pose]]
    touching: Sequence[frozenset[int]]
    lit: Sequence[Sequence[int]]
    speeds: Sequence[tuple[float, float]]
    snapshot: Snapshot
    zones: Mapping[str, Zone]
    stripes: Sequence[Sequence[tuple[float, float]]]
    requests: Counter[str]
    output: str
    time: float
    has_ended: bool
    exit_code: int | None

    @property
    def robots(self) -> int:
        """How many robots there are."""
        return len(self.poses[0])

    def path(self, robot: int) -> list[Pose]:
        """Return where one robot was."""
        return [row[robot] for row in self.poses]


Finding: TypeAlias = tuple[bool, str]
"""Whether a goal holds, and what happened, in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What every goal has.

    Attributes:
        name: Its name, unique in the lab.
        points: What it is worth.
        about: What the program should do, in a sentence.
        needs: It holds only if these goals hold in the same variant as well.
        robot: The number of the robot that must meet it, from 1; None for every robot.
    """

    name: Name
    points: Annotated[float, Number(0, 1000, example="1")] = 1.0
    about: Annotated[str, Text(example='"The robot reaches the target."', otherwise="made from the keys")] = ""
    needs: Annotated[tuple[str, ...], Names(example='["arrive"]', otherwise="none")] = ()
    robot: Annotated[int, Whole(1, 10_000, example="1", otherwise="every robot")] | None = None

    @property
    def sentence(self) -> str:
        """What the program should do."""
        return self.about or self._sentence()

    def judge(self, run: Run) -> Finding:
        """Return whether the goal holds in a run, and what happened."""
        chosen = range(run.robots) if self.robot is None else [self.robot - 1]
        found = [(robot, *self._one(run, robot)) for robot in chosen]
        worst = next((each for each in found if not each[1]), found[0])
        robot, holds, text = worst
        return holds, text if len(found) == 1 or holds else f"robot {robot + 1}: {text}"

    def check(self, zones: Mapping[str, Zone], robots: int, scene: Scene) -> None:
        """Check what the goal names against one variant.

        Args:
            zones: The zones of the variant.
            robots: How many robots it has.
            scene: Its world.

        Raises:
            Mistake: There is no such thing in that variant.
        """
        if self.robot is not None and self.robot > robots:
            raise Mistake(f"is {self.robot}, but there are {robots} robots", path=("robot",))
        for key in ("zone", "zones"):
            named = getattr(self, key, ())
            for name in (named,) if isinstance(named, str) else named:
                if name not in zones:
                    raise Mistake(f'names "{name}", and there is no such zone', path=(key,), hint=nearest(name, zones))

    def _sentence(self) -> str:
        raise NotImplementedError

    def _one(self, run: Run, robot: int) -> Finding:
        raise NotImplementedError


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch(Goal):
    """A goal that holds if something is true for a time without a break, or at the end."""

    hold: Seconds = 0.0
    at_end: bool = False

    def _judge(self, run: Run, flags: Sequence[bool], reached: str, missed: str) -> Finding:
        first, last, began = None, 0.0, 0
        for tick, flag in enumerate(flags):
            if not flag:
                began = tick + 1
            elif (tick - began) * run.step >= self.hold - 1e-9 and first is None:
                first = tick
            if flag:
                last = max(last, (tick - began) * run.step)
        if self.at_end and flags[-1] and (len(flags) - 1 - began) * run.step >= self.hold - 1e-9:
            return True, f"{reached} at the end"
        if self.at_end and first is not None:
            return False, f"{reached} after {first * run.step:.1f} s, but not at the end"
        if first is not None and not self.at_end:
            stays = f" and for {self.hold:g} s" if self.hold else ""
            return True, f"{reached} after {(first * run.step) - self.hold:.1f} s{stays}"
        if last or any(flags):
            return False, f"{reached} for {last:.1f} s without a break, not for {self.hold:g} s"
        return False, missed

    def _ending(self) -> str:
        return (" at the end" if self.at_end else "") + (f" for {self.hold:g} s" if self.hold else "")
