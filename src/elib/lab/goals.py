"""The kinds of goals of labs: a class for each, whose fields are its keys in ``lab.toml``, and which judges a run."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Annotated

from elib.base.rules import Degrees, Mistake, Number, Text, Whole, nearest
from elib.lab.goal import (
    Count,
    Finding,
    Goal,
    LedNumbers,
    Metres,
    Run,
    Seconds,
    Share,
    Shift,
    Stretch,
    Zone,
    ZoneName,
    ZoneNames,
)
from elib.link.protocol.commands import SPECS
from elib.simulator.physics import Box, Cylinder, Pose, Scene, Snapshot, Stripe
from elib.simulator.physics.geometry import segment_distance


def _nearest(run: Run, robot: int, zone: Zone) -> str:
    path = run.path(robot)
    distances = [math.hypot(pose.x - zone.x, pose.y - zone.y) for pose in path]
    tick = min(range(len(path)), key=distances.__getitem__)
    where = f"to the middle of the zone {zone.name}, after {tick * run.step:.1f} s"
    return f"came no nearer than {distances[tick]:.2f} m {where}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach(Stretch):
    """The robot's middle is in a zone.

    Attributes:
        zone: The zone.
        hold: How long it must stay there without a break, s.
        at_end: Whether it must be there at the end.
    """

    zone: ZoneName

    def _sentence(self) -> str:
        return f"The robot is in {self.zone}{self._ending()}."

    def _one(self, run: Run, robot: int) -> Finding:
        zone = run.zones[self.zone]
        flags = [zone.holds(pose) for pose in run.path(robot)]
        return self._judge(run, flags, f"in the zone {zone.name}", _nearest(run, robot, zone))


@dataclass(frozen=True, slots=True, kw_only=True)
class Visit(Goal):
    """The robot's middle has been in each of several zones.

    Attributes:
        zones: The zones.
        ordered: Whether it must come to them in this order.
    """

    zones: ZoneNames
    ordered: bool = False

    def _sentence(self) -> str:
        return f"The robot visits {', '.join(self.zones)}{' in this order' if self.ordered else ''}."

    def _one(self, run: Run, robot: int) -> Finding:
        path, left, last = run.path(robot), list(self.zones), 0
        for tick, pose in enumerate(path):
            for name in left[:1] if self.ordered else tuple(left):
                if run.zones[name].holds(pose):
                    left.remove(name)
                    last = tick
        if not left:
            return True, f"visited {_number(len(self.zones), 'zone')}, the last one after {last * run.step:.1f} s"
        been = f"visited {len(self.zones) - len(left)} of {len(self.zones)} zones{' in order' if self.ordered else ''}"
        return False, f"{been}; not {left[0]}: {_nearest(run, robot, run.zones[left[0]])}"


@dataclass(frozen=True, slots=True, kw_only=True)
class KeepOut(Goal):
    """The robot's middle is never in one of several zones.

    Attributes:
        zones: The zones.
    """

    zones: ZoneNames

    def _sentence(self) -> str:
        return f"The robot keeps out of {', '.join(self.zones)}."

    def _one(self, run: Run, robot: int) -> Finding:
        for tick, pose in enumerate(run.path(robot)):
            for name in self.zones:
                if run.zones[name].holds(pose):
                    return False, f"in the zone {name} after {tick * run.step:.1f} s"
        return True, "never in one of them"


@dataclass(frozen=True, slots=True, kw_only=True)
class NoContact(Goal):
    """The robot touches nothing: no wall, no thing, no robot.

    Attributes:
        most: How much contact is forgiven in all, s.
    """

    most: Seconds = 0.0

    def _sentence(self) -> str:
        return (
            "The robot touches nothing." if not self.most else f"The robot touches things for {self.most:g} s at most."
        )

    def _one(self, run: Run, robot: int) -> Finding:
        ticks = [tick for tick, touching in enumerate(run.touching) if robot in touching]
        if not ticks:
            return True, "touched nothing"
        pose = run.poses[ticks[0]][robot]
        text = f"touched something for {len(ticks) * run.step:.2f} s"
        where = f", first after {ticks[0] * run.step:.1f} s at ({pose.x:.2f}, {pose.y:.2f})"
        return len(ticks) * run.step <= self.most + 1e-9, text + where


@dataclass(frozen=True, slots=True, kw_only=True)
class Distance(Goal):
    """The length of the robot's true path is in a range.

    Attributes:
        least: The least length, m.
        most: The greatest length, m; None for no limit.
    """

    least: Metres = 0.0
    most: Annotated[float, Number(0, 1000, "m", example="2", otherwise="no limit")] | None = None

    def _sentence(self) -> str:
        return f"The robot drives {_range(self.least, self.most, 'm')}."

    def _one(self, run: Run, robot: int) -> Finding:
        length = math.fsum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in pairwise(run.path(robot)))
        return _is_in(length, self.least, self.most), f"drove {length:.2f} m"


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnedBy(Goal):
    """The robot has turned by an angle in all, to the left minus to the right.

    Attributes:
        least: The least angle; None for no limit.
        most: The greatest angle; None for no limit.
    """

    least: Annotated[float, Degrees(-36000, 36000, example="350", otherwise="no limit")] | None = None
    most: Annotated[float, Degrees(-36000, 36000, example="370", otherwise="no limit")] | None = None

    def __post_init__(self) -> None:
        if self.least is None and self.most is None:
            raise Mistake("is missing", path=("least",), hint="write least = 350, most = 370, or both")

    def _sentence(self) -> str:
        least, most = (None if each is None else round(math.degrees(each), 1) for each in (self.least, self.most))
        return f"The robot turns {_range(least, most, 'degrees')} to the left in all."

    def _one(self, run: Run, robot: int) -> Finding:
        turned = math.fsum(_difference(b.heading, a.heading) for a, b in pairwise(run.path(robot)))
        return _is_in(turned, self.least, self.most), f"turned {math.degrees(turned):.0f} degrees in all"


@dataclass(frozen=True, slots=True, kw_only=True)
class EndsAt(Goal):
    """The robot ends at a place of the world, at a heading, or both.

    Attributes:
        x: The place, m.
        y: The place, m.
        within: How near it must be, m.
        heading: The heading: 0 along x, positive to the left; None for any.
        tolerance: How near the heading must be.
    """

    x: Annotated[float, Number(-1000, 1000, "m", otherwise="any")] | None = None
    y: Annotated[float, Number(-1000, 1000, "m", otherwise="any")] | None = None
    within: Metres = 0.02
    heading: Annotated[float, Degrees(example="90", otherwise="any")] | None = None
    tolerance: Annotated[float, Degrees(0, 180)] = math.radians(10)

    def __post_init__(self) -> None:
        if self.x is None and self.heading is None:
            raise Mistake("is missing", path=("position",), hint="write position = [0.5, 0.5], heading = 90, or both")

    def _sentence(self) -> str:
        place = "" if self.x is None else f" within {self.within:g} m of ({self.x:g}, {self.y:g})"
        heading = "" if self.heading is None else f" with a heading of {math.degrees(self.heading):.0f} degrees"
        return f"The robot ends{place}{heading}."

    def _one(self, run: Run, robot: int) -> Finding:
        end, holds, texts = run.poses[-1][robot], True, []
        if self.x is not None and self.y is not None:
            away = math.hypot(end.x - self.x, end.y - self.y)
            holds = away <= self.within
            texts.append(f"{away:.3f} m from the place")
        if self.heading is not None:
            error = abs(_difference(end.heading, self.heading))
            holds = holds and error <= self.tolerance
            texts.append(f"{math.degrees(error):.1f} degrees from the heading")
        return holds, f"ended {' and '.join(texts)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Moved(Goal):
    """The robot ends at a place that is told as seen from its start.

    Attributes:
        ahead: How far ahead of its start, m.
        left: How far to the left of its start, m.
        within: How near to that it must be, m.
        turn: By how much its heading differs from that at the start; None for any.
        tolerance: How near the heading must be.
    """

    ahead: Shift = 0.0
    left: Shift = 0.0
    within: Metres = 0.01
    turn: Annotated[float, Degrees(example="90", otherwise="any")] | None = None
    tolerance: Annotated[float, Degrees(0, 180)] = math.radians(10)

    def _sentence(self) -> str:
        left = f" and {self.left:g} m to the left" if self.left else ""
        turn = "" if self.turn is None else f", turned by {math.degrees(self.turn):.0f} degrees"
        return f"The robot ends {self.ahead:g} m ahead{left} of its start{turn}."

    def _one(self, run: Run, robot: int) -> Finding:
        start, end = run.poses[0][robot], run.poses[-1][robot]
        dx, dy = end.x - start.x, end.y - start.y
        cosine, sine = math.cos(start.heading), math.sin(start.heading)
        ahead, left = dx * cosine + dy * sine, dy * cosine - dx * sine
        holds = math.hypot(ahead - self.ahead, left - self.left) <= self.within
        text = f"ended {ahead:.3f} m ahead and {abs(left):.3f} m to the {'left' if left >= 0 else 'right'} of its start"
        if self.turn is not None:
            turned = _difference(end.heading, start.heading)
            holds = holds and abs(_difference(turned, self.turn)) <= self.tolerance
            text += f", turned by {math.degrees(turned):.1f} degrees"
        return holds, text


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeGoal(Goal):
    """The program ended by itself within a time.

    Attributes:
        most: The greatest robot time, s.
    """

    most: Seconds

    def _sentence(self) -> str:
        return f"The program is done within {self.most:g} s."

    def judge(self, run: Run) -> Finding:
        """Return whether the goal holds, and what happened."""
        if not run.has_ended:
            return False, f"it was not done after {run.time:.1f} s"
        return run.time <= self.most, f"done after {run.time:.1f} s"


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowLine(Goal):
    """The robot's middle is near a stripe on the floor.

    Attributes:
        within: How near, m.
        share: For which part of the time.
        after: From when on, s.
        covered: The part of the line's length that it must come past.
        stripe: Which stripe of the world's file, from 1.
    """

    within: Metres = 0.02
    share: Share = 0.9
    after: Seconds = 0.0
    covered: Share = 0.0
    stripe: Annotated[int, Whole(1, 1000, example="1")] = 1

    def check(self, zones: Mapping[str, Zone], robots: int, scene: Scene) -> None:
        """Check what the goal names."""
        super(FollowLine, self).check(zones, robots, scene)
        stripes = len(stripes_of(scene))
        if self.stripe > stripes:
            raise Mistake(f"is {self.stripe}, but the world has {stripes} stripes", path=("stripe",))

    def _sentence(self) -> str:
        past = f" and comes past {self.covered:.0%} of it" if self.covered else ""
        return f"The robot is within {self.within * 1000:g} mm of the line for {self.share:.0%} of the time{past}."

    def _one(self, run: Run, robot: int) -> Finding:
        course = run.stripes[self.stripe - 1]
        path = run.path(robot)[math.ceil(self.after / run.step) :]
        if not path:
            return False, f"the run was over before {self.after:g} s"
        away = [min(segment_distance(pose.x, pose.y, *a, *b) for a, b in pairwise(course)) for pose in path]
        share = sum(each <= self.within for each in away) / len(away)
        text = (
            f"within {self.within * 1000:g} mm for {share:.0%} of the time, {max(away) * 1000:.0f} mm at its furthest"
        )
        if not self.covered:
            return share >= self.share, text
        near = [pose for pose, distance in zip(path, away, strict=True) if distance <= self.within]
        places = list(_places(course))
        past = sum(_is_near(place, near, self.within) for place in places) / len(places)
        return share >= self.share and past >= self.covered, f"{text}; came past {past:.0%} of the line"


@dataclass(frozen=True, slots=True, kw_only=True)
class Requests(Goal):
    """The number of requests that the program sent is in a range.

    Attributes:
        command: The command by its name in Python; empty for all commands.
        least: How often at least, of all robots together.
        most: How often at most; None for no limit.
    """

    command: Annotated[str, Text(example='"proximity"', otherwise="all commands")] = ""
    least: Count = 0
    most: Annotated[int, Whole(0, 1_000_000, example="10", otherwise="no limit")] | None = None

    def check(self, zones: Mapping[str, Zone], robots: int, scene: Scene) -> None:
        """Check what the goal names."""
        super(Requests, self).check(zones, robots, scene)
        if self.command and self.command not in SPECS:
            what = f'is "{self.command}", which is not a command'
            raise Mistake(what, path=("command",), hint=nearest(self.command, SPECS))

    def _sentence(self) -> str:
        what = f"{self.command} requests" if self.command else "requests of any kind"
        return f"The program sends {_range(self.least or None, self.most, what)}."

    def judge(self, run: Run) -> Finding:
        """Return whether the goal holds, and what happened."""
        count = run.requests[self.command] if self.command else sum(run.requests.values())
        return _is_in(count, self.least, self.most), f"sent {_number(count, f'{self.command} request'.strip())}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Stands(Goal):
    """The robot's wheels stand when all is over."""

    def _sentence(self) -> str:
        return "The robot stands at the end."

    def _one(self, run: Run, robot: int) -> Finding:
        left, right = (1000 * speed for speed in run.speeds[robot])
        if left == right == 0:
            return True, "its wheels stand"
        return False, f"its wheels still turn: {left:.0f} mm/s left, {right:.0f} mm/s right"


