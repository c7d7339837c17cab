"""The emulator of one robot: bytes go in at given times, and come out at the times a real robot would have sent them.

Nothing here waits or reads a clock. The caller gives all times, as floats in seconds since an origin of its own. It
hands in bytes with :meth:`Emulator.receive`, and calls :meth:`Emulator.advance` when :attr:`Emulator.due` has come.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import inf

from elib.link.protocol.profiles import FIRMWARES
from elib.link.protocol.robot_connection import Event, Opcode, RobotConnection, TextLine
from elib.simulator.emulator.firmware import firmware_named
from elib.simulator.emulator.firmware.base import Firmware
from elib.simulator.emulator.firmware.bootloader import ProgramMemory
from elib.simulator.emulator.firmware.steps import Busy, Deaf, FirmwareStep, FirmwareSteps, Hang, Listen, Restart, Send
from elib.simulator.emulator.hardware import Hardware
from elib.simulator.emulator.serial_line import IncomingLine, ReceiveQueue, ReceiveRing
from elib.simulator.emulator.timing import DEFAULT_BAUD, Timing

CHUNK = 64
"""Largest piece of an answer handed out at once, bytes."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes that left the robot."""

    time: float  # when the last of them left the wire, s
    data: bytes  # the bytes
    answer: int  # running number, from 1, of the command or binary frame that they answer; 0 if they answer none


