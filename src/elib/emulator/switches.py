"""What the control door switches at a robot's link: whether it is there, and how bad it is."""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

from elib.emulator.faults import Fault
from elib.emulator.roles import Weather

if TYPE_CHECKING:
    from elib.emulator.virtual import VirtualRobot


class Line(Protocol):
    """A robot's way to its programs, as far as it can be cut and mended."""

    @property
    def is_cut(self) -> bool:
        """Whether nobody can reach the robot."""
        ...

    def cut(self) -> None:
        """Part the robot from its program and let no other come."""
        ...

    def mend(self) -> None:
        """Let programs come again."""
        ...


@dataclass(frozen=True, slots=True)
class LinkState:
    """How a robot is connected.

    Attributes:
        is_connected: It has somebody to talk to: a port that can be opened, or a program.
        is_cut: Nobody can reach it.
        latency: By how much the door delays its answers, s.
        jitter: Standard deviation of that, s.
        loss: Probability with which the door loses an answer.
    """

    is_connected: bool
    is_cut: bool
    latency: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0


class Trouble:
    """What the door does to a robot's answers, as their :class:`~elib.emulator.roles.Weather`.

    Args:
        below: The weather that was there before; it goes on beneath.
        chance: Draws the losses and the jitter.

    Attributes:
        latency: By how much answers come later, s.
        jitter: Standard deviation of that, s.
        loss: Probability that a whole answer is lost.
    """

    def __init__(self, below: Weather | None, chance: random.Random) -> None:
        self.latency = self.jitter = self.loss = 0.0
        self._below = below
        self._chance = chance

    def begin(self) -> None:
        """Let the weather beneath begin."""
        if self._below is not None:
            self._below.begin()

    def fate(self, time: float) -> Fault | None:
        """Return what befalls an answer that leaves the robot at *time*, s since the link's origin."""
        fault = None if self._below is None else self._below.fate(time)
        if self.loss and self._chance.random() < self.loss:
            return Fault(lose=True)
        delay = self.latency
        if self.jitter:
            delay = max(0.0, self._chance.gauss(delay, self.jitter))
        if not delay:
            return fault
        return Fault(delay=delay) if fault is None else replace(fault, delay=fault.delay + delay)


CALM = Trouble(None, random.Random(0))
"""Nothing at all."""


class BareLine:
    """The way to a robot inside one process.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: VirtualRobot) -> None:
        self._robot = robot

    @property
    def is_cut(self) -> bool:
        """Whether no program can open the robot."""
        return self._robot.is_cut

    def cut(self) -> None:
        """Part the robot from its program and let none open it."""
        self._robot.is_cut = True
        self._robot.link.cut()

    def mend(self) -> None:
        """Let a program open the robot again."""
        self._robot.is_cut = False
