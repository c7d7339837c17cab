"""The kinds of faults: the times at which they hold, how bad they are, and what each kind does.

A kind is a class in :data:`KINDS`, which a script file, the reference page and the player read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from random import Random
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Protocol

from elib.base.errors import ArgumentError
from elib.base.rules import Choice, Number, Several, Whole, check
from elib.base.tables import Key
from elib.simulator.emulator.faults import Fault, both
from elib.simulator.emulator.link import Link
from elib.simulator.physics.defects import FACTORS, SENSORS, Defect

MAX_TIME = 1e6
"""s; more than eleven days, longer than any script."""

MAX_CHANGES = 1000
"""Beginnings and ends of cuts in a row after which a link counts as dead for good."""

WHEELS = "left", "right"

Start = Annotated[float, Number(0, MAX_TIME, "s", example="5")]
Span = Annotated[float, Number(0.001, MAX_TIME, "s", example="5")]


@dataclass(frozen=True, slots=True)
class When:
    """The times at which a fault holds, s of robot time since the program's first byte.

    Attributes:
        start: When the fault begins: ``at`` or ``from`` in the file.
        until: When it ends, exclusive; infinite for a fault that does not end.
        every: Time from one beginning to the next, for a fault that comes again; None for one that comes once.
        lasting: How long it holds each time: ``for`` in the file; None where *until* gives the end.

    Raises:
        ArgumentError: The times contradict each other; the message names the key and a cure.
    """

    start: Start = 0.0
    until: float = math.inf
    every: Span | None = None
    lasting: Span | None = None

    def __post_init__(self) -> None:
        check(self)
        if not self.until > self.start:
            raise ArgumentError(
                f"until is {self.until:g} s, but it begins at {self.start:g} s", hint="let until come after from"
            )
        if self.every is not None and self.lasting is not None and not self.lasting < self.every:
            raise ArgumentError(
                f"for is {self.lasting:g} s and every is {self.every:g} s: it would never stop",
                hint="let for be shorter than every, or leave every out",
            )

    @property
    def is_bounded(self) -> bool:
        """Whether the fault ends each time it holds."""
        return self.lasting is not None or (self.every is None and math.isfinite(self.until))

    def share(self, time: float) -> float | None:
        """Return how much of its span has passed at *time*: 0 to 1, and 0 without an end; None if it does not hold."""
        begin = self._begin(time)
        end = min(self.until, begin + (math.inf if self.lasting is None else self.lasting))
        if not begin <= time < end:
            return None
        return (time - begin) / (end - begin) if self.is_bounded else 0.0

    def next_change(self, time: float) -> float:
        """Return when it begins or ends next after *time*; infinite if never."""
        begin = self._begin(time)
        changes = [begin, begin + (math.inf if self.lasting is None else self.lasting), self.until]
        if self.every is not None:
            changes.append(self._next_begin(begin))
        return min((change for change in changes if time < change <= self.until), default=math.inf)

    def beginning(self, after: float) -> float:
        """Return the first beginning later than *after*; infinite if there is none."""
        begin = self._begin(after)
        if begin <= after:
            begin = math.inf if self.every is None else self._next_begin(begin)
        return begin if begin < self.until else math.inf

    def _begin(self, time: float) -> float:
        """Return the last beginning at or before *time*, or else the first one."""
        if self.every is None or time < self.start:
            return self.start
        count = math.floor((time - self.start) / self.every)
        # The quotient may be rounded across a beginning; the beginnings themselves decide.
        while self.start + count * self.every > time:
            count -= 1
        while self.start + (count + 1) * self.every <= time:
            count += 1
        return self.start + count * self.every

    def _next_begin(self, begin: float) -> float:
        assert self.every is not None
        return self.start + (round((begin - self.start) / self.every) + 1) * self.every


@dataclass(frozen=True, slots=True)
class Ramp:
    """A strength that changes from one value to another while a fault holds, or stays the same."""

    first: float
    last: float

    def at(self, share: float) -> float:
        """Return the strength when *share*, 0 to 1, of the fault's span has passed."""
        return self.first + (self.last - self.first) * share


@dataclass(frozen=True, slots=True)
class Strength(Number):
    """One number that says how bad a fault is."""

    name: str = ""  # of the key in the file
    meaning: str = ""  # what it sets, in a few words
    default: float | None = None  # None if the file must give it
    may_change: bool = False  # from one value to another: `[0.0, 0.9]`


