"""Stop open robots without their event loops: when a signal suspends or ends the program, when it freezes or dies."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
from collections.abc import Callable

from elib.base.errors import Unsupported
from elib.link.protocol.wifi import REQUEST, STREAM_SENSORS
from elib.link.session import Channel, Ending, Received, SessionOpened, TraceEvent
from elib.robot.watchdog import BEAT_EVERY, Watchdog, is_supported
from elib.robot.watchdog_process import FROZEN_AFTER, end_streams, write_now

ESTABLISHED = 1
"""The state of an open connection, first byte of ``TCP_INFO`` (Linux: tcp(7))."""


class EmergencyStop:
    """The way to stop one open robot while its event loop cannot. Make it in that loop.

    Args:
        channel: The robot's session, or what makes sessions for it.
        stop: Returns the bytes that stop the robot now.
        is_watched: The watchdog also stops the robot when this program freezes.

    Raises:
        Unsupported: The system does not start the watchdog.
    """

    def __init__(self, channel: Channel, stop: Callable[[], bytes], *, is_watched: bool) -> None:
        self.loop = asyncio.get_running_loop()
        # stops the robot when this program has died; None without an open line, or where none was asked for
        self.watchdog: Watchdog | None = None
        self._channel = channel
        self._stop = stop
        self._is_watched = is_watched
        self._timer: asyncio.TimerHandle | None = None
        self._last_beat = 0.0
        self._has_ended_stream = False
        self._guard()
        channel.hooks.append(self._follow, Ending, SessionOpened, *((Received,) if self._streams else ()))
        OPEN_STOPS.add(self)

    def stop(self) -> int | None:
        """Tell the robot to stop. Any thread, and a signal handler, may call this.

        Returns:
            The descriptor of a robot on Wi-Fi, whose connection the caller has to end by :func:`end_streams`.
        """
        number = self._number
        if number is None:
            return None
        data = bytearray(self._data())
        if self._streams:
            data[REQUEST] = STREAM_SENSORS  # behind a picture it would take the next command late
        write_now(number, bytes(data))
        self._note_stop()
        self._has_ended_stream = self._streams
        return number if self._streams else None

    def stop_in_loop(self) -> None:
        """Tell the robot to stop, in its event loop: there no call takes the stop's answer for its own."""
        self._channel.send_unqueued(self._stop())

    def leave(self) -> None:
        """Forget the robot: it was stopped, or is lost. Safe to repeat."""
        OPEN_STOPS.discard(self)
        self._release()

    def _data(self) -> bytes:
        """Return the bytes that stop the robot, after those that end what it has half received."""
        return self._channel.context.profile.line_end + self._stop()

    def _note_stop(self) -> None:
        """Note that the robot was stopped past the session: over Wi-Fi a command has the speeds last sent."""
        if self._streams:
            self._channel.context.sent = self._stop()

    @property
    def _streams(self) -> bool:
        return self._channel.context.profile.codec == "wifi"

    @property
    def _number(self) -> int | None:
        fileno = getattr(self._channel.transport, "fileno", None)
        return None if fileno is None else fileno()

    def _follow(self, time: float, event: TraceEvent) -> None:
        """Release a line before it is closed, and guard the next one; a trace hook."""
        if isinstance(event, Received):
            self._check_stream(time)
            return
        self._release()
        if isinstance(event, SessionOpened):
            self._has_ended_stream = False
            self._guard()

    def _check_stream(self, time: float) -> None:
        """Give a connection up from which :meth:`stop`, or the watchdog of a frozen program, has read."""
        was_frozen = self._is_watched and time - self._last_beat >= FROZEN_AFTER
        number = self._number if was_frozen else None
        if self._has_ended_stream or (number is not None and is_ended(number)):
            lose = getattr(self._channel.transport, "lose", None)
            if lose is not None:
                lose(
                    f"{self._channel.transport.url}: the robot was stopped past this program, which was busy or "
                    "frozen, and what it sent meanwhile is lost",
                    hint="open it again, or use elib.reconnecting()",
                )

    def _guard(self) -> None:
        # Where SIGTERM is not handled, for example because another thread than the main one opened the robot, it kills.
        is_dying = signal.getsignal(signal.SIGTERM) is signal.SIG_DFL and is_supported()
        number = self._number if self._is_watched or is_dying else None
        if number is None:
            return
        with contextlib.nullcontext() if self._is_watched else contextlib.suppress(Unsupported):
            self.watchdog = Watchdog(number, self._data(), streams=self._streams)
        if self._is_watched:
            self._last_beat = self.loop.time()
            self._beat()

    def _beat(self) -> None:
        if self.watchdog is not None:
            now = self.loop.time()
            if now - self._last_beat >= FROZEN_AFTER:
                self._note_stop()  # the watchdog did it: this program was frozen
            self._last_beat = now
            self.watchdog.beat()
            self._timer = self.loop.call_later(BEAT_EVERY, self._beat)

    def _release(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        watchdog, self.watchdog = self.watchdog, None
        if watchdog is not None:
            watchdog.release()


OPEN_STOPS: set[EmergencyStop] = set()
"""The emergency stops of all open robots."""


def stop_at_once(
    loop: asyncio.AbstractEventLoop | None = None, *, inside: asyncio.AbstractEventLoop | None = None
) -> None:
    """Tell the robots of *loop*, or all robots, to stop, past their queues and without their event loops.

    Args:
        loop: Stop the robots of this loop alone.
        inside: The loop in which this is called: its robots are stopped by their sessions, which expect the answer.
    """
    those = [each for each in tuple(OPEN_STOPS) if loop is None or each.loop is loop]
    for each in those:
        if each.loop is inside:
            each.stop_in_loop()
    streams = [each.stop() for each in those if each.loop is not inside]
    end_streams([number for number in streams if number is not None])


def is_ended(number: int) -> bool:
    """Return whether a TCP connection was ended on this side; True if the system does not tell."""
    try:
        with socket.socket(fileno=os.dup(number)) as line:
            return line.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0] != ESTABLISHED
    except (AttributeError, OSError):
        return True
