"""The network between an e-puck2 with Wi-Fi and a program: a TCP connection, on which no byte is lost or changed.

A packet that gets lost on the air is sent again by TCP. A program does not see a gap but a pause, after which all that
waited comes at once. So a fault that would lose or damage an answer on a serial line is a delay here.
"""

from __future__ import annotations

import heapq
from collections import deque
from typing import Any

from elib.base.curves import interpolated
from elib.link.transport.base import BufferedTransport
from elib.simulator.emulator.emulator import Chunk
from elib.simulator.emulator.faults import Fault, both
from elib.simulator.emulator.link import Link
from elib.simulator.emulator.wifi import IMAGE, SEND_BUFFER, WifiEmulator

RETRANSMISSION = 0.5
"""s after which the robot's TCP sends a lost packet again, and twice as long after each further loss.

It is the period of the timer of lwIP, the ESP32's TCP (I); a packet that others follow at once may come again sooner.
"""

CONNECTING, CONNECTING_SPREAD = 0.242, 0.093
"""s until a connection stands, and the deviation of that (measured-robots: latency.wifi_connect)."""

UNREST = 0.0025
"""Deviation of the time on the air of a typical robot's packet, s (measured-robots: latency.wifi_packet)."""

LATE_SHARE, LATE, LATEST, LATE_POWER = 0.08, 0.011, 0.37, 6.5
"""Share of a typical robot's packets that come late, and by how much, s: least, most, and how rare the most is. Packets
then come every 0 to 31 ms, 1 % more than 57 ms after the one before, and 392 ms at most (measured-robots:
latency.wifi_packet)."""

LATE_PICTURES = 0.4
PICTURE_LATE = ((0.0, 0.005), (0.375, 0.1), (0.75, 0.98), (0.875, 1.36), (0.975, 3.2), (1.0, 4.86))
"""Share of a typical robot's pictures that come late, and by how much, s, at shares of these: 25 % of all then take 300
ms or more, 5 % 1.5 s, and the last one 5 s (measured-robots: latency.wifi_picture). TCP sends lost bytes again."""

MAX_LOSSES = 6
"""Losses in a row of one packet: a probability of 1 makes every packet 31.5 s late, and does not end the connection."""


class _Signal(bytes):
    """Something else than data that is on its way to the robot, in its turn between the data."""


_CONNECT, _END, _LEAVE, _BREAK = (_Signal(name) for name in (b"connect", b"end", b"leave", b"break"))


