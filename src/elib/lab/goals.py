"""The kinds of goals of labs: a class for each, whose fields are its keys in ``lab.toml``, and which judges a trace."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Annotated, TypeVar, dataclass_transform

from elib.base.plaintext import counted
from elib.base.rules import Degrees, Mistake, Number, Several, Text, Whole, nearest
from elib.lab.goal import MAX_NAMES, Finding, Goal, Name, Names, Place, Seconds, Stretch, Trace, Zone
from elib.lab.printed import MAX_SQUARES, Patch, compared, last_map
from elib.link.protocol.commands import SPECS
from elib.simulator.physics.geometry import segment_distance

PLACE_STEP = 0.01
"""m between two places of a line that a robot must come past."""

KINDS: dict[str, type[Goal]] = {}
"""The kinds of goals by their names, in the order of the reference page."""

ZoneNames = Annotated[tuple[str, ...], Names(example='["first", "second"]')]
Metres = Annotated[float, Number(0, 1000, "m", example="0.1")]
Shift = Annotated[float, Number(-1000, 1000, "m", example="0.1")]
Share = Annotated[float, Number(0, 1, example="0.9")]
Heading = Annotated[float, Degrees(example="90", otherwise="any")]
Tolerance = Annotated[float, Degrees(0, 180)]

G = TypeVar("G", bound=type[Goal])


@dataclass_transform(frozen_default=True, kw_only_default=True)
def kind(name: str) -> Callable[[G], G]:
    """Make a class the kind of goal of this name."""

    def made(cls: G) -> G:
        KINDS[name] = dataclass(frozen=True, slots=True, kw_only=True)(cls)
        return KINDS[name]  # type: ignore[return-value]  # with slots it is another class of the same fields

    return made


@kind("reach")
class Reach(Stretch):
    """The robot's middle is in a zone.

    Attributes:
        zone: The zone.
        hold: How long it must stay there without a break, s.
        at_end: Whether it must be there at the end.
    """

    says = "The robot is in {0.zone}{0.ending}."
    zone: Name

    def _one(self, trace: Trace, robot: int) -> Finding:
        zone = trace.zones[self.zone]
        inside = [zone.holds(x, y) for x, y, _ in trace.path(robot)]
        return self._during(trace, inside, f"in the zone {zone.name}", _nearest(trace, robot, zone))


@kind("visit")
class Visit(Goal):
    """The robot's middle has been in each of several zones.

    Attributes:
        zones: The zones.
        ordered: Whether it must come to them in this order.
        count: How many of them are enough; None for all.
    """

    zones: ZoneNames
    ordered: bool = False
    count: Annotated[int, Whole(1, MAX_NAMES, example="2", otherwise="all zones")] | None = None

    def _sentence(self) -> str:
        some = "" if self.count is None else f"{self.count} of "
        return f"The robot visits {some}{', '.join(self.zones)}{' in this order' if self.ordered else ''}."

    def _one(self, trace: Trace, robot: int) -> Finding:
        left, last, path = list(self.zones), -1, trace.path(robot)
        for name in self.zones:
            begin = last + 1 if self.ordered else 0
            inside = (tick for tick in range(begin, len(path)) if trace.zones[name].holds(*path[tick][:2]))
            if (first := next(inside, None)) is not None:
                last = max(last, first)
                left.remove(name)
            elif self.ordered:
                break
        visited = len(self.zones) - len(left)
        if not left or visited >= (self.count or math.inf):
            return True, f"visited {counted(visited, 'zone')}, the last one after {last * trace.step:.1f} s"
        enough = "" if self.count is None else f", and needs {self.count}"
        been = f"visited {visited} of {len(self.zones)} zones{' in order' if self.ordered else ''}{enough}"
        return False, f"{been}; not {left[0]}: {_nearest(trace, robot, trace.zones[left[0]])}"


@kind("keep-out")
class KeepOut(Goal):
    """The robot's middle is never in one of several zones.

    Attributes:
        zones: The zones.
    """

    zones: ZoneNames

    def _sentence(self) -> str:
        return f"The robot keeps out of {', '.join(self.zones)}."

    def _one(self, trace: Trace, robot: int) -> Finding:
        for tick, (x, y, _) in enumerate(trace.path(robot)):
            for name in self.zones:
                if trace.zones[name].holds(x, y):
                    return False, f"in the zone {name} after {tick * trace.step:.1f} s"
        return True, "never in one of them"


@kind("no-contact")
class NoContact(Goal):
    """The robot touches nothing: no wall, no thing, no robot.

    Attributes:
        most: How much contact is forgiven in all, s.
    """

    most: Seconds = 0.0

    def _sentence(self) -> str:
        return f"The robot touches {f'things for {self.most:g} s at most' if self.most else 'nothing'}."

    def _one(self, trace: Trace, robot: int) -> Finding:
        ticks = [tick for tick, touching in enumerate(trace.touching) if touching[robot]]
        if not ticks:
            return True, "touched nothing"
        x, y, _ = trace.poses[ticks[0]][robot]
        time = len(ticks) * trace.step
        where = f", first after {ticks[0] * trace.step:.1f} s at ({x:.2f}, {y:.2f})"
        return time <= self.most + 1e-9, f"touched something for {time:.2f} s{where}"


@kind("distance")
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

    def _one(self, trace: Trace, robot: int) -> Finding:
        length = math.fsum(math.hypot(u - x, v - y) for (x, y, _), (u, v, _) in pairwise(trace.path(robot)))
        return _is_in(length, self.least, self.most), f"drove {length:.2f} m"


@kind("turned")
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

    def _one(self, trace: Trace, robot: int) -> Finding:
        turned = math.fsum(math.remainder(b[2] - a[2], math.tau) for a, b in pairwise(trace.path(robot)))
        return _is_in(turned, self.least, self.most), f"turned {math.degrees(turned):.0f} degrees in all"


@kind("pose")
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
    heading: Heading | None = None
    tolerance: Tolerance = math.radians(10)

    def __post_init__(self) -> None:
        if self.x is None and self.heading is None:
            raise Mistake("is missing", path=("position",), hint="write position = [0.5, 0.5], heading = 90, or both")

    def _sentence(self) -> str:
        place = "" if self.x is None else f" within {self.within:g} m of ({self.x:g}, {self.y:g})"
        heading = "" if self.heading is None else f" with a heading of {math.degrees(self.heading):.0f} degrees"
        return f"The robot ends{place}{heading}."

    def _one(self, trace: Trace, robot: int) -> Finding:
        x, y, heading = trace.poses[-1][robot]
        holds, texts = True, []
        if self.x is not None and self.y is not None:
            away = math.hypot(x - self.x, y - self.y)
            holds = away <= self.within
            texts.append(f"{away:.3f} m from the place")
        if self.heading is not None:
            error = abs(math.remainder(heading - self.heading, math.tau))
            holds = holds and error <= self.tolerance
            texts.append(f"{math.degrees(error):.1f} degrees from the heading")
        return holds, f"ended {' and '.join(texts)}"


@kind("moved")
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
    turn: Heading | None = None
    tolerance: Tolerance = math.radians(10)

    def _sentence(self) -> str:
        left = f" and {self.left:g} m to the left" if self.left else ""
        turn = "" if self.turn is None else f", turned by {math.degrees(self.turn):.0f} degrees"
        return f"The robot ends {self.ahead:g} m ahead{left} of its start{turn}."

    def _one(self, trace: Trace, robot: int) -> Finding:
        (x, y, start), (u, v, end) = trace.poses[0][robot], trace.poses[-1][robot]
        dx, dy = u - x, v - y
        ahead, left = dx * math.cos(start) + dy * math.sin(start), dy * math.cos(start) - dx * math.sin(start)
        holds = math.hypot(ahead - self.ahead, left - self.left) <= self.within
        text = f"ended {ahead:.3f} m ahead and {abs(left):.3f} m to the {'left' if left >= 0 else 'right'} of its start"
        if self.turn is not None:
            turned = math.remainder(end - start, math.tau)
            holds = holds and abs(math.remainder(turned - self.turn, math.tau)) <= self.tolerance
            text += f", turned by {math.degrees(turned):.1f} degrees"
        return holds, text


@kind("time")
class TimeGoal(Goal):
    """The program ended by itself within a time.

    Attributes:
        most: The greatest robot time, s.
    """

    says = "The program is done within {0.most:g} s."
    most: Seconds

    def _judge(self, trace: Trace) -> Finding:
        after, code = f"after {trace.time:.1f} s", trace.exit_code or 0
        if code < 0:
            return False, f"signal {-code} ended it {after}"
        text = f"done {after}"
        return trace.has_ended and trace.time <= self.most, text if trace.has_ended else f"it was not {text}"


@kind("follow-line")
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

    def _check(self, things: Iterable[str], stripes: int) -> None:
        if self.stripe > stripes:
            raise Mistake(f"is {self.stripe}, but the world has {stripes} stripes", path=("stripe",))

    def _sentence(self) -> str:
        past = f" and comes past {self.covered:.0%} of it" if self.covered else ""
        return f"The robot is within {self.within * 1000:g} mm of the line for {self.share:.0%} of the time{past}."

    def _one(self, trace: Trace, robot: int) -> Finding:
        course = trace.stripes[self.stripe - 1]
        path = trace.path(robot)[math.ceil(self.after / trace.step) :]
        if not path:
            return False, f"the run was over before {self.after:g} s"
        away = [min(segment_distance(x, y, *a, *b) for a, b in pairwise(course)) for x, y, _ in path]
        near = [place for place, distance in zip(path, away, strict=True) if distance <= self.within]
        share, furthest = len(near) / len(path), f"{max(away) * 1000:.0f} mm at its furthest"
        text = f"within {self.within * 1000:g} mm for {share:.0%} of the time, {furthest}"
        if not self.covered:
            return share >= self.share, text
        passed = [_comes_past(place, near, self.within + PLACE_STEP) for place in _places(course)]
        past = sum(passed) / len(passed)
        return share >= self.share and past >= self.covered, f"{text}; came past {past:.0%} of the line"


@kind("requests")
class Requests(Goal):
    """The number of requests that the program sent is in a range.

    Attributes:
        command: The command by its name in Python; empty for all commands.
        least: How often at least, of all robots together.
        most: How often at most; None for no limit.
    """

    command: Annotated[str, Text(example='"proximity"', otherwise="all commands")] = ""
    least: Annotated[int, Whole(0, 1_000_000, example="10")] = 0
    most: Annotated[int, Whole(0, 1_000_000, example="10", otherwise="no limit")] | None = None

    def _check(self, things: Iterable[str], stripes: int) -> None:
        if self.command and self.command not in SPECS:
            what = f'is "{self.command}", which is not a command'
            raise Mistake(what, path=("command",), hint=nearest(self.command, SPECS))

    def _sentence(self) -> str:
        what = f"{self.command} requests" if self.command else "requests of any kind"
        return f"The program sends {_range(self.least or None, self.most, what)}."

    def _judge(self, trace: Trace) -> Finding:
        count = trace.requests[self.command] if self.command else trace.requests.total()
        return _is_in(count, self.least, self.most), f"sent {counted(count, f'{self.command} request'.strip())}"


@kind("stands")
class Stands(Goal):
    """The robot's wheels stand when all is over."""

    says = "The robot stands at the end."

    def _one(self, trace: Trace, robot: int) -> Finding:
        left, right = (1000 * speed for speed in trace.speeds[robot])
        turning = f"its wheels still turn: {left:.0f} mm/s left, {right:.0f} mm/s right"
        return (True, "its wheels stand") if left == right == 0 else (False, turning)


