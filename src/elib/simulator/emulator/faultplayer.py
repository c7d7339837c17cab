"""Run a fault script on one robot and its link."""

from __future__ import annotations

import asyncio
import dataclasses
import math
import random
from collections.abc import Callable, Sequence

from elib.base.timebase import SimulatedLoop
from elib.simulator.emulator.faultkinds import KINDS, Battery, Counts, Cut, TimedFault
from elib.simulator.emulator.faults import Fault, both
from elib.simulator.emulator.faultscript import FaultScript
from elib.simulator.emulator.link import Link
from elib.simulator.physics.defects import Defect

MAX_FAULTS_IN_A_ROW = 3
"""Answers in a row that were lost, damaged or a second late, after which a program may give the robot up: as many
questions as a resync asks."""

IDLE_LIMIT = 3600.0
"""Seconds for which a script goes on by itself in simulated time while no program sends anything. Without a limit a
program that waits for nothing would wait for ever instead of getting a SimulationStalled."""


class FaultPlayer:
    """Runs a script on *link* and its robot, on the running event loop; an ``Impairment``.

    The script begins with the first byte that reaches the link from a program. The same script, seed and bytes give
    the same faults: every fault of the script has a random generator of its own.

    Args:
        link: The robot's link; the player adds itself to its impairments.
        script: What happens, and when.
        robot: Which robot of its world this is; each draws its own random numbers.
        seed: Instead of the script's.
    """

    def __init__(self, link: Link, script: FaultScript, *, robot: int = 0, seed: int | None = None) -> None:
        self.script = script
        self.link = link
        self.tally = Counts()  # numbers of what the script has done so far
        self._loop = asyncio.get_running_loop()
        self._began: float | None = None
        self._heard = 0.0
        self._is_paused = False
        self._timer: asyncio.TimerHandle | None = None
        base = script.seed if seed is None else seed
        faults: dict[str, list[tuple[TimedFault, random.Random]]] = {}
        self.break_parts: Callable[[str, Sequence[Defect]], object] = lambda by, defects: None
        self._own = [(index, fault) for index, fault in enumerate(script.faults) if fault.hits(robot)]
        for index, fault in self._own:
            chance = random.Random(f"{base} robot {robot} fault {index}")
            faults.setdefault(fault.kind, []).append((fault, chance))
        self._kinds = {name: KINDS[name](self, each) for name, each in faults.items()}
        self._cut, self._battery = self._kinds.get("cut"), self._kinds.get("battery")
        self._faults_in_a_row = 0
        link.impairments.append(self)

    @property
    def time(self) -> float:
        """Time since the script began, s; 0 before."""
        return 0.0 if self._began is None else self.link.now - self._began

    @property
    def counts(self) -> Counts:
        """What the script has done so far."""
        return dataclasses.replace(self.tally)

    @property
    def is_dead(self) -> bool:
        """Whether the battery was empty."""
        return isinstance(self._battery, Battery) and self._battery.is_dead

    def read_volts(self) -> float | None:
        """Return the battery's voltage now, V; None while the script does not set it."""
        if self._began is None or not isinstance(self._battery, Battery):
            return None
        return self._battery.volts(self.time)

    @property
    def active(self) -> tuple[str, ...]:
        """Kinds of the faults that hold now, in the order of the script."""
        if self._began is None:
            return ()
        time = self.time
        return tuple(dict.fromkeys(each.kind for _, each in self._own if each.when.share(time) is not None))

    @property
    def is_cut(self) -> bool:
        """Whether the script keeps the link down now."""
        return self._cut is not None and self._cut.blocks_robot

    @property
    def cuts(self) -> bool:
        """Whether the script cuts the link at any time."""
        return self._cut is not None

    @property
    def mends_in(self) -> float:
        """Seconds until a link that is cut can be opened again: 0 if it can be now, infinite if it never can."""
        return self._cut.mends_at(self.time) - self.time if isinstance(self._cut, Cut) else 0.0

    @property
    def is_reachable(self) -> bool:
        """Whether a program can talk to the robot at the moment, even if an answer is lost now and then."""
        blocks_robot = any(kind.blocks_robot for kind in self._kinds.values())
        return not self.is_dead and not blocks_robot and self._faults_in_a_row < MAX_FAULTS_IN_A_ROW

    def begin(self) -> None:
        """Begin, if the script has not begun; go on, if it paused because no program sent anything."""
        if self._began is None:
            self._began = self.link.now
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
        if self in self.link.impairments:
            self.link.impairments.remove(self)

    def fault_at(self, time: float) -> Fault | None:
        """Return what goes wrong with an answer that leaves the robot at *time*, s since the link's origin."""
        if self._began is None:
            return None
        fate = Fault()
        for kind in self._kinds.values():
            if (more := kind.hit(time - self._began)) is not None:
                fate = both(fate, more)
        is_corrupt = fate.corrupt is not None
        is_bad = fate.lose or fate.halve or is_corrupt or fate.delay >= 1
        self._faults_in_a_row = self._faults_in_a_row + 1 if is_bad else 0
        self.tally.answers += 1
        self.tally.lost += fate.lose
        self.tally.halved += fate.halve
        self.tally.corrupted += is_corrupt
        self.tally.duplicated += fate.copy_after is not None
        self.tally.delayed += fate.delay > 0
        return None if fate == Fault() else fate

    # -- what happens by itself --

    def _play(self, time: float) -> None:
        """Do what is due at *time*, s since the beginning, and set a timer for what comes next."""
        for kind in self._kinds.values():
            kind.play(time)
        due = min((kind.next_change(time) for kind in self._kinds.values()), default=math.inf)
        self._is_paused = due > self._heard + IDLE_LIMIT and isinstance(self._loop, SimulatedLoop)
        if math.isfinite(due) and not self._is_paused:
            assert self._began is not None
            at = self.link.loop_time(self._began + due)
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
