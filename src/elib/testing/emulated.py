"""An emulated robot on its own: freshly switched on, with fixed readings, in simulated time."""

from __future__ import annotations

from collections.abc import Mapping

from elib.base.errors import SimulationStalled
from elib.simulator.emulator.emulator import Emulator
from elib.simulator.emulator.firmware import WIFI_FIRMWARES
from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.timing import LINE_ONLY, Timing
from elib.simulator.emulator.wifi import NETWORK_START, WifiEmulator

LISTENS = NETWORK_START + 1.0
"""Simulated s after which a robot with Wi-Fi has joined its network and waits for a client."""

LIMIT = 600.0
"""Longest exchange, simulated s; the longest possible answer, 64 KiB, takes 5.7 s on the line."""


class EmulatedRobot:
    r"""An emulated robot that was just switched on and answers at the pace of its serial line, without real time.

    Everything but the line is instant. Motors move only by :meth:`tick`, unless the state says
    ``motor_time="running"``.

    ::

        robot = EmulatedRobot("btcom-2.0", {"selector": 7})
        assert robot.send(b"C\r") == b"c,7\r\n"

    With the firmware ``epuck2-wifi`` the bytes are those of a TCP connection, which exists from the start. That robot
    streams packets, and is never idle: let time pass with :meth:`run`. ::

        robot = EmulatedRobot("epuck2-wifi")
        robot.send(bytes([0x80, 2, *[0] * 19]))
        assert robot.run(0.1)[:1] == b"\x02"

    Args:
        firmware: Name of a firmware's profile, such as ``btcom-2.0``.
        state: The hardware, as in the ``state`` objects of the golden transcripts; missing keys have defaults.

    Attributes:
        boot: What it sent when it was switched on.

    Raises:
        ArgumentError: There is no such firmware, or the state holds an unknown key or a value not allowed.
    """

    def __init__(self, firmware: str, state: Mapping[str, object] | None = None) -> None:
        self._hardware = FixedHardware(state, firmware=firmware)
        timing = Timing(runs=True) if self._hardware.motor_time == "running" else LINE_ONLY
        self._emulator: Emulator
        self._now = 0.0
        if firmware in WIFI_FIRMWARES:
            self._emulator = robot = WifiEmulator(firmware, self._hardware, timing=timing)
            self.boot = self.run(LISTENS)
            robot.connect(self._now)
        else:
            self._emulator = Emulator(firmware, self._hardware, timing=timing)
            self.boot = self._run()

    @property
    def time(self) -> float:
        """Simulated time since the robot was switched on, s."""
        return self._now

    @property
    def hardware(self) -> dict[str, object]:
        """Lamps, motors and sound, with the keys of ``hw`` in the golden transcripts; ``sound`` is 1..5, or 0."""
        return self._emulator.firmware.report()

    def send(self, data: bytes) -> bytes:
        """Send *data* and return everything the robot sends until it is idle again.

        The rest of an incomplete command may follow in the next call. A robot with Wi-Fi gets the data, and sends
        nothing before :meth:`run`.

        Raises:
            SimulationStalled: The robot was not idle after 600 simulated seconds.
        """
        self._emulator.receive(data, self._now)
        return b"" if isinstance(self._emulator, WifiEmulator) else self._run()

    def run(self, seconds: float) -> bytes:
        """Let simulated time pass and return what the robot sends meanwhile."""
        end, received = self._now + seconds, bytearray()
        while (due := self._emulator.due) is not None and due <= end:
            received += self._advance(due)
        return bytes(received + self._advance(end))

    def set(self, **state: object) -> None:
        """Change the hardware from outside, such as a proximity reading or the code of the remote control.

        Raises:
            ArgumentError: A key is unknown or a value not allowed; nothing was changed.
        """
        self._hardware.set(**state)
        self._emulator.advance(self._now)

    def tick(self, count: int) -> None:
        """Let the motors run for *count* ticks of 0.1 ms."""
        self._emulator.tick(count)

    def _run(self) -> bytes:
        start, received = self._now, bytearray()
        while not self._emulator.is_idle:
            due = self._emulator.due
            if due is None or due > start + LIMIT:
                raise SimulationStalled(
                    f"the robot was not idle after {LIMIT:g} s; it had sent {len(received)} bytes",
                    hint="this is a defect of the emulator; please report the bytes you sent",
                )
            received += self._advance(due)
        self._emulator.advance(self._now)
        return bytes(received)

    def _advance(self, time: float) -> bytes:
        self._now = max(self._now, time)
        data = b"".join(chunk.data for chunk in self._emulator.advance(self._now))
        if data and isinstance(self._emulator, WifiEmulator):
            self._emulator.acknowledge(len(data), self._now)
        return data