@dataclass(frozen=True, slots=True)
class TimedFault:
    """A fault of a script.

    Raises:
        ArgumentError: The times do not fit the kind, or a number may not change; the message says which, and a cure.
    """

    kind: str  # its name in KINDS
    when: When = When()
    strengths: Mapping[str, Ramp] = field(default_factory=dict)  # how bad it is, by the kind's keys
    which: Mapping[str, Any] = field(default_factory=dict)  # what it hits, by the kind's names
    robots: tuple[int, ...] = ()  # which robots it hits, counted from 1; empty for all

    def __post_init__(self) -> None:
        kind = KINDS[self.kind]
        for key in kind.keys:
            if key.name in self.strengths:
                self._check(key, self.strengths[key.name])
        if kind.is_instant and self.when.lasting is not None:
            raise ArgumentError(f"for is {self.when.lasting:g} s, but a {self.kind} has no length", hint="leave it out")
        if not kind.may_repeat and self.when.every is not None:
            raise ArgumentError(f"every is {self.when.every:g} s, but a {self.kind} comes once", hint="leave it out")
        if not kind.is_instant and self.when.every is not None and self.when.lasting is None:
            raise ArgumentError("for is missing: how long it holds each time", hint="write for = SECONDS")
        if kind.needs_end and not self.when.is_bounded:
            raise ArgumentError(f"a {self.kind} needs an end", hint="write for = SECONDS, or until = SECONDS")
        kind.check(self)

    def hits(self, robot: int) -> bool:
        """Whether it is a fault of this robot, counted from 0."""
        return not self.robots or robot + 1 in self.robots

    def level(self, key: str, share: float) -> float:
        """Return the strength *key* when *share*, 0 to 1, of the fault's span has passed."""
        ramp = self.strengths.get(key)
        if ramp is not None:
            return ramp.at(share)
        default = next(known.default for known in KINDS[self.kind].keys if known.name == key)
        assert default is not None
        return default

    def _check(self, key: Strength, ramp: Ramp) -> None:
        if ramp.first == ramp.last:
            return
        if not key.may_change:
            raise ArgumentError(
                f"{key.name} goes from {ramp.first:g} to {ramp.last:g}; it must be one number",
                hint=f"write {key.name} = {ramp.first:g}",
            )
        if not self.when.is_bounded:
            raise ArgumentError(
                f"{key.name} goes from {ramp.first:g} to {ramp.last:g}, but it is not said until when",
                hint="write until = SECONDS",
            )


@dataclass(slots=True)
class Counts:
    """Numbers of what a script has done so far.

    Attributes:
        answers: Answers that left the robot while it ran, with a fault or without.
        lost: Answers that were lost whole.
        halved: Answers of which only half came.
        corrupted: Answers in which a byte was changed.
        duplicated: Answers that came twice.
        delayed: Answers that came later.
        noise: Bytes of noise.
        stalls: How often the link stalled.
        silences: How often the answers stopped.
        cuts: How often the link was cut.
        resets: How often the robot restarted.
        defects: How often something broke or changed in the robot.
    """

    answers: int = 0
    lost: int = 0
    halved: int = 0
    corrupted: int = 0
    duplicated: int = 0
    delayed: int = 0
    noise: int = 0
    stalls: int = 0
    silences: int = 0
    cuts: int = 0
    resets: int = 0
    defects: int = 0


class Player(Protocol):
    """The player of a script, as its kinds need it: see ``FaultPlayer``."""

    link: Link
    tally: Counts
    break_parts: Callable[[str, Sequence[Defect]], object]

    @property
    def is_dead(self) -> bool:
        """Whether the battery is empty."""


class Kind:
    """A kind of fault. One object does what all faults of this kind in a script say. Times are s since it began.

    The first line of each kind's docstring is what people read about it.

    Args:
        player: The player of the script.
        faults: The faults, each with a random generator of its own.
    """

    keys: ClassVar[tuple[Strength, ...]] = ()
    names: ClassVar[tuple[Key, ...]] = ()  # keys that say what it hits
    is_instant: ClassVar[bool] = False  # whether it happens at one moment and has no length
    needs_end: ClassVar[bool] = False  # whether it must end each time it holds
    may_repeat: ClassVar[bool] = True  # whether it may come again

    def __init__(self, player: Player, faults: Sequence[tuple[TimedFault, Random]]) -> None:
        self.player = player
        self.faults = faults

    @classmethod
    def check(cls, fault: TimedFault) -> None:
        """Refuse a fault that makes no sense: an ArgumentError."""

    @property
    def blocks_robot(self) -> bool:
        """Whether no program can talk to the robot because of it."""
        return False

    def hit(self, time: float) -> Fault | None:
        """Return what goes wrong with an answer that leaves the robot at *time*; None for nothing."""
        return None

    def play(self, time: float) -> None:
        """Do what is due at *time*."""

    def next_change(self, time: float) -> float:
        """Return when :meth:`play` has something to do next; infinite if never."""
        return math.inf