@kind("survives")
class Survives(Goal):
    """The program ended by itself in time, with exit code 0."""

    says = "The program ends by itself without an error."

    def _judge(self, trace: Trace) -> Finding:
        if not trace.has_ended:
            return False, f"it was not done after {trace.time:.1f} s"
        code = f" with exit code {trace.exit_code}" if trace.exit_code else ""
        return not code, f"ended after {trace.time:.1f} s{code}"


@kind("lit")
class Lit(Goal):
    """LEDs of the ring have been on together.

    Attributes:
        leds: Their numbers.
        times: How often they went on.
        zones: Where those robots began that must switch them on; all others must never do so.
    """

    leds: Annotated[tuple[int, ...], Several(Whole(0, 7), 1, 8, example="[0, 4]")] = (0,)
    times: Annotated[int, Whole(1, 10_000, example="3")] = 1
    zones: Annotated[tuple[str, ...], Names(example='["broken"]', otherwise="anywhere")] = ()

    def _sentence(self) -> str:
        often = "" if self.times == 1 else f" {self.times} times"
        who = f"Who begins in {', '.join(self.zones)}, and no other robot," if self.zones else "The robot"
        return f"{who} switches LED {', '.join(map(str, self.leds))} on{often}."

    def _one(self, trace: Trace, robot: int) -> Finding:
        mask = sum(1 << led for led in set(self.leds))  # a LED may be named twice
        lit = [row[robot] & mask == mask for row in trace.lit]
        count = sum(now and not before for before, now in pairwise([False, *lit]))
        is_asked = not self.zones or _begins_in(trace, robot, self.zones)
        return count >= self.times if is_asked else not count, f"on {counted(count, 'time')}"


