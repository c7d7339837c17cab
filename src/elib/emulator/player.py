"""A fault script at work on one robot and its link."""

from __future__ import annotations

import asyncio
import dataclasses
import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain

from elib.emulator.battery import Discharge
from elib.emulator.faults import Fault
from elib.emulator.link import Link
from elib.emulator.weather import FaultScript, TimedFault
from elib.timebase import SimulatedLoop

HOPELESS = 3
"""Answers in a row that were lost, harmed or a second late after which a program may well give the robot up: as many
questions as a resync asks."""

PATIENCE = 3600.0
"""Seconds for which a script goes on by itself in simulated time while no program sends anything. Without a bound a
program that waits for nothing would wait for ever, where it should hear that its simulation stalled."""

OVERLAPS = 1000
"""Beginnings and ends of cuts in a row after which a link counts as dead for good."""


@dataclass(frozen=True, slots=True)
class Counts:
    """What a script has done so far.

    Attributes:
        answers: Answers that met it, harmed or not.
        lost: Of them those that were lost whole.
        halved: Those of which only half came.
        corrupted: Those in which a byte was changed.
        duplicated: Those that came twice.
        delayed: Those that came later.
        noise: Bytes that nobody sent.
        stalls: Times the link stood still.
        silences: Times the robot went silent.
        cuts: Times the link died.
        resets: Times the robot restarted.
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


class DeadRobot:
    """What is left of a robot without power: it takes everything and says nothing."""

    due: float | None = None
    is_idle = True

    def receive(self, data: bytes, time: float) -> None:
        """Take bytes for nothing."""

    def advance(self, time: float) -> tuple[()]:
        """Do nothing, and return that."""
        return ()

    def power_cycle(self, time: float) -> None:
        """Do nothing: an empty battery restarts nobody."""


class FaultPlayer:
    """Lets a script happen to *link* and its robot, on the running event loop.

    The script begins with the first byte that reaches the link from a program. The same script, seed and bytes give
    the same faults: every fault of the script draws from a generator of its own.

    Args:
        link: What the robot hangs on; the player makes itself its weather.
        script: What is to happen.
        robot: Which robot of its world this is; each has a fate of its own.
        seed: Instead of the script's.

    Attributes:
        script: What is played.
        on_cut: Called when the script cuts the link, before the program's end is lost.
        on_mend: Called when the link could be opened again.
        is_cut: Whether the link is dead now, and refuses to be opened.
        is_dead: Whether the battery was empty.
    """

    def __init__(self, link: Link, script: FaultScript, *, robot: int = 0, seed: int | None = None) -> None:
        self.script = script
        self.on_cut: Callable[[], None] | None = None
        self.on_mend: Callable[[], None] | None = None
        self.is_cut = self.is_dead = False
        self._link = link
        self._loop = asyncio.get_running_loop()
        self._began: float | None = None
        self._heard = 0.0
        self._is_resting = False
        self._timer: asyncio.TimerHandle | None = None
        self._counts = dict.fromkeys((field.name for field in dataclasses.fields(Counts)), 0)
        base = script.seed if seed is None else seed
        self._chances = {
            index: random.Random(f"{base} robot {robot} fault {index}") for index in range(len(script.faults))
        }
        self._befalling = self._of("loss", "delay", "duplicate", "halve", "corrupt")
        self._battery = Discharge([fault for _, fault in self._of("battery")])
        self._resets = {index: -1.0 for index, _ in self._of("reset")}
        self._bursts: dict[int, float | None] = {index: None for index, _ in self._of("noise")}
        self._harmed_in_a_row = 0
        self._held = dict.fromkeys(("cut", "stall", "silence"), False)
        link.weather = self

    @property
    def time(self) -> float:
        """Time since the script began, s; 0 before."""
        return 0.0 if self._began is None else self._link.now - self._began

    @property
    def counts(self) -> Counts:
        """What was done so far."""
        return Counts(**self._counts)

    def read_volts(self) -> float | None:
        """Return the battery's voltage now, V; None while the script leaves it alone."""
        return None if self._began is None else self._battery.volts(self.time)

    @property
    def cuts(self) -> bool:
        """Whether the script cuts the link at any time."""
        return bool(self._of("cut"))

    @property
    def mends_in(self) -> float:
        """Seconds until a link that is cut can be opened again: 0 if it can, infinite if it never will."""
        cuts = [fault.when for _, fault in self._of("cut")]
        time = self.time
        for _ in range(OVERLAPS):
            if all(cut.share(time) is None for cut in cuts):
                return time - self.time
            time = min(cut.next_change(time) for cut in cuts)
            if math.isinf(time):
                break
        return math.inf

    @property
    def is_reachable(self) -> bool:
        """Whether the script lets a program talk to the robot at the moment, be it with a loss now and then."""
        return not self.is_dead and not any(self._held.values()) and self._harmed_in_a_row < HOPELESS

    def begin(self) -> None:
        """Begin, if the script has not begun; go on, if it rests."""
        if self._began is None:
            self._began = self._link.now
        elif not self._is_resting:
            self._heard = self.time
            return
        self._heard = self.time
        self._play(self._heard)

    def close(self) -> None:
        """Let nothing happen any more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._link.weather = None

    def fate(self, time: float) -> Fault | None:
        """Return what befalls an answer that leaves the robot at *time*, s since the link's origin."""
        if self._began is None:
            return None
        time -= self._began
        self._counts["answers"] += 1
        lose = halve = corrupt = False
        copy_after: float | None = None
        delay = self._battery.slowness(time)
        for index, fault in self._befalling:
            share = fault.when.share(time)
            if share is None or self._chances[index].random() >= fault.level("probability", share):
                continue
            match fault.kind:
                case "loss":
                    lose = True
                case "halve":
                    halve = True
                case "corrupt":
                    corrupt = True
                case "duplicate":
                    copy_after = fault.level("after", share)
                case _:
                    jitter = self._chances[index].gauss(0.0, 1.0) * fault.level("jitter", share)
                    delay += max(0.0, fault.level("delay", share) + jitter)
        self._harmed_in_a_row = self._harmed_in_a_row + 1 if lose or halve or corrupt or delay >= 1 else 0
        if lose:  # of a lost answer nothing is left that could be harmed
            self._counts["lost"] += 1
            return Fault(lose=True)
        for name, came in (
            ("halved", halve),
            ("corrupted", corrupt),
            ("duplicated", copy_after is not None),
            ("delayed", delay > 0),
        ):
            self._counts[name] += came
        if not (halve or corrupt or copy_after is not None or delay):
            return None
        return Fault(halve=halve, corrupt="random" if corrupt else None, copy_after=copy_after, delay=delay)

    # -- what happens by itself --

    def _play(self, time: float) -> None:
        """Do what is due at *time*, s since the beginning, and wake up for the next."""
        for kind in self._held:
            self._hold(kind, any(fault.when.share(time) is not None for _, fault in self._of(kind)))
        if self._battery.empty_at <= time and not self.is_dead:
            self._die()
        for index, last in self._resets.items():
            instant = self.script.faults[index].when.beginning(last)
            if instant <= time:
                self._resets[index] = time
                self._restart()
        for index in self._bursts:
            self._crackle(index, time)
        self._arm(time)

    def _arm(self, time: float) -> None:
        spans = (fault.when.next_change(time) for _, fault in self._of("cut", "stall", "silence", "noise"))
        resets = (self.script.faults[index].when.beginning(last) for index, last in self._resets.items())
        bursts = (burst for burst in self._bursts.values() if burst is not None)
        due = min(chain(spans, resets, bursts), default=math.inf)
        if not self.is_dead:
            due = min(due, self._battery.empty_at)
        self._is_resting = due > self._heard + PATIENCE and isinstance(self._loop, SimulatedLoop)
        if math.isfinite(due) and not self._is_resting:
            assert self._began is not None
            origin = self._loop.time() - self._link.now + self._began
            self._timer = self._loop.call_at(origin + due, self._ring, due)

    def _ring(self, due: float) -> None:
        self._play(max(due, self.time))  # the sum of origin and due may have been rounded down

    def _hold(self, kind: str, is_held: bool) -> None:
        if is_held == self._held[kind]:
            return
        self._held[kind] = is_held
        link = self._link
        match kind, is_held:
            case "stall", True:
                link.stall()
                self._counts["stalls"] += 1
            case "stall", False:
                link.resume()
            case "silence", True:
                link.silence()
                self._counts["silences"] += 1
            case "silence", False:
                link.speak()
            case _, True:
                self.is_cut = True
                self._counts["cuts"] += 1
                if self.on_cut is not None:
                    self.on_cut()
                link.cut()
            case _:
                self.is_cut = False
                if self.on_mend is not None:
                    self.on_mend()

    def _restart(self) -> None:
        link = self._link
        link.catch_up()
        link.robot.power_cycle(link.now)
        link.catch_up()
        self._counts["resets"] += 1

    def _die(self) -> None:
        self.is_dead = True
        link = self._link
        link.catch_up()
        link.robot.power_cycle(link.now)  # wheels and lamps go off with the power
        link.robot = DeadRobot()
        link.catch_up()

    def _crackle(self, index: int, time: float) -> None:
        """Let noise through if a burst is due, and draw when the next one comes."""
        fault, chance = self.script.faults[index], self._chances[index]
        share = fault.when.share(time)
        if share is None:
            self._bursts[index] = None
            return
        burst = self._bursts[index]
        if burst is not None and burst <= time:
            data = chance.randbytes(round(fault.level("size", share)))
            self._link.say(data)
            self._counts["noise"] += len(data)
        if burst is None or burst <= time:
            self._bursts[index] = time + chance.expovariate(fault.level("rate", share))

    def _of(self, *kinds: str) -> list[tuple[int, TimedFault]]:
        return [(index, fault) for index, fault in enumerate(self.script.faults) if fault.kind in kinds]