@dataclass(frozen=True, slots=True, kw_only=True)
class Survives(Goal):
    """The program ended by itself in time, with exit code 0."""

    def _sentence(self) -> str:
        return "The program ends by itself without an error."

    def judge(self, run: Run) -> Finding:
        """Return whether the goal holds, and what happened."""
        if not run.has_ended:
            return False, f"it was not done after {run.time:.1f} s"
        if run.exit_code != 0:
            return False, f"ended after {run.time:.1f} s with exit code {run.exit_code}"
        return True, f"ended after {run.time:.1f} s"


@dataclass(frozen=True, slots=True, kw_only=True)
class Lit(Goal):
    """LEDs of the ring have been on together.

    Attributes:
        leds: Their numbers.
        times: How often they went on.
    """

    leds: LedNumbers = (0,)
    times: Annotated[int, Whole(1, 10_000, example="3")] = 1

    def _sentence(self) -> str:
        often = "" if self.times == 1 else f" {self.times} times"
        return f"The robot switches LED {', '.join(map(str, self.leds))} on{often}."

    def _one(self, run: Run, robot: int) -> Finding:
        mask = sum(1 << led for led in self.leds)
        flags = [False, *(row[robot] & mask == mask for row in run.lit)]
        count = sum(b and not a for a, b in pairwise(flags))
        return count >= self.times, f"on {_number(count, 'time')}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Says(Goal):
    """The program printed a text.

    Attributes:
        text: A regular expression of Python that is searched in what it printed.
    """

    text: Annotated[str, Text(example='"done"')]

    def __post_init__(self) -> None:
        try:
            re.compile(self.text)
        except re.error as error:
            raise Mistake(f"is not a regular expression: {error}", path=("text",)) from None

    def _sentence(self) -> str:
        return f"The program prints {self.text!r}."

    def judge(self, run: Run) -> Finding:
        """Return whether the goal holds, and what happened."""
        if re.search(self.text, run.output, re.MULTILINE):
            return True, "printed it"
        lines = run.output.strip().splitlines()
        return False, f"printed last: {lines[-1][:80]!r}" if lines else "printed nothing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Push(Goal):
    """The middle of a named box or cylinder is in a zone at the end.

    Attributes:
        thing: Its name in the world's file.
        zone: The zone.
    """

    thing: Annotated[str, Text(example='"ball"')]
    zone: ZoneName

    def check(self, zones: Mapping[str, Zone], robots: int, scene: Scene) -> None:
        """Check what the goal names."""
        super(Push, self).check(zones, robots, scene)
        names = [each.name for each in things_of(scene) if each.name]
        if self.thing not in names:
            what = f'is "{self.thing}", and the world has no such box or cylinder'
            raise Mistake(what, path=("thing",), hint=nearest(self.thing, names))

    def _sentence(self) -> str:
        return f"{self.thing} lies in {self.zone} at the end."

    def judge(self, run: Run) -> Finding:
        """Return whether the goal holds, and what happened."""
        zone = run.zones[self.zone]
        thing = next(each for each in things_of(run.snapshot) if each.name == self.thing)
        away = math.hypot(thing.x - zone.x, thing.y - zone.y)
        text = f"{self.thing} ended {away:.2f} m from the middle of the zone {zone.name}"
        return zone.holds(Pose(thing.x, thing.y)), text


