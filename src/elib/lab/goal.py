"""The judging of a lab: zones, the trace of a run, and what all kinds of goals have in common.

It needs no process, no socket and no file. :func:`judge` takes goals, such as those of :mod:`elib.lab.goals`, and a
plain :class:`Trace` of lists, from any source::

    goal = Reach(name="arrive", zone="target", hold=1.0)
    trace = Trace(step=1 / 64, poses=poses, zones={"target": Zone("target", 0.5, 0.5, radius=0.05)})
    [found] = judge([goal], trace)
    print(found.holds, found.text)

Verdicts are equal to the last bit on every computer, and where there is no NumPy, such as in a browser.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Annotated, ClassVar, TypeAlias

from elib.base.rules import Mistake, Number, Rule, Text, Whole, nearest
from elib.base.zone import Zone as NamedZone

MAX_NAMES = 50

MISSED = "does not count, because "
"""How the text of a goal begins that fails only because it needs another one."""

Place: TypeAlias = tuple[float, float, float]
"""Where a robot is: x and y, m, and heading, rad."""
Finding: TypeAlias = tuple[bool, str]
"""Whether a goal holds, and what happened, in words."""


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


Name = Annotated[str, Text(example='"target"')]
Seconds = Annotated[float, Number(0, 3600, "s", example="2")]


@dataclass(frozen=True, slots=True)
class Zone(NamedZone):
    """A part of the floor, which goals name.

    Attributes:
        variant: The only variant in which it is there, instead of the zone of this name; empty for all.
    """

    variant: str = ""

    def away(self, x: float, y: float) -> float:
        """Return how far a place is from its middle, m."""
        return math.hypot(x - self.x, y - self.y)

    def holds(self, x: float, y: float) -> bool:
        """Return whether a place is in it."""
        if self.radius:
            return self.away(x, y) <= self.radius
        return abs(x - self.x) <= self.width / 2 and abs(y - self.y) <= self.depth / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Trace:
    """What happened in one variant, for the goals to judge. A kind of goal reads only what it is about."""

    step: float  # time between two ticks, s
    poses: Sequence[Sequence[Place]]  # where each robot was, from the start on: for each tick the places of all robots
    touching: Sequence[Sequence[bool]] = ()  # which robots touched something: for each tick a flag for each robot
    # which LEDs of the ring were on: for each tick a number for each robot, with a bit for each LED
    lit: Sequence[Sequence[int]] = ()
    speeds: Sequence[tuple[float, float]] = ()  # speeds of each robot's wheels at the end, m/s: left and right
    # points of each robot at the end, how long it had energy, s, and what is left of that, 0..1
    earned: Sequence[tuple[float, float, float]] = ()
    rivals: Sequence[tuple[float, float, float]] = ()  # the same of the other program's robots in a game
    others: Sequence[Sequence[Place]] = ()  # where those were: for each tick the places of all of them
    # where the middle of each box and cylinder with a name is at the end, m
    things: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    zones: Mapping[str, Zone] = field(default_factory=dict)
    # the courses of the stripes on the floor, each as its points, m
    stripes: Sequence[Sequence[tuple[float, float]]] = ()
    # walls and sides of boxes at the start: both ends of each, x1, y1, x2, y2, m
    surfaces: Sequence[tuple[float, float, float, float]] = ()
    requests: Counter[str] = field(default_factory=Counter)  # how often each command was sent
    output: str = ""  # what the program printed
    time: float = 0.0  # robot time at the program's end, s
    has_ended: bool = True  # whether the program ended by itself in time
    exit_code: int | None = 0  # its exit code, if it has one

    @property
    def robots(self) -> int:
        """How many robots there are."""
        return len(self.poses[0])

    def path(self, robot: int) -> list[Place]:
        """Return where one robot was at each tick."""
        return [row[robot] for row in self.poses]


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What every goal has.

    Attributes:
        name: Its name, unique in the lab.
        points: What it is worth.
        about: What the program should do, in a sentence.
        needs: It holds only if these goals hold in the same variant as well.
        robot: The number of the robot that must meet it, from 1; None for every robot.
        says: What the program should do, as a format of the goal's fields.
    """

    says: ClassVar[str] = ""
    name: Name
    points: Annotated[float, Number(0, 1000, example="1")] = 1.0
    about: Annotated[str, Text(example='"The robot reaches the target."', otherwise="made from the keys")] = ""
    needs: Annotated[tuple[str, ...], Names(example='["arrive"]', otherwise="none")] = ()
    robot: Annotated[int, Whole(1, 10_000, example="1", otherwise="every robot")] | None = None

    @property
    def sentence(self) -> str:
        """What the program should do."""
        return self.about or self._sentence()

    def check(self, zones: Iterable[str], robots: int, things: Iterable[str], stripes: int) -> None:
        """Check what the goal names against one variant.

        Args:
            zones: The names of its zones.
            robots: How many robots it has.
            things: The names of its boxes and cylinders.
            stripes: How many stripes are on its floor.

        Raises:
            Mistake: There is no such thing in that variant.
        """
        if self.robot is not None and self.robot > robots:
            raise Mistake(f"is {self.robot}, but there are {robots} robots", path=("robot",))
        for key in ("zone", "zones"):
            named = getattr(self, key, ())
            for name in (named,) if isinstance(named, str) else named:
                if name not in zones:
                    hint = nearest(name, zones) if zones else "write its [[zone]] here, or name a zone of the world"
                    raise Mistake(f'names "{name}", and there is no such zone', path=(key,), hint=hint)
        self._check(things, stripes)

    def judge(self, trace: Trace) -> tuple[bool, str]:
        """Return whether the goal holds in a run, and what happened, in words."""
        return self._judge(trace)

    def _check(self, things: Iterable[str], stripes: int) -> None:
        """Check what goals of this kind alone name."""

    def _sentence(self) -> str:
        return self.says.format(self)

    def _judge(self, trace: Trace) -> Finding:
        """Return what became of the goal: by default that of the first robot which fails it, or else of the first."""
        chosen = range(trace.robots) if self.robot is None else [self.robot - 1]
        found = [(robot, *self._one(trace, robot)) for robot in chosen]
        robot, holds, text = next((each for each in found if not each[1]), found[0])
        return holds, text if len(found) == 1 or holds else f"robot {robot + 1}: {text}"

    def _one(self, trace: Trace, robot: int) -> Finding:
        raise NotImplementedError


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch(Goal):
    """A goal that holds if something is true for a time without a break, or at the end."""

    hold: Seconds = 0.0
    at_end: bool = False

    def _during(self, trace: Trace, flags: Sequence[bool], reached: str, missed: str) -> Finding:
        """Return what became of the goal, with flags for the ticks at which it is so, and the words for both."""
        begins = accumulate((0 if flag else tick + 1 for tick, flag in enumerate(flags)), max)
        lasted = [(tick - begin) * trace.step for tick, begin in enumerate(begins)]
        held = [flag and time >= self.hold - 1e-9 for flag, time in zip(flags, lasted, strict=True)]
        if not any(held):
            too_short = f"{reached} for {max(lasted):.1f} s without a break, not for {self.hold:g} s"
            return False, too_short if any(flags) else missed
        first = held.index(True) * trace.step
        if self.at_end:
            end = "at the end" if held[-1] else f"after {first:.1f} s, but not at the end"
            return held[-1], f"{reached} {end}"
        return True, f"{reached} after {first - self.hold:.1f} s" + (f" and for {self.hold:g} s" if self.hold else "")

    @property
    def ending(self) -> str:
        """How long it must be so, as the end of the sentence."""
        return (" at the end" if self.at_end else "") + (f" for {self.hold:g} s" if self.hold else "")