class WifiLink(Link):
    """Carries bytes between *robot* and one end of a transport, as TCP over Wi-Fi does.

    What the robot has sent stays in its send buffer until the program's side has taken it: a program that reads slowly
    slows the robot down. Attaching an end connects a client, detaching it closes the connection.

    ``loss`` is the probability that a packet of the robot must be sent again. Of the faults of single packets, a loss,
    a half and a damaged byte mean the same; a copy has no effect, because TCP drops it, and noise cannot arise.

    Args:
        robot: The emulated robot.
        spread: How unsteady the network is: with 0 packets never come late, with 1 as often as was measured.
        **options: As those of :class:`~elib.simulator.emulator.link.Link`, without ``baud``.
    """

    robot: WifiEmulator

    def __init__(self, robot: WifiEmulator, *, spread: float = 0.0, **options: Any) -> None:
        self._spread = spread
        self._acknowledgements: deque[tuple[float, int]] = deque()
        self._is_accepted = self._is_blocked = self._is_handing_over = False
        super().__init__(robot, baud=0, **options)

    def attach(self, end: BufferedTransport) -> None:
        """Connect a client."""
        self.detach()
        self._is_accepted = self._is_blocked = False
        chance = min(max(self._rng.gauss(), -1.2), 2.2) if self._spread else 0.0
        self._signal(_CONNECT, max(0.0, CONNECTING + self._spread * CONNECTING_SPREAD * chance))
        end.on_room = self._on_room
        super().attach(end)

    def detach(self, *, reset: bool = False) -> BufferedTransport | None:
        """Let the client leave, and return its end, still open.

        Args:
            reset: Whether the connection breaks; otherwise it is closed in good order.
        """
        end = super().detach()
        if end is not None:
            end.on_room = None
            self._acknowledgements.clear()
            self._signal(_BREAK if reset else _LEAVE)
        return end

    def end_of_input(self) -> None:
        """Tell the robot that the client will send nothing more, though it may still read."""
        self._signal(_END)
        self._wake(self.now)

    def cut(self) -> None:
        """Break the connection; the robot goes on alone and, unlike a real one, notices at once."""
        super().cut()
        self._is_accepted = False
        self.robot.disconnect(self.now, reset=True)
        self._wake(self.now)

    def power_cycle(self) -> None:
        """Take the robot's battery out and put it back: the connection is lost."""
        self.cut()
        super().power_cycle()

    def end_silence(self) -> None:
        """Let packets pass again; those of the silence come late."""
        super().end_silence()
        self._wake(self.now)

    def inject_noise(self, data: bytes) -> None:
        """Do nothing: TCP keeps noise away."""

    def _signal(self, signal: _Signal, later: float = 0.0) -> None:
        self._last_in = max(self._last_in, self.now + self._delay() + later)
        self._inbound.append((self._last_in, signal))

    def _on_room(self) -> None:
        if self._is_blocked and not self._is_handing_over:
            self._is_blocked = False
            self._wake(self.now)

    # -- to the robot --

    def _from_host(self, data: bytes) -> None:
        super()._from_host(data)
        if not self._is_full and self._room_at() > self.now:
            self._is_full = True
            self._listen()

    def _room_at(self) -> float:
        """Return when the robot takes more: its window is as large as its send buffer."""
        waiting = self.robot.unread + sum(len(data) for _, data in self._inbound)
        return float("inf") if waiting > SEND_BUFFER else float("-inf")

    def _hand_to_robot(self, time: float, data: bytes) -> None:
        if data is _CONNECT:
            self._is_accepted = True
            self.robot.connect(time)
        elif data is _END:
            self.robot.end_of_input(time)
        elif isinstance(data, _Signal):
            self.robot.disconnect(time, reset=data is _BREAK)
        else:
            super()._hand_to_robot(time, data)

    # -- to the program --

    def _wake(self, now: float) -> None:
        if not self._is_stalled:
            while self._acknowledgements and self._acknowledgements[0][0] <= now:
                self.robot.acknowledge(self._acknowledgements.popleft()[1], now)
        super()._wake(now)

    def _next_delivery(self) -> float:
        due = self._acknowledgements[0][0] if self._acknowledgements else float("inf")
        return due if self._is_blocked or self._is_silent else min(due, super()._next_delivery())

    def _put_on_its_way(self, sent: Chunk) -> None:
        setback = 0.0
        if sent.answer != self._answer:
            self._answer = sent.answer
            setback = self._setback(sent.time) + self._lateness(is_picture=sent.data[:1] == IMAGE)
        self._last_out = max(self._last_out, sent.time + self._delay() + setback)
        if self._is_accepted:
            self._send(self._last_out, sent.data)

    def _setback(self, time: float) -> float:
        """Return how much later a packet arrives because it is lost, once or several times, or delayed."""
        fault: Fault | None = self.faults.popleft() if self.faults else None
        if fault is None:
            for impairment in self.impairments:
                if (more := impairment.fault_at(time)) is not None:
                    fault = both(fault, more)
        losses = 0
        if fault is not None and (fault.lose or fault.halve or fault.corrupt is not None):
            losses = 1
        while losses < MAX_LOSSES and self._loss and self._rng.random() < self._loss:
            losses += 1
        return RETRANSMISSION * ((1 << losses) - 1) + (0.0 if fault is None else fault.delay)

    def _lateness(self, *, is_picture: bool) -> float:
        """Return by how much a packet of a real robot comes later than on average, s."""
        if not self._spread:
            return 0.0
        late = self._spread * UNREST * abs(self._rng.gauss())
        if is_picture:
            if self._rng.random() < self._spread * LATE_PICTURES:
                late += interpolated(PICTURE_LATE, self._rng.random())
        elif self._rng.random() < self._spread * LATE_SHARE:
            late += LATE * (LATEST / LATE) ** (self._rng.random() ** LATE_POWER)
        return late

    def _hand_to_host(self, now: float) -> None:
        """Hand over all that has arrived, if the program's side has taken what came before."""
        end = self._end
        if end is None or self._is_silent:
            return
        if end.unsent:
            self._is_blocked = True
            return
        first, arrived = self._outbound[0], bytearray()
        while self._outbound and self._outbound[0][0] <= now:
            arrived += heapq.heappop(self._outbound)[2]
        left = self._left_to_host
        is_last = left is not None and len(arrived) >= left
        data = bytes(arrived[:left])
        self._is_handing_over = True
        try:
            is_taken = end.send_nowait(data)
        finally:
            self._is_handing_over = False
        if not is_taken and end.is_open:
            self._is_blocked = True
            heapq.heappush(self._outbound, (*first[:2], bytes(arrived)))
            return
        if self.trace is not None:
            self.trace(now, "to host", data)
        if left is not None:
            self._left_to_host = left - len(data)
        if is_last:
            self.cut()
        elif not self._latency and not self._jitter:
            self.robot.acknowledge(len(data), now)
        else:
            last = self._acknowledgements[-1][0] if self._acknowledgements else now
            self._acknowledgements.append((max(last, now + self._delay()), len(data)))
