"""Run a fault script on one robot and its link."""

from __future__ import annotations

import asyncio
import dataclasses
import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

from elib.base.timebase import SimulatedLoop
from elib.simulator.emulator.faults import Fault
from elib.simulator.emulator.faultscript import WEAK, FaultScript, TimedFault
from elib.simulator.emulator.link import Link

MOST_FAULTS_IN_A_ROW = 3
"""Answers in a row that were lost, damaged or a second late, after which a program may give the robot up: as many
questions as a resync asks."""

IDLE_LIMIT = 3600.0
"""Seconds for which a script goes on by itself in simulated time while no program sends anything. Without a limit a
program that waits for nothing would wait for ever instead of getting a SimulationStalled."""

MOST_CHANGES = 1000
"""Beginnings and ends of cuts in a row after which a link counts as dead for good."""


@dataclass(frozen=True, slots=True)
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


class Discharge:
    """The voltage of a battery under the battery faults of a script. Times are s since the script began.

    Args:
        faults: Faults of the kind ``battery``.
    """

    def __init__(self, faults: Sequence[TimedFault]) -> None:
        self._faults = sorted(faults, key=lambda fault: fault.when.start)
        self.empty_at = min(map(_empty_at, self._faults), default=math.inf)
        """When the robot dies; infinite if it does not."""

    def volts(self, time: float) -> float | None:
        """Return the voltage, V, by the fault begun last; it stays at its end. None before the first."""
        fault = self._last_begun(time)
        if fault is None:
            return None
        share = fault.when.share(time)
        return fault.level("volts", 1.0 if share is None else share)

    def slowness(self, time: float) -> float:
        """Return how much later answers come, s: 0 at 3.54 V, rising to what the fault says for an empty battery."""
        fault, volts = self._last_begun(time), self.volts(time)
        if fault is None or volts is None or volts >= WEAK:
            return 0.0
        slows, empty = fault.level("slows", 0.0), fault.level("empty", 0.0)
        return slows * min(1.0, (WEAK - volts) / (WEAK - empty)) if empty < WEAK else slows

    def _last_begun(self, time: float) -> TimedFault | None:
        return next((fault for fault in reversed(self._faults) if fault.when.start <= time), None)


def _empty_at(fault: TimedFault) -> float:
    start = fault.when.start
    first, last, empty = fault.level("volts", 0.0), fault.level("volts", 1.0), fault.level("empty", 0.0)
    if first <= empty:
        return start
    if last > empty:
        return math.inf
    end = fault.when.next_change(start)
    return start + (end - start) * (first - empty) / (first - last)