@kind("score")
class Score(Goal):
    """The robot has points, and energy left, at the end: those of the zones and pucks of its world.

    Attributes:
        least: How many points at least.
        energy: How much of its energy at least.
    """

    least: Annotated[float, Number(-1000, 1000, example="3")] = 1.0
    energy: Share = 0.0

    def _sentence(self) -> str:
        points = f"{self.least:g} point{'s' * (self.least != 1)}"
        return f"The robot earns {points}{f' and keeps {self.energy:.0%} energy' if self.energy else ''}."

    def _one(self, trace: Trace, robot: int) -> Finding:
        score, _, energy = trace.earned[robot]
        return score >= self.least and energy >= self.energy, f"{score:g} points, {energy:.0%} energy"


@kind("outdoes")
class Outdoes(Goal):
    """In a game the program's robots end with more points than those of the other program.

    With as many points, those with energy for longer are ahead; if that is equal too, those with more energy left.
    """

    says = "The robot has more points than the other one, or energy for longer, or more energy left."

    def _judge(self, trace: Trace) -> Finding:
        sides = [tuple(map(math.fsum, zip(*side, strict=True))) for side in (trace.earned, trace.rivals)]
        if not sides[1]:
            return False, "there is no other program"
        own, other = (f"{side[0]:g} points, {side[1]:.1f} s, {side[2]:.0%} energy" for side in sides)
        return sides[0] > sides[1], f"{own}; the other one {other}"