@dataclass(frozen=True, slots=True, kw_only=True)
class AllInZone(Stretch):
    """So many robots are in a zone at the same time.

    Attributes:
        zone: The zone.
        count: How many robots; None for all.
        hold: For how long without a break, s.
        at_end: Whether it must be so at the end.
    """

    zone: ZoneName
    count: Annotated[int, Whole(1, 10_000, example="3", otherwise="all robots")] | None = None

    def _sentence(self) -> str:
        return f"{'All' if self.count is None else self.count} robots are in {self.zone} together{self._ending()}."

    def judge(self, run: Run) -> Finding:
        """Return whether the goal holds, and what happened."""
        zone, wanted = run.zones[self.zone], self.count or run.robots
        counts = [sum(map(zone.holds, row)) for row in run.poses]
        best = max(counts)
        text = f"{_number(wanted, 'robot')} in the zone {zone.name}"
        missed = f"{best} of {wanted} robots in the zone {zone.name} at most, at {counts.index(best) * run.step:.1f} s"
        return self._judge(run, [count >= wanted for count in counts], text, missed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gathered(Stretch):
    """No two robots are further apart than a distance.

    Attributes:
        within: The largest distance of two robots' middles, m.
        hold: For how long without a break, s.
        at_end: Whether it must be so at the end.
    """

    within: Metres
    at_end: bool = True

    def _sentence(self) -> str:
        return f"No two robots are more than {self.within:g} m apart{self._ending()}."

    def judge(self, run: Run) -> Finding:
        """Return whether the goal holds, and what happened."""
        widths = [max(_distances(row)) for row in run.poses]
        least = min(widths)
        missed = f"{least:.2f} m apart at their nearest, at {widths.index(least) * run.step:.1f} s"
        return self._judge(run, [width <= self.within for width in widths], "gathered", missed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread(Stretch):
    """Every two robots are further apart than a distance.

    Attributes:
        least: The smallest distance of two robots' middles, m.
        hold: For how long without a break, s.
        at_end: Whether it must be so at the end.
    """

    least: Metres
    at_end: bool = True

    def _sentence(self) -> str:
        return f"Every two robots are at least {self.least:g} m apart{self._ending()}."

    def judge(self, run: Run) -> Finding:
        """Return whether the goal holds, and what happened."""
        gaps = [min(_distances(row)) for row in run.poses]
        best = max(gaps)
        missed = f"the nearest two were {best:.2f} m apart at best, at {gaps.index(best) * run.step:.1f} s"
        return self._judge(run, [gap >= self.least for gap in gaps], "spread", missed)


KINDS: dict[str, type[Goal]] = {
    "reach": Reach,
    "visit": Visit,
    "keep-out": KeepOut,
    "no-contact": NoContact,
    "distance": Distance,
    "turned": TurnedBy,
    "pose": EndsAt,
    "moved": Moved,
    "time": TimeGoal,
    "follow-line": FollowLine,
    "requests": Requests,
    "stands": Stands,
    "survives": Survives,
    "lit": Lit,
    "says": Says,
    "push": Push,
    "all-in-zone": AllInZone,
    "gathered": Gathered,
    "spread": Spread,
}
"""The kinds of goals by their names, in the order of the reference page."""


def stripes_of(scene: Scene) -> list[Sequence[tuple[float, float]]]:
    """Return the courses of the stripes on a world's floor, in the order of its file."""
    return [paint.points for paint in scene.paint if isinstance(paint, Stripe)]


def things_of(world: Scene | Snapshot) -> list[Box | Cylinder]:
    """Return the boxes and cylinders of a world."""
    return [*world.boxes, *world.cylinders]


def _distances(row: Sequence[Pose]) -> list[float]:
    return [math.hypot(a.x - b.x, a.y - b.y) for a, b in combinations(row, 2)] or [0.0]


def _difference(heading: float, other: float) -> float:
    return math.remainder(heading - other, math.tau)


def _is_in(value: float, least: float | None, most: float | None) -> bool:
    return (least is None or value >= least) and (most is None or value <= most)


def _range(least: float | None, most: float | None, unit: str) -> str:
    if most is None:
        return f"at least {least or 0:g} {unit}"
    return f"at most {most:g} {unit}" if not least else f"{least:g} to {most:g} {unit}"


def _number(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


def _places(course: Sequence[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Yield places on a line, 1 cm apart."""
    for (x1, y1), (x2, y2) in pairwise(course):
        count = max(1, round(math.dist((x1, y1), (x2, y2)) / 0.01))
        for part in range(count):
            yield x1 + (x2 - x1) * part / count, y1 + (y2 - y1) * part / count


def _is_near(place: tuple[float, float], path: Sequence[Pose], distance: float) -> bool:
    return any(math.hypot(pose.x - place[0], pose.y - place[1]) <= distance + 0.01 for pose in path)