class FaultPlayer:
    """Runs a script on *link* and its robot, on the running event loop; an ``Impairment``.

    The script begins with the first byte that reaches the link from a program. The same script, seed and bytes give
    the same faults: every fault of the script has a random generator of its own.

    Args:
        link: The robot's link; the player adds itself to its impairments.
        script: What happens, and when.
        robot: Which robot of its world this is; each draws its own random numbers.
        seed: Instead of the script's.

    Attributes:
        script: The script.
        is_dead: Whether the battery was empty.
    """

    def __init__(self, link: Link, script: FaultScript, *, robot: int = 0, seed: int | None = None) -> None:
        self.script = script
        self.is_dead = False
        self._link = link
        self._loop = asyncio.get_running_loop()
        self._began: float | None = None
        self._heard = 0.0
        self._is_paused = False
        self._timer: asyncio.TimerHandle | None = None
        self._counts = dict.fromkeys((field.name for field in dataclasses.fields(Counts)), 0)
        base = script.seed if seed is None else seed
        self._chances = {
            index: random.Random(f"{base} robot {robot} fault {index}") for index in range(len(script.faults))
        }
        self._answer_faults = self._of("loss", "delay", "duplicate", "halve", "corrupt")
        self._battery = Discharge([fault for _, fault in self._of("battery")])
        self._resets = {index: -1.0 for index, _ in self._of("reset")}
        self._bursts: dict[int, float | None] = {index: None for index, _ in self._of("noise")}
        self._faults_in_a_row = 0
        self._held = dict.fromkeys(("cut", "stall", "silence"), False)
        link.impairments.append(self)

    @property
    def time(self) -> float:
        """Time since the script began, s; 0 before."""
        return 0.0 if self._began is None else self._link.now - self._began

    @property
    def counts(self) -> Counts:
        """What the script has done so far."""
        return Counts(**self._counts)

    def read_volts(self) -> float | None:
        """Return the battery's voltage now, V; None while the script does not set it."""
        return None if self._began is None else self._battery.volts(self.time)

    @property
    def active(self) -> tuple[str, ...]:
        """Kinds of the faults that hold now, in the order of the script."""
        if self._began is None:
            return ()
        time = self.time
        return tuple(dict.fromkeys(each.kind for each in self.script.faults if each.when.share(time) is not None))

    @property
    def is_cut(self) -> bool:
        """Whether the script keeps the link down now."""
        return self._held["cut"]

    @property
    def cuts(self) -> bool:
        """Whether the script cuts the link at any time."""
        return bool(self._of("cut"))

    @property
    def mends_in(self) -> float:
        """Seconds until a link that is cut can be opened again: 0 if it can be now, infinite if it never can."""
        cuts = [fault.when for _, fault in self._of("cut")]
        time = self.time
        for _ in range(MOST_CHANGES):
            if all(cut.share(time) is None for cut in cuts):
                return time - self.time
            time = min(cut.next_change(time) for cut in cuts)
            if math.isinf(time):
                break
        return math.inf

    @property
    def is_reachable(self) -> bool:
        """Whether a program can talk to the robot at the moment, even if an answer is lost now and then."""
        return not self.is_dead and not any(self._held.values()) and self._faults_in_a_row < MOST_FAULTS_IN_A_ROW

    def begin(self) -> None:
        """Begin, if the script has not begun; go on, if it paused because no program sent anything."""
        if self._began is None:
            self._began = self._link.now
        elif not self._is_paused:
            self._heard = self.time
            return
        self._heard = self.time
        self._play(self._heard)

    def close(self) -> None:
        """End the script."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self in self._link.impairments:
            self._link.impairments.remove(self)

    def fault_at(self, time: float) -> Fault | None:
        """Return what goes wrong with an answer that leaves the robot at *time*, s since the link's origin."""
        if self._began is None:
            return None
        time -= self._began
        self._counts["answers"] += 1
        lose = halve = corrupt = False
        copy_after: float | None = None
        delay = self._battery.slowness(time)
        for index, timed in self._answer_faults:
            share = timed.when.share(time)
            if share is None or self._chances[index].random() >= timed.level("probability", share):
                continue
            match timed.kind:
                case "loss":
                    lose = True
                case "halve":
                    halve = True
                case "corrupt":
                    corrupt = True
                case "duplicate":
                    copy_after = timed.level("after", share)
                case _:
                    jitter = self._chances[index].gauss(0.0, 1.0) * timed.level("jitter", share)
                    delay += max(0.0, timed.level("delay", share) + jitter)
        self._faults_in_a_row = self._faults_in_a_row + 1 if lose or halve or corrupt or delay >= 1 else 0
        if lose:  # nothing is left of it that could have another fault
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
        """Do what is due at *time*, s since the beginning, and set a timer for what comes next."""
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
            self._make_noise(index, time)
        self._arm(time)

    def _arm(self, time: float) -> None:
        spans = (fault.when.next_change(time) for _, fault in self._of("cut", "stall", "silence", "noise"))
        resets = (self.script.faults[index].when.beginning(last) for index, last in self._resets.items())
        bursts = (burst for burst in self._bursts.values() if burst is not None)
        due = min(chain(spans, resets, bursts), default=math.inf)
        if not self.is_dead:
            due = min(due, self._battery.empty_at)
        self._is_paused = due > self._heard + IDLE_LIMIT and isinstance(self._loop, SimulatedLoop)
        if math.isfinite(due) and not self._is_paused:
            assert self._began is not None
            at = self._link.loop_time(self._began + due)
            if math.isfinite(at):
                self._timer = self._loop.call_at(at, self._on_timer, due)

    def rearm(self) -> None:
        """Set the timer again, after the clock was changed."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._began is not None and not self._is_paused:
            self._play(self.time)

    def _on_timer(self, due: float) -> None:
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
                link.end_silence()
            case _, True:
                self._counts["cuts"] += 1
                link.take_down("script")
            case _:
                link.bring_up("script")

    def _restart(self) -> None:
        if not self.is_dead:  # an empty battery starts no robot
            self._link.power_cycle()
        self._counts["resets"] += 1

    def _die(self) -> None:
        self.is_dead = True
        link = self._link
        link.catch_up()
        link.robot.switch_off(link.now)
        link.catch_up()

    def _make_noise(self, index: int, time: float) -> None:
        """Send noise if a burst is due, and draw when the next one comes."""
        fault, chance = self.script.faults[index], self._chances[index]
        share = fault.when.share(time)
        if share is None:
            self._bursts[index] = None
            return
        burst = self._bursts[index]
        if burst is not None and burst <= time:
            data = chance.randbytes(round(fault.level("size", share)))
            self._link.inject_noise(data)
            self._counts["noise"] += len(data)
        if burst is None or burst <= time:
            self._bursts[index] = time + chance.expovariate(fault.level("rate", share))

    def _of(self, *kinds: str) -> list[tuple[int, TimedFault]]:
        return [(index, fault) for index, fault in enumerate(self.script.faults) if fault.kind in kinds]
