"""The link between an emulated robot and a program: delay, jitter, loss, outages, and faults that a test can order."""

from __future__ import annotations

import asyncio
import heapq
import random
from collections import deque
from collections.abc import Callable
from typing import Literal

from elib.base.errors import ArgumentError
from elib.base.rules import DELAY, PROBABILITY
from elib.link.transport.base import BufferedTransport
from elib.simulator.emulator.clock import WorldClock
from elib.simulator.emulator.emulator import Chunk, Emulator
from elib.simulator.emulator.faults import Fault, FaultyAnswer, Impairment, both

BACKLOG = 4096
"""Bytes on their way to the robot above which the program must wait: the buffer of a serial driver.

It is at most one second of the line, so that a program does not take a slow line for a dead one.
"""

INSTANT = 1e-6
"""s. The least time that passes in a world that goes on after a pause."""

Trace = Callable[[float, Literal["to robot", "to host"], bytes], None]
"""Called with time since the link's origin (s), direction and bytes, when they arrive."""


Outage = Literal["script", "hand"]
"""Who has taken a link down: a fault script, or a person."""


class Link:
    """Carries bytes between *robot* and one end of a transport, on the running event loop.

    Everything happens at its due time: the link sleeps until the next byte arrives at either side, and does not
    poll. Bytes never overtake each other. A robot without an end goes on; what it sends is lost.

    A link is up or down. While it is down no end may be attached: code that offers the robot to programs must check
    :attr:`is_down` first.

    Args:
        robot: The emulated robot.
        latency: Delay each way, s.
        jitter: Standard deviation of the delay, s.
        loss: Probability that a whole answer is lost, 0 to 1.
        seed: Seed of jitter, loss and random faults.
        baud: Speed of the robot's line, bit/s, 0 if unpaced; it is used only to make a fast program wait.
        origin: Time of the clock that is the robot's zero, s; now, if None.
        clock: The clock of its world; the running loop's if None.

    Raises:
        ArgumentError: A number is out of its range.
    """

    def __init__(
        self,
        robot: Emulator,
        *,
        latency: float = 0.0,
        jitter: float = 0.0,
        loss: float = 0.0,
        seed: int = 0,
        baud: int = 115200,
        origin: float | None = None,
        clock: WorldClock | None = None,
    ) -> None:
        for name, value, rule in (("latency", latency, DELAY), ("jitter", jitter, DELAY), ("loss", loss, PROBABILITY)):
            rule.require(value, name)
        self.robot = robot
        self.faults: deque[Fault] = deque()
        self.impairments: list[Impairment] = []  # sources of faults for answers without a fault in the queue, in order
        self.trace: Trace | None = None  # called with everything that arrives at either side
        self.down_by: set[Outage] = set()  # who has taken the link down; it is up while this is empty
        self.on_down: Callable[[], None] | None = None  # called when the link goes down, before its end is lost
        self.on_up: Callable[[], None] | None = None  # called when the link is up again
        # called with the name of a package that the robot needs and that is not installed
        self.on_missing: Callable[[str], None] | None = None
        self._loop = asyncio.get_running_loop()
        self.clock = WorldClock(self._loop) if clock is None else clock
        self._origin = self.clock.time() if origin is None else origin
        self._latency, self._jitter, self._loss = latency, jitter, loss
        self._byte_time = 10 / baud if baud else 0.0
        self._backlog = min(1.0, BACKLOG * self._byte_time)
        self._rng = random.Random(seed)
        self._end: BufferedTransport | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._armed = float("inf")
        self._inbound: deque[tuple[float, bytes]] = deque()
        self._outbound: list[tuple[float, int, bytes]] = []
        self._pieces = 0
        self._last_in = self._last_out = self._line_free = float("-inf")
        self._answer = 0
        self._faulty: FaultyAnswer | None = None
        self._is_silent = self._is_stalled = self._is_full = False
        self._left_to_robot: int | None = None
        self._left_to_host: int | None = None

    @property
    def now(self) -> float:
        """Time since the origin, s."""
        return self.clock.time() - self._origin

    def loop_time(self, time: float) -> float:
        """Return when the loop's clock shows that it is *time* since the origin; infinite while the world is paused."""
        return self.clock.loop_time(self._origin + time)

    @property
    def is_connected(self) -> bool:
        """Whether the robot has an end to talk to."""
        return self._end is not None

    def serves(self, end: BufferedTransport) -> bool:
        """Return whether *end* is what the robot is connected to."""
        return self._end is end

    @property
    def is_down(self) -> bool:
        """Whether no program can reach the robot."""
        return bool(self.down_by)

    def attach(self, end: BufferedTransport) -> None:
        """Connect the robot to *end*, instead of whatever it was connected to."""
        self.detach()
        self._end = end
        self._listen()
        self._wake(self.now)

    def detach(self) -> BufferedTransport | None:
        """Disconnect the end and return it, still open.

        The robot goes on: what was already on its way arrives, and what it answers is lost.
        """
        end, self._end = self._end, None
        if end is not None:
            end.listen(None)
        self._outbound.clear()
        self._is_full = False
        self._left_to_robot = self._left_to_host = None
        return end

    def hang_up(self) -> None:
        """Drop what a client that left has not read; half a command that it sent stays in the robot."""
        self._outbound.clear()

    def close(self) -> None:
        """Stop for good and close the end. Bytes on their way to the robot still reach it."""
        if not self._is_stalled:
            while self._inbound:
                time, data = self._inbound.popleft()
                self._run_robot(time)
                self._hand_to_robot(time, data)
            self._run_robot(max(self.now, self._line_free) + self._byte_time)
        self.cut()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def catch_up(self) -> None:
        """Let the robot run up to now, for a caller that wants to look at it or at its world."""
        now = self.now
        self._wake(now)
        for sent in self.robot.advance(now):  # it may have something to do though nothing is due
            self._put_on_its_way(sent)
        self._wake(now)

    def lose_next_reply(self) -> None:
        """Lose the next answer."""
        self.faults.append(Fault(lose=True))

    def delay_next_reply(self, seconds: float) -> None:
        """Delay the next answer, and those behind it, by *seconds*."""
        self.faults.append(Fault(delay=seconds))

    def halve_next_reply(self) -> None:
        """Lose the second half of the next answer."""
        self.faults.append(Fault(halve=True))

    def double_next_reply(self, delay: float = 0.0) -> None:
        """Send the next answer twice, the copy *delay* s after its end."""
        self.faults.append(Fault(copy_after=delay))

    def corrupt_next_reply(self, index: int | Literal["random"] = "random", *, mask: int = 0x80) -> None:
        """Invert the bits *mask* of the byte *index* of the next answer."""
        self.faults.append(Fault(corrupt=index, mask=mask))

    def inject_noise(self, data: bytes) -> None:
        """Send *data* to the program as noise that the robot did not send."""
        self._last_out = max(self._last_out, self.now)
        self._send(self._last_out, data)
        self._wake(self.now)

    def silence(self) -> None:
        """Lose all answers until :meth:`end_silence`; the robot still receives."""
        self._is_silent = True

    def end_silence(self) -> None:
        """Let answers pass again; those of the silence are lost."""
        self._is_silent = False

    def stall(self) -> None:
        """Stop carrying bytes, both ways; they wait, and so does a program that writes much."""
        self._is_stalled = True
        self._listen()

    def resume(self) -> None:
        """Carry bytes again, those that waited first."""
        self._is_stalled = False
        self._listen()
        self._wake(self.now)

    def take_down(self, by: Outage) -> None:
        """Cut the link; no end may be attached until :meth:`bring_up`."""
        was_up = not self.down_by
        self.down_by.add(by)
        if was_up:
            if self.on_down is not None:
                self.on_down()
            self.cut()

    def bring_up(self, by: Outage) -> None:
        """End an outage. The link is up again when all outages have ended."""
        was_down = bool(self.down_by)
        self.down_by.discard(by)
        if was_down and not self.down_by and self.on_up is not None:
            self.on_up()

    def power_cycle(self) -> None:
        """Take the robot's battery out and put it back."""
        self.catch_up()
        self.robot.power_cycle(self.now)
        self.catch_up()

    def cut(self) -> None:
        """Break the connection: the program's end is lost, the robot goes on alone, and a new end may be attached."""
        end = self.detach()
        self._inbound.clear()
        if end is not None:
            end.abort()

    def cut_after(self, *, to_robot: int | None = None, to_host: int | None = None) -> None:
        """Break the connection as soon as so many more bytes have arrived.

        Args:
            to_robot: Bytes toward the robot, 0 or more; None does not count them.
            to_host: Bytes toward the program, 0 or more; None does not count them.

        Raises:
            ArgumentError: Both are None, or one is negative.
        """
        counts = [count for count in (to_robot, to_host) if count is not None]
        if not counts or min(counts) < 0:
            raise ArgumentError("cut_after() needs to_robot=N or to_host=N, 0 or more")
        self._left_to_robot, self._left_to_host = to_robot, to_host
        if min(counts) == 0:
            self.cut()

    def _listen(self) -> None:
        """Take bytes from the program, unless the link is stalled or full; then they wait there."""
        if self._end is not None:
            is_ready = not self._is_stalled and not self._is_full
            self._end.listen(self._from_host if is_ready else None, self._on_host_gone)

    def _on_host_gone(self) -> None:
        """Take at once all that the program wrote before it left: no program is left that could wait."""
        if self._end is not None and not self._is_stalled:
            left = self._end.take_unread()
            if left:
                self._take_in(left)
        self.detach()
        self._wake(self.now)

    def _from_host(self, data: bytes) -> None:
        now = self._take_in(data)
        if self._line_free - now > self._backlog > 0:
            self._is_full = True
            self._listen()
        self._wake(now)

    def _take_in(self, data: bytes) -> float:
        """Put *data* on its way to the robot, and return the time."""
        for impairment in self.impairments:
            impairment.begin()
        now = self.now
        if self._end is None:  # a script may begin with a cut
            return now
        # What comes while the world stands still arrives in its next instant.
        instant = INSTANT if self.clock.is_paused else 0.0
        self._last_in = max(self._last_in, now + self._delay() + instant)
        self._inbound.append((self._last_in, data))
        self._line_free = max(self._line_free, self._last_in) + len(data) * self._byte_time
        return now

    def _delay(self) -> float:
        if not self._jitter:
            return self._latency
        return max(0.0, self._rng.gauss(self._latency, self._jitter))

    def _wake(self, now: float) -> None:
        """Do everything that is due, in the order of its time, and sleep until the next."""
        if self._is_full and now >= self._room_at():
            self._is_full = False
            self._listen()
        if not self._is_stalled:
            while self._inbound and self._inbound[0][0] <= now:
                time, data = self._inbound.popleft()
                self._run_robot(time)
                self._hand_to_robot(time, data)
        due = self._run_robot(now)
        if not self._is_stalled and self._outbound and self._outbound[0][0] <= now:
            self._hand_to_host(now)
            # The host may have answered from within, and the robot be at work already.
            due = self._run_robot(now)
        self._arm(due)

    def _room_at(self) -> float:
        """Return when a full link takes bytes of the program again."""
        return self._line_free - self._backlog / 2

    def _next_delivery(self) -> float:
        """Return when the next bytes reach the program, infinite if none are on their way."""
        return self._outbound[0][0] if self._outbound else float("inf")

    def _arm(self, due: float) -> None:
        """Set the timer for what comes first: *due*, when the robot acts, or something of our own."""
        if not self._is_stalled:
            if self._inbound:
                due = min(due, self._inbound[0][0])
            due = min(due, self._next_delivery())
        if self._is_full:
            due = min(due, self._room_at())
        if due == self._armed:
            return
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._armed = due
        if due < float("inf"):
            at = self.clock.loop_time(self._origin + due)
            if at < float("inf"):
                self._timer = self._loop.call_at(at, self._on_timer)

    def rearm(self) -> None:
        """Set the timer again, after the clock was changed."""
        self._armed = float("nan")
        self._wake(self.now)

    def _on_timer(self) -> None:
        # The sum of origin and due may round down: what was armed for is due now, or the timer rings for ever.
        due, self._armed, self._timer = self._armed, float("inf"), None
        self._wake(max(due, self.now))

    def _run_robot(self, now: float) -> float:
        """Let the robot do what is due and return when it acts next."""
        due = self.robot.due
        if due is not None and due <= now:
            try:
                for sent in self.robot.advance(now):
                    self._put_on_its_way(sent)
            except ImportError as error:
                if self.on_missing is None:
                    raise
                self.on_missing(error.name or "a package")
            due = self.robot.due
        if self._faulty is not None and self.robot.is_idle:
            self._finish_answer()
        return float("inf") if due is None else due

    def _put_on_its_way(self, sent: Chunk) -> None:
        """Apply the faults of an answer to a piece of it, and put what is left on its way."""
        if sent.answer != self._answer:
            if self._faulty is not None:
                self._finish_answer()
            self._answer = sent.answer
            if sent.answer:
                fault = self.faults.popleft() if self.faults else None
                if self._loss and self._rng.random() < self._loss:
                    fault = Fault(lose=True)
                elif fault is None:
                    for impairment in self.impairments:
                        if (more := impairment.fault_at(sent.time)) is not None:
                            fault = both(fault, more)
                self._faulty = None if fault is None else FaultyAnswer(fault, self._rng)
        time, data = sent.time, sent.data
        if self._faulty is not None:
            time, data = self._faulty.take(data, time)
        self._last_out = max(self._last_out, time + self._delay())
        self._send(self._last_out, data)

    def _finish_answer(self) -> None:
        assert self._faulty is not None
        time, data = self._faulty.copy()
        self._faulty = None
        self._send(max(self._last_out, time + self._delay()), data)

    def _send(self, time: float, data: bytes) -> None:
        if data and self._end is not None:
            self._pieces += 1
            heapq.heappush(self._outbound, (time, self._pieces, data))

    def _hand_to_robot(self, time: float, data: bytes) -> None:
        is_last = self._left_to_robot is not None and len(data) >= self._left_to_robot
        if self._left_to_robot is not None:
            data = data[: self._left_to_robot]
            self._left_to_robot -= len(data)
        if self.trace is not None:
            self.trace(time, "to robot", data)
        self.robot.receive(data, time)
        if is_last:
            self.cut()

    def _hand_to_host(self, now: float) -> None:
        arrived = bytearray()
        while self._outbound and self._outbound[0][0] <= now:
            time, _, data = heapq.heappop(self._outbound)
            if self._is_silent:
                continue
            if self.trace is not None:
                self.trace(time, "to host", data)
            arrived += data
        if not arrived or self._end is None:
            return
        left = self._left_to_host
        is_last = left is not None and len(arrived) >= left
        if left is not None:
            del arrived[left:]
            self._left_to_host = left - len(arrived)
        self._end.send_nowait(bytes(arrived))  # without room they are lost
        if is_last:
            self.cut()