@kind("catches")
class Catches(Goal):
    """In a game the robot comes near a robot of the other program; who begins elsewhere must not be caught.

    Attributes:
        zones: Where those robots begin that seek. All others hide: they must get away from those of the other program.
        within: How near the middles of two robots must be, m.
    """

    zones: ZoneNames
    within: Metres = 0.1

    def _sentence(self) -> str:
        where = ", ".join(self.zones)
        return (
            f"Who begins in {where} comes within {self.within:g} m of the other robot; who begins elsewhere gets away."
        )

    def _one(self, trace: Trace, robot: int) -> Finding:
        if not trace.others or not trace.others[0]:
            return False, "there is no other program"
        pairs = zip(trace.path(robot), trace.others, strict=True)
        away = [min(math.hypot(x - u, y - v) for u, v, _ in places) for (x, y, _), places in pairs]
        met = next((tick for tick, distance in enumerate(away) if distance <= self.within), None)
        seeks = _begins_in(trace, robot, self.zones)
        if met is not None:
            return seeks, f"{'caught the other one' if seeks else 'caught'} after {met * trace.step:.1f} s"
        nearest = f"{min(away):.2f} m at the nearest, after {away.index(min(away)) * trace.step:.1f} s"
        return not seeks, f"did not catch the other one: {nearest}" if seeks else f"got away: {nearest}"