class AnswerKind(Kind):
    """A kind that hits single answers, by chance."""

    what: ClassVar[Fault]

    def hit(self, time: float) -> Fault | None:
        """Draw for each fault whether it hits the answer."""
        found = None
        for fault, chance in self.faults:
            share = fault.when.share(time)
            if share is not None and chance.random() < fault.level("probability", share):
                found = both(found, self._made(fault, share, chance))
        return found

    def _made(self, fault: TimedFault, share: float, chance: Random) -> Fault:
        """Return what becomes of an answer that is hit when *share* of the fault's span has passed."""
        return self.what


class HeldKind(Kind):
    """A kind that holds from its beginning to its end."""

    _holds = False

    @property
    def blocks_robot(self) -> bool:
        """Whether it holds now."""
        return self._holds

    def play(self, time: float) -> None:
        """Begin or end."""
        blocks_robot = any(fault.when.share(time) is not None for fault, _ in self.faults)
        if blocks_robot != self._holds:
            self._holds = blocks_robot
            (self._begin if blocks_robot else self._end)()

    def next_change(self, time: float) -> float:
        """Return when one of the faults begins or ends next."""
        return min(fault.when.next_change(time) for fault, _ in self.faults)

    def _begin(self) -> None:
        raise NotImplementedError

    def _end(self) -> None:
        raise NotImplementedError


def _probability(default: float | None = None) -> Strength:
    return Strength(0, 1, "", "probability", "how probable it is for each answer", default, may_change=True)


class Loss(AnswerKind):
    """A whole answer is lost."""

    keys = (_probability(),)
    what = Fault(lose=True)


class Delay(AnswerKind):
    """An answer comes later, and those behind it wait."""

    keys = (
        Strength(0, 60, "s", "delay", "how much later", may_change=True),
        Strength(0, 60, "s", "jitter", "standard deviation of that", 0.0),
        _probability(1.0),
    )

    def _made(self, fault: TimedFault, share: float, chance: Random) -> Fault:
        jitter = chance.gauss(0.0, 1.0) * fault.level("jitter", share)
        return Fault(delay=max(0.0, fault.level("delay", share) + jitter))


class Duplicate(AnswerKind):
    """An answer comes twice."""

    keys = (_probability(), Strength(0, 60, "s", "after", "from its end to the copy", 0.0))

    def _made(self, fault: TimedFault, share: float, chance: Random) -> Fault:
        return Fault(copy_after=fault.level("after", share))


class Halve(AnswerKind):
    """Only the first half of an answer comes."""

    keys = (_probability(),)
    what = Fault(halve=True)


class Corrupt(AnswerKind):
    """The highest bit of one of an answer's first bytes is inverted."""

    keys = (_probability(),)
    what = Fault(corrupt="random")


class Noise(Kind):
    """Bytes arrive that the robot did not send."""

    keys = (
        Strength(0.001, 1000, "1/s", "rate", "bursts in a second, at random"),
        Strength(1, 64, "bytes", "size", "how many in a burst", 1.0),
    )

    def __init__(self, player: Player, faults: Sequence[tuple[TimedFault, Random]]) -> None:
        super().__init__(player, faults)
        self._bursts: list[float] = [math.inf] * len(faults)

    def play(self, time: float) -> None:
        """Send noise if a burst is due, and draw when the next one comes."""
        for index, (fault, chance) in enumerate(self.faults):
            share, burst = fault.when.share(time), self._bursts[index]
            if share is None:
                self._bursts[index] = math.inf
                continue
            if burst <= time:
                data = chance.randbytes(round(fault.level("size", share)))
                self.player.link.inject_noise(data)
                self.player.tally.noise += len(data)
            if burst <= time or math.isinf(burst):
                self._bursts[index] = time + chance.expovariate(fault.level("rate", share))

    def next_change(self, time: float) -> float:
        """Return when a burst is due, or a fault begins or ends."""
        return min(*self._bursts, *(fault.when.next_change(time) for fault, _ in self.faults))