class Emulator:
    """A virtual robot's firmware at one end of a serial line.

    Unless *booted* is true, the robot is switched on at time 0; :meth:`power_cycle` switches it off and on at any other
    time. An e-puck1 takes a program that is uploaded to its bootloader, keeps it in :attr:`memory`, and goes on with
    the firmware that it had.

    Args:
        firmware: Name of a firmware's profile, such as ``btcom-2.0``.
        hardware: The hardware that the firmware runs on. The emulator advances it before each access.
        baud: Bits a second each way; 0 for a line that takes no time.
        timing: How long things take; None for the firmware's own durations.
        booted: Whether the robot is on already: no start-up, no banner.

    Raises:
        ArgumentError: There is no such firmware.
    """

    def __init__(
        self,
        firmware: str,
        hardware: Hardware,
        *,
        baud: int = DEFAULT_BAUD,
        timing: Timing | None = None,
        booted: bool = False,
    ) -> None:
        self._program = firmware_named(firmware)
        self._hardware = hardware
        self._timing = self._program.TIMING if timing is None else timing
        self._line = IncomingLine(baud)
        self._out: deque[Chunk] = deque()
        self._answer = 0
        self._clock = 0.0
        self._free_at = 0.0
        self._sent_at = 0.0
        self._world_time: float | None = None
        self._next: float | None = None
        """When the program does something next, s, as long as it is known."""
        self.memory = ProgramMemory()  # the program memory that an e-puck1's bootloader writes
        self.pace = 1.0  # how fast its clock goes, which times its motors and its work
        self.firmware: Firmware  # the running firmware
        self._connection: RobotConnection
        self._received: ReceiveRing | ReceiveQueue
        self._steps: FirmwareSteps | None
        self._listens_until: float | None
        self._start(cold=True)
        if booted:
            # Its output and durations belong to the past.
            deque(self._steps or (), maxlen=0)
            self._steps = None

    # -- the interface for the caller --

    def receive(self, data: bytes, time: float) -> None:
        """Hand *data* to the robot's serial line at *time*, s. Bytes that are still on the line pass first."""
        if not self._is_hung:
            self._line.put(data, max(time, self._clock))
            self._next = None

    def advance(self, time: float) -> list[Chunk]:
        """Run everything that is due up to *time*, s. A time that has passed already changes nothing.

        Returns:
            What left the robot up to then, in order.
        """
        event = self._next_event() if self._next is None else self._next
        self._obey_remote(min(event, max(self._free_at, self._line.next_arrival), time))
        while event <= time:
            self._clock = max(self._clock, event)
            self._run(event, time)
            event = self._next_event()
        self._next = event
        if self._line.next_arrival <= time and self._steps is None:
            self._read(time)  # of a command that is not complete
        self._clock = max(self._clock, time)
        out, sent = self._out, []
        while out and out[0].time <= time:
            sent.append(out.popleft())
        return sent

    @property
    def due(self) -> float | None:
        """When :meth:`advance` has something to do next, s; None while only bytes or a new state can change that."""
        if self._next is None:
            self._next = self._next_event()
        event = self._next
        if self._out:
            event = min(event, self._out[0].time)
        return None if event == inf else event

    @property
    def is_idle(self) -> bool:
        """Whether no byte is on its way in or out, and the firmware waits for one, even in the middle of a command."""
        return not self._out and self._steps is None and not self._received.unread and self._line.next_arrival == inf

    def power_cycle(self, time: float) -> None:
        """Take the battery out and put it back at *time*, s: the robot forgets everything and boots."""
        self._restart(time, cold=True)

    def press_reset(self, time: float) -> None:
        """Press the reset button at *time*, s: the robot starts again, as after the command that resets it."""
        self._restart(time, cold=False)

    def switch_off(self, time: float) -> None:
        """Take the battery out at *time*, s: motors and lamps go off, and all bytes are lost until a power cycle."""
        self.power_cycle(time)
        self._hang()

    def let_world_run(self, time: float) -> None:
        """Bring hardware and motors up to *time*, s."""
        before = self._world_time
        if before is None or time > before:
            self._hardware.advance(time)
            self._world_time = time
            if before is not None and self._timing.runs:
                for motor in self.firmware.motors:
                    motor.run((time - before) * self.pace)

    def tick(self, count: int) -> None:
        """Let the motors alone run *count* ticks of 0.1 ms."""
        for motor in self.firmware.motors:
            motor.tick(count)

    # -- the firmware --

    def _restart(self, time: float, *, cold: bool) -> None:
        self.let_world_run(time)
        self._clock = self._free_at = self._sent_at = time
        self._out.clear()
        self.firmware.switch_off()
        self._start(cold=cold, resets=0 if cold else self.firmware.resets + 1)

    def _start(self, *, cold: bool, resets: int = 0) -> None:
        """Load the firmware again. Bytes on their way to the old one are lost."""
        self.firmware = self._program(self._hardware, self._timing, resets)
        self._connection = RobotConnection(self.firmware.LENGTHS)
        self._received = self._new_buffer()
        self._line.clear()
        self._steps = self.firmware.boot(self.memory, cold=cold)
        self._listens_until = None
        self._has_heard = self._is_deaf = False
        self._is_hung = False
        self._is_in_frame = False
        self._next = None

    def _new_buffer(self) -> ReceiveRing | ReceiveQueue:
        size = FIRMWARES[self._program.NAME].receive_ring
        return ReceiveQueue(size) if self.firmware.DROPS else ReceiveRing(size)

    def _next_event(self) -> float:
        """Return when the program, or one of its threads, does something next."""
        if self._is_hung:
            return inf
        if self._steps is not None:
            event = self._free_at
            if self._listens_until is not None:
                event = max(event, min(self._listens_until, self._line.next_arrival))
        elif self._received.unread:
            event = self._free_at
        elif self._connection.is_in_session:
            event = max(self._free_at, self._line.next_arrival)
        else:
            event = max(self._free_at, self._line.next_end)
        return min(event, max(self.firmware.next_thread, self._clock))

    def _run(self, time: float, until: float) -> None:
        """Do what is due at *time*; where only bytes are due, read on until *until*."""
        thread = self.firmware.next_thread
        if thread <= time:
            self.let_world_run(time)
            self.firmware.run_threads(time)
        elif self._steps is not None:
            self._resume(time)
        else:
            self._read(until if thread == inf else time)

    def _read(self, until: float) -> None:
        """Read bytes up to the one that completes a command, first those that came while the program was busy."""
        line, received, feed = self._line, self._received, self._connection.feed
        while True:
            while line.next_arrival < self._free_at:
                received.put(line.get())
            time = self._free_at if received.unread else max(self._free_at, line.next_arrival)
            if time > until:
                return
            self._free_at = time
            event = feed(received.get() if received.unread else line.get())
            if event is not None:
                self._clock = max(self._clock, time)
                self.let_world_run(time)
                self._carry_out(event, time)
                return

    def _carry_out(self, event: Event, time: float) -> None:
        reply: bytes | FirmwareSteps | None
        if isinstance(event, TextLine):
            self._answer += 1
            reply = self.firmware.line(event.line)
        elif isinstance(event, Opcode):
            if not self._is_in_frame:
                self._is_in_frame = True
                self._answer += 1
            reply = self.firmware.opcode(event.code, event.parameters)
        else:
            self._is_in_frame = False
            reply = self.firmware.end_session()
        if isinstance(reply, bytes):
            if reply:
                self._free_at = self._send(reply, self._answer, time)
        elif reply is not None:
            self._steps = reply
            self._resume(time)

    def _resume(self, time: float) -> None:
        """Go on with the firmware's work until a step of it takes time."""
        self.let_world_run(time)
        if self._is_deaf:
            self._is_deaf = False
            while self._line.next_arrival <= time:
                self._line.get()
        while self._steps is not None and self._free_at <= time:
            heard = None
            if self._listens_until is not None:
                if self._line.next_arrival <= time:
                    heard = self._line.get()
                    self._has_heard = True
                elif time < self._listens_until:
                    return
                self._listens_until = None
            match _next(self._steps, heard):
                case Send(data, waits, unasked):
                    if self._has_heard:  # the bootloader's answer
                        self._has_heard = False
                        self._answer += 1
                    end = self._send(data, 0 if unasked else self._answer, time)
                    if waits:
                        self._free_at = end
                case Busy(seconds):
                    self._free_at = time + seconds / self.pace
                case Listen(seconds):
                    self._listens_until = time + seconds / self.pace
                case Deaf(seconds):
                    self._free_at = time + seconds / self.pace
                    self._is_deaf = True
                case Restart():
                    self.firmware.switch_off()
                    self._start(cold=False, resets=self.firmware.resets + 1)
                case Hang():
                    self._hang()
                case None:
                    self._steps = None

    def _hang(self) -> None:
        self._is_hung = True
        self._steps = None
        self._line.clear()
        self._received = self._new_buffer()

    def _send(self, data: bytes, answer: int, time: float) -> float:
        """Put *data* on the wire; return when its last byte has left."""
        start, byte_time = max(time, self._sent_at), self._line.byte_time
        for offset in range(0, len(data), CHUNK):
            piece = data[offset : offset + CHUNK]
            self._out.append(Chunk(start + (offset + len(piece)) * byte_time, piece, answer))
        self._sent_at = start + len(data) * byte_time
        return self._sent_at

    # -- the firmware's surroundings --

    def _obey_remote(self, time: float) -> None:
        """Obey the remote control, if the firmware is at the place where it looks for codes."""
        if self._steps is not None or self._is_hung or self._received.unread:
            return
        if self._connection.is_between_commands and self.firmware.wants_remote():
            self.let_world_run(time)
            self.firmware.obey_remote()


def _next(steps: FirmwareSteps, heard: int | None) -> FirmwareStep | None:
    """Return the next step of a firmware that is sent what it heard; None at its end."""
    try:
        return steps.send(heard)
    except StopIteration:
        return None