@kind("says")
class Says(Goal):
    """The program printed a text.

    Attributes:
        text: A regular expression of Python that is searched in what it printed.
    """

    says = "The program prints {0.text!r}."
    text: Annotated[str, Text(example='"done"')]

    def __post_init__(self) -> None:
        try:
            re.compile(self.text)
        except re.error as error:
            raise Mistake(f"is not a regular expression: {error}", path=("text",)) from None

    def _judge(self, trace: Trace) -> Finding:
        if re.search(self.text, trace.output, re.MULTILINE):
            return True, "printed it"
        lines = trace.output.strip().splitlines()
        return False, f"printed last: {lines[-1][:80]!r}" if lines else "printed nothing"


@kind("measures")
class Measures(Goal):
    """The program printed the size of a zone: a line with its name and both sides, m. The last one counts.

    Attributes:
        zone: The zone, a rectangle.
        within: How far each side may be off, m.
    """

    zone: Name
    within: Metres = 0.02

    def _sentence(self) -> str:
        return f'The program prints the sides of {self.zone}, to {100 * self.within:g} cm, as "{self.zone} 0.50 0.40".'

    def _judge(self, trace: Trace) -> Finding:
        zone = trace.zones[self.zone]
        side = r" +(\d{0,9}\.?\d{1,30})"  # a limit, because a million digits would keep the search busy for hours
        found = re.findall(rf"^{re.escape(self.zone)}{side}{side}\s*$", trace.output, re.MULTILINE)
        if not found:
            return False, f'printed no line like "{self.zone} 0.50 0.40"'
        told, real = sorted(map(float, found[-1])), sorted((zone.width, zone.depth))
        off = [abs(each - side) for each, side in zip(told, real, strict=True)]
        text = " and ".join(f"{side:.3f} m, {100 * by:.1f} cm off" for side, by in zip(told, off, strict=True))
        return max(off) <= self.within, f"printed {text}"


@kind("maps")
class Maps(Goal):
    """The program printed a map of the arena, as ``print(grid.to_text())`` does; the last one counts.

    The robot starts at its (0, 0) and looks along x. It may be turned by up to 6 degrees, and be off by 2 cm each way.

    Attributes:
        share: Which part must be right of three: of the ground as free, of the walls as occupied, and of the occupied
            squares.
        within: How far a wall may be off, m.
    """

    share: Share = 0.9
    within: Metres = 0.02

    def _sentence(self) -> str:
        return f"The program prints a map of which {self.share:.0%} is right, to {100 * self.within:g} cm."

    def _one(self, trace: Trace, robot: int) -> Finding:
        told = last_map(trace.output)
        if told is None:
            return False, f"printed no map of 1 to {MAX_SQUARES} squares; use print(grid.to_text())"
        found = compared(told, trace.poses[0][robot], tuple(trace.surfaces), self.within)
        text = f"its map has {found.free:.0%} of the ground and {found.walls:.0%} of the walls"
        text += f"; {found.occupied:.0%} of what is on it is a wall"
        return found.least >= self.share, f"{text}; {self.share:.0%} of each is needed"

    def patches(self, trace: Trace) -> list[Patch]:
        """Return the parts of the printed map, laid over the world where it fits best."""
        told, start = last_map(trace.output), trace.poses[0][(self.robot or 1) - 1]
        if told is None:
            return []
        return told.patches(start, compared(told, start, tuple(trace.surfaces), self.within).fit)


@kind("push")
class Push(Goal):
    """The middle of a named box or cylinder is in a zone at the end.

    Attributes:
        thing: Its name in the world's file.
        zone: The zone.
    """

    says = "{0.thing} lies in {0.zone} at the end."
    thing: Annotated[str, Text(example='"ball"')]
    zone: Name

    def _check(self, things: Iterable[str], stripes: int) -> None:
        if self.thing not in things:
            what = f'is "{self.thing}", and the world has no such box or cylinder'
            raise Mistake(what, path=("thing",), hint=nearest(self.thing, things))

    def _judge(self, trace: Trace) -> Finding:
        zone, place = trace.zones[self.zone], trace.things[self.thing]
        away = f"{zone.away(*place):.2f} m from the middle of the zone {zone.name}"
        return zone.holds(*place), f"{self.thing} ended {away}"