class Stall(HeldKind):
    """No byte passes either way; then all come at once."""

    needs_end = True

    def _begin(self) -> None:
        self.player.link.stall()
        self.player.tally.stalls += 1

    def _end(self) -> None:
        self.player.link.resume()


class Silence(HeldKind):
    """No answer comes back; the robot still receives."""

    def _begin(self) -> None:
        self.player.link.silence()
        self.player.tally.silences += 1

    def _end(self) -> None:
        self.player.link.end_silence()


class Cut(HeldKind):
    """The link dies, and cannot be opened again before the end."""

    def _begin(self) -> None:
        self.player.tally.cuts += 1
        self.player.link.take_down("script")

    def _end(self) -> None:
        self.player.link.bring_up("script")

    def mends_at(self, time: float) -> float:
        """Return when a link that is cut at *time* can be opened again: *time* if it is not; infinite if never."""
        cuts = [fault.when for fault, _ in self.faults]
        for _ in range(MAX_CHANGES):
            if all(cut.share(time) is None for cut in cuts):
                return time
            time = min(cut.next_change(time) for cut in cuts)
            if math.isinf(time):
                break
        return math.inf


class Reset(Kind):
    """The robot restarts: wheels, lamps, encoders and camera as when switched on."""

    is_instant = True

    def __init__(self, player: Player, faults: Sequence[tuple[TimedFault, Random]]) -> None:
        super().__init__(player, faults)
        self._last = [-1.0] * len(faults)

    def play(self, time: float) -> None:
        """Restart it, unless its battery is empty."""
        for index, (fault, _) in enumerate(self.faults):
            if fault.when.beginning(self._last[index]) <= time:
                self._last[index] = time
                self.player.tally.resets += 1
                if not self.player.is_dead:
                    self.player.link.power_cycle()

    def next_change(self, time: float) -> float:
        """Return when the next one is due."""
        return min(fault.when.beginning(last) for (fault, _), last in zip(self.faults, self._last, strict=True))


WEAK = 3.54
"""V below which answers come later: where the e-puck2 calls its battery low, 2900 counts (e-puck.md, 11)."""

WEAK_DELAY = 0.009
"""s: setting the motors took 34 ms on a weak battery, 25 ms on a charged one (wire-protocol.md, 5.13)."""

EMPTY = 3.3
"""V at which the robot dies. It is a guess, a little below the 3.4 V that the e-puck1's comparator calls low."""


class Battery(Kind):
    """The battery runs down; when weak, answers come later; when empty, the robot dies."""

    keys = (
        Strength(0, 5, "V", "volts", "its voltage", may_change=True),
        Strength(0, 5, "V", "empty", "where the robot dies", EMPTY),
        Strength(0, 10, "s", "slows", f"how much later answers come at the end; it begins at {WEAK} V", WEAK_DELAY),
    )
    needs_end = True
    may_repeat = False

    def __init__(self, player: Player, faults: Sequence[tuple[TimedFault, Random]]) -> None:
        super().__init__(player, faults)
        self._in_order = sorted((fault for fault, _ in faults), key=lambda fault: fault.when.start)
        self.is_dead = False
        # When it is empty, infinite if never.
        self.empty_at = min(map(_empty_at, self._in_order), default=math.inf)

    def volts(self, time: float) -> float | None:
        """Return the voltage, V, by the fault begun last; it stays at its end. None before the first."""
        fault = self._last_begun(time)
        if fault is None:
            return None
        share = fault.when.share(time)
        return fault.level("volts", 1.0 if share is None else share)

    def hit(self, time: float) -> Fault | None:
        """Delay the answer of a robot with a weak battery: more, the emptier it is."""
        fault, volts = self._last_begun(time), self.volts(time)
        if fault is None or volts is None or volts >= WEAK:
            return None
        slows, empty = fault.level("slows", 0.0), fault.level("empty", 0.0)
        return Fault(delay=slows * min(1.0, (WEAK - volts) / (WEAK - empty)) if empty < WEAK else slows)

    def play(self, time: float) -> None:
        """Switch the robot off when the battery is empty."""
        if self.empty_at <= time and not self.is_dead:
            self.is_dead = True
            link = self.player.link
            link.catch_up()
            link.robot.switch_off(link.now)
            link.catch_up()

    def next_change(self, time: float) -> float:
        """Return when the battery is empty."""
        return math.inf if self.is_dead else self.empty_at

    def _last_begun(self, time: float) -> TimedFault | None:
        return next((fault for fault in reversed(self._in_order) if fault.when.start <= time), None)


