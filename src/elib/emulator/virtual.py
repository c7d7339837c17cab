"""A virtual robot as programs meet it: its body, the firmware on it, the link to it, and the weather on that."""

from __future__ import annotations

import asyncio
import math
from dataclasses import dataclass

from elib.emulator.emulator import Emulator
from elib.emulator.hardware import Hardware
from elib.emulator.link import Link
from elib.emulator.player import FaultPlayer
from elib.emulator.simulated import SimulatedHardware
from elib.emulator.switches import Trouble
from elib.emulator.weatherfile import load
from elib.errors import LinkNotFound
from elib.timebase import SimulatedLoop
from elib.transport.simulation import SimulationSettings

INSTANT = 1e-6
"""Least delay of an unpaced link in simulated time, s.

Without it a program that only asks would ask for ever at the same instant.
"""


@dataclass(slots=True, eq=False)
class VirtualRobot:
    """One robot of a simulation that programs can talk to.

    Attributes:
        index: Its place in the world, from 0.
        settings: What it was built from.
        firmware: Which one it runs.
        hardware: Its body.
        emulator: Its program, booted.
        link: Its link.
        player: The fault script at work on the link, if there is one.
        trouble: What the control door does to the link, on top of the script; None before it does anything.
        is_cut: The control door has cut the link: no program inside this process can open it.
    """

    index: int
    settings: SimulationSettings
    firmware: str
    hardware: Hardware
    emulator: Emulator
    link: Link
    player: FaultPlayer | None = None
    trouble: Trouble | None = None
    is_cut: bool = False

    @property
    def mends_in(self) -> float:
        """Seconds until its link can be opened: 0 if it can, infinite if nobody knows or it never can."""
        if self.is_cut:
            return math.inf
        return 0.0 if self.player is None else self.player.mends_in

    @property
    def is_reachable(self) -> bool:
        """Whether its fault script lets a program talk to it at the moment."""
        return self.player is None or self.player.is_reachable

    def check_link(self, url: str) -> None:
        """Raise LinkNotFound if its fault script or the control door has cut the link that *url* asks for."""
        if self.is_cut:
            raise LinkNotFound(
                f"{url}: the robot is there, but its link was cut by hand", hint="mend it where it was cut"
            )
        mends_in = self.mends_in
        if mends_in > 0:
            until = f"for another {mends_in:.3g} s" if math.isfinite(mends_in) else "for good"
            raise LinkNotFound(
                f"{url}: the robot is there, but its fault script has cut the link {until}", hint="try again later"
            )

    def close(self) -> None:
        """Stop its script; the end of its link is closed."""
        if self.player is not None:
            self.player.close()
        self.link.close()


def switch_on(index: int, hardware: Hardware, firmware: str, settings: SimulationSettings) -> VirtualRobot:
    """Return a robot that is booted; its time begins now, on the running event loop.

    Args:
        index: Its place in the world, from 0.
        hardware: Its body.
        firmware: Which one it runs.
        settings: Its link and its fault script.

    Raises:
        ArgumentError: There is no such fault script.
        SimulationError: The fault script breaks a rule.
    """
    script = None if settings.fault is None else load(settings.fault)
    emulator = Emulator(firmware, hardware, baud=settings.baud, booted=True)
    latency = settings.latency
    if settings.baud == 0 and isinstance(asyncio.get_running_loop(), SimulatedLoop):
        latency = max(latency, INSTANT)
    link = Link(
        emulator,
        latency=latency,
        jitter=settings.jitter,
        loss=settings.loss,
        seed=(settings.seed or 0) + index,
        baud=settings.baud,
    )
    robot = VirtualRobot(index, settings, firmware, hardware, emulator, link)
    if script is not None:
        robot.player = FaultPlayer(link, script, robot=index, seed=settings.seed)
        if isinstance(hardware, SimulatedHardware):
            hardware.volts = robot.player.read_volts
    return robot