@dataclass(frozen=True, slots=True)
class GoalResult:
    """What became of one goal.

    Attributes:
        goal: The goal.
        holds: Whether it holds.
        text: What happened, in words.
    """

    goal: Goal
    holds: bool
    text: str


def judge(goals: Sequence[Goal], trace: Trace, refusal: str = "") -> tuple[GoalResult, ...]:
    """Return what became of goals in one variant; with a *refusal*, the reason why, none of them holds."""
    if refusal:
        return tuple(GoalResult(goal, False, refusal) for goal in goals)
    alone = {goal.name: goal.judge(trace) for goal in goals}
    failed = {name for name, (holds, _) in alone.items() if not holds}
    while more := {goal.name for goal in goals if failed.intersection(goal.needs)} - failed:
        failed |= more
    found = []
    for goal in goals:
        holds, text = alone[goal.name]
        missing = [name for name in goal.needs if name in failed] if holds else []
        if missing:
            named = f"goal{'' if len(missing) == 1 else 's'} {' and '.join(missing)}"
            text = f"{MISSED}{named} failed ({text})"
        found.append(GoalResult(goal, holds and not missing, text))
    return tuple(found)


def points(goals: Iterable[Goal], held: Mapping[str, int], variants: int) -> float:
    """Return the points of a program: for each goal its points, times the share of variants in which it holds.

    *held* says in how many variants each goal holds, by its name.
    """
    return sum(goal.points * held[goal.name] / variants for goal in goals)