def _empty_at(fault: TimedFault) -> float:
    start = fault.when.start
    first, last, empty = fault.level("volts", 0.0), fault.level("volts", 1.0), fault.level("empty", 0.0)
    if first <= empty:
        return start
    if last > empty:
        return math.inf
    end = fault.when.next_change(start)
    return start + (end - start) * (first - empty) / (first - last)


def _reading(unit: str, whose: str) -> tuple[Strength, ...]:
    """Return the keys of what is read."""
    return (
        Strength(-1e5, 1e5, unit, "stuck", f"what {whose} is, whatever there is", math.nan),
        Strength(-1e5, 1e5, unit, "shift", f"what is added to {whose}", 0.0),
        Strength(0, 1e5, unit, "noise", "standard deviation of noise that is added", 0.0),
        Strength(0, 100, "", "factor", f"what is left of {whose}; 0 if it is dead", 1.0),
    )


class DefectKind(HeldKind):
    """A kind that breaks a part of the robot from its beginning to its end."""

    _broken: tuple[Defect, ...] = ()

    @property
    def blocks_robot(self) -> bool:
        """Whether no program can talk to the robot because of it."""
        return False

    @classmethod
    def check(cls, fault: TimedFault) -> None:
        """Refuse a fault with which everything works, and one of a number that the part does not have."""
        if not fault.strengths:
            raise ArgumentError("nothing is wrong", hint=f"write {' or '.join(key.name for key in cls.keys)}")
        cls.defect(fault)

    @classmethod
    def defect(cls, fault: TimedFault) -> Defect:
        """Return what is broken."""
        strengths = {key.name: fault.level(key.name, 0.0) for key in cls.keys}
        given: dict[str, Any] = {name: value for name, value in strengths.items() if not math.isnan(value)}
        wheel, numbers = fault.which.get("wheel"), fault.which.get("numbers", ())
        return Defect(
            fault.which.get("sensor", fault.kind), numbers if wheel is None else (WHEELS.index(wheel),), **given
        )

    def play(self, time: float) -> None:
        """Break and mend what is due."""
        broken = tuple(self.defect(fault) for fault, _ in self.faults if fault.when.share(time) is not None)
        if broken != self._broken:
            self._broken = broken
            self.player.tally.defects += 1
            self.player.break_parts(type(self).__name__, broken)


class SensorDefect(DefectKind):
    """A sensor reads something wrong: stuck, dead, shifted, weak or noisy, in the unit of its readings."""

    keys = _reading("", "the reading")
    names = (
        Key("sensor", Choice(SENSORS, example='"proximity"'), ("sensor",)),
        Key("numbers", Several(Whole(0, 7), 1, 8, example="[0, 7]", otherwise="all"), ("numbers",), ((),)),
    )


class WheelDefect(DefectKind):
    """A wheel rolls less than its motor turns it. The step counters do not notice."""

    keys = (Strength(*FACTORS["wheel"], "", "factor", "how much of its way it rolls; 0 if it is loose"),)
    names = (Key("wheel", Choice(WHEELS, example='"left"', otherwise="both"), ("wheel",), ((),)),)


class CameraDefect(DefectKind):
    """The camera's pictures are wrong: all of one colour, dark, bright or noisy."""

    keys = _reading("of 255", "each colour of each pixel")


class ClockDefect(DefectKind):
    """The robot's clock goes wrong: its motors turn, and its firmware works, so much faster or slower."""

    keys = (Strength(*FACTORS["clock"], "", "factor", "how fast it goes"),)


KINDS: Mapping[str, type[Kind]] = MappingProxyType(
    {
        "loss": Loss,
        "delay": Delay,
        "duplicate": Duplicate,
        "halve": Halve,
        "corrupt": Corrupt,
        "noise": Noise,
        "stall": Stall,
        "silence": Silence,
        "cut": Cut,
        "reset": Reset,
        "battery": Battery,
        "sensor": SensorDefect,
        "wheel": WheelDefect,
        "camera": CameraDefect,
        "clock": ClockDefect,
    }
)
"""Every kind of fault, by the name it has in a file."""