@kind("all-in-zone")
class AllInZone(Stretch):
    """So many robots are in a zone at the same time.

    Attributes:
        zone: The zone.
        count: How many robots; None for all.
        hold: For how long without a break, s.
        at_end: Whether it must be so at the end.
    """

    zone: Name
    count: Annotated[int, Whole(1, 10_000, example="3", otherwise="all robots")] | None = None

    def _sentence(self) -> str:
        return f"{'All' if self.count is None else self.count} robots are in {self.zone} together{self.ending}."

    def _judge(self, trace: Trace) -> Finding:
        wanted = self.count or trace.robots
        inside = [sum(trace.zones[self.zone].holds(x, y) for x, y, _ in row) for row in trace.poses]
        text = f"robots in the zone {self.zone}" if wanted != 1 else f"robot in the zone {self.zone}"
        best = f"{max(inside)} of {wanted} robots in the zone {self.zone} at most"
        missed = f"{best}, at {inside.index(max(inside)) * trace.step:.1f} s"
        return self._during(trace, [count >= wanted for count in inside], f"{wanted} {text}", missed)


@kind("gathered")
class Gathered(Stretch):
    """No two robots are further apart than a distance.

    Attributes:
        within: The largest distance of two robots' middles, m.
        hold: For how long without a break, s.
        at_end: Whether it must be so at the end.
    """

    says = "No two robots are more than {0.within:g} m apart{0.ending}."
    within: Metres
    at_end: bool = True

    def _judge(self, trace: Trace) -> Finding:
        widths = [max(_apart(row)) for row in trace.poses]
        missed = f"{min(widths):.2f} m apart at their nearest, at {widths.index(min(widths)) * trace.step:.1f} s"
        return self._during(trace, [width <= self.within for width in widths], "gathered", missed)


@kind("spread")
class Spread(Stretch):
    """Every two robots are further apart than a distance.

    Attributes:
        least: The smallest distance of two robots' middles, m.
        hold: For how long without a break, s.
        at_end: Whether it must be so at the end.
    """

    says = "Every two robots are at least {0.least:g} m apart{0.ending}."
    least: Metres
    at_end: bool = True

    def _judge(self, trace: Trace) -> Finding:
        gaps = [min(_apart(row)) for row in trace.poses]
        missed = f"the nearest two were {max(gaps):.2f} m apart at best, at {gaps.index(max(gaps)) * trace.step:.1f} s"
        return self._during(trace, [gap >= self.least for gap in gaps], "spread", missed)


def _begins_in(trace: Trace, robot: int, zones: Iterable[str]) -> bool:
    return any(trace.zones[name].holds(*trace.poses[0][robot][:2]) for name in zones)


def _nearest(trace: Trace, robot: int, zone: Zone) -> str:
    away = [zone.away(x, y) for x, y, _ in trace.path(robot)]
    where = f"to the middle of the zone {zone.name}, after {away.index(min(away)) * trace.step:.1f} s"
    return f"came no nearer than {min(away):.2f} m {where}"


def _apart(places: Sequence[Place]) -> list[float]:
    """Return how far each two robots are from each other, m; zero if there is one alone."""
    return [math.hypot(x - u, y - v) for (x, y, _), (u, v, _) in combinations(places, 2)] or [0.0]


def _is_in(value: float, least: float | None, most: float | None) -> bool:
    return (least is None or value >= least) and (most is None or value <= most)


def _range(least: float | None, most: float | None, unit: str) -> str:
    if most is None:
        return f"at least {least or 0:g} {unit}"
    return f"at most {most:g} {unit}" if not least else f"{least:g} to {most:g} {unit}"


def _places(course: Sequence[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Yield places on a line, about :data:`PLACE_STEP` apart."""
    for (x1, y1), (x2, y2) in pairwise(course):
        count = max(1, round(math.dist((x1, y1), (x2, y2)) / PLACE_STEP))
        for part in range(count):
            yield x1 + (x2 - x1) * part / count, y1 + (y2 - y1) * part / count


def _comes_past(place: tuple[float, float], path: Iterable[Place], reach: float) -> bool:
    """Return whether a path comes within reach of a place."""
    x, y = place
    # Mostly it is far away, and a comparison is much quicker than a length.
    return any(abs(u - x) <= reach and abs(v - y) <= reach and math.hypot(u - x, v - y) <= reach for u, v, _ in path)
