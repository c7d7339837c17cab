"""The watchdog's own process, which stops the robots of a program that has died or frozen.

It runs as a script and imports nothing of elib, so that it starts fast. The program passes it each open line and the
bytes that stop the robot, beats while its event loop runs, and lets it release a line before closing it. When the
socket between them is closed, the program has died.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import struct
import sys
import time

MESSAGE = struct.Struct("=c?HI")
"""Kind of the message, whether the robot streams (over Wi-Fi), number of bytes that follow, and key of the robot."""
GUARD, GUARD_DEATH, BEAT, RELEASE = b"g", b"m", b"b", b"r"
"""Stop a robot when the program dies or freezes; stop it only when it dies; a sign of life; release a robot."""
SILENCE = 0.5
"""s without a beat after which a program counts as frozen."""
PERIOD, IDLE_PERIOD = 0.1, 1.0
"""s between two checks, with robots and without."""
STOPS, STOP_EVERY = 3, 0.5
"""How often a robot of a frozen program is told to stop, and s between: the line may lose bytes."""
LINGER_TIME = 0.15
"""s for which a line is kept open after each of the two stops for the robot of a dead program."""
WRITE_TIME = 0.2
"""s in which a line must take the bytes."""
STUCK = 16384
"""Bytes unread by a frozen program above which a robot on Wi-Fi may be stuck: it takes no command while it cannot send.
Its sensors alone need 3 s for them, a picture has more."""
TAKING_TIME = 0.3
"""s in which a robot on Wi-Fi takes a command: two of its cycles with a picture (wire-protocol.md, 4.4)."""


def write_now(number: int, data: bytes) -> None:
    """Write *data* to the open line with a descriptor, without waiting for long. Never raises."""
    end = time.monotonic() + WRITE_TIME
    with contextlib.suppress(OSError, ValueError):
        while data:
            try:
                data = data[os.write(number, data) :]
            except BlockingIOError:
                left = end - time.monotonic()
                if left <= 0 or not select.select([], [number], [], left)[1]:
                    return


def drain(numbers: list[int], seconds: float) -> None:
    """Read and drop what comes on open lines, until they end or the time is over. Never raises."""
    end = time.monotonic() + seconds
    open_ones = list(numbers)
    while open_ones and (left := end - time.monotonic()) > 0:
        for number in select.select(open_ones, [], [], left)[0]:
            try:
                is_gone = not os.read(number, 65536)
            except BlockingIOError:
                is_gone = False
            except OSError:
                is_gone = True
            if is_gone:
                open_ones.remove(number)


def end_streams(numbers: list[int]) -> None:
    """Let robots on Wi-Fi take their last command, then end their connections. Never raises.

    They are read meanwhile, for a robot that cannot send takes no command. What the program would read behind that is
    out of step, so it must not go on.
    """
    drain(numbers, TAKING_TIME)
    for number in numbers:
        with contextlib.suppress(OSError), socket.socket(fileno=os.dup(number)) as line:
            line.shutdown(socket.SHUT_RDWR)


def unread(number: int) -> int:
    """Return how many bytes wait on a line; 0 if the system does not tell."""
    import fcntl
    import termios

    try:
        return int.from_bytes(fcntl.ioctl(number, termios.FIONREAD, bytes(4)), sys.byteorder)
    except OSError:
        return 0


class GuardedRobot:
    """One robot and its open line."""

    def __init__(self, number: int, data: bytes, is_guarded: bool, streams: bool) -> None:
        self.number = number
        self.data = data
        self.is_guarded = is_guarded
        self.streams = streams
        self.beat()

    def beat(self) -> None:
        """Record that the program runs."""
        self.stops = 0
        self.due = time.monotonic() + SILENCE

    def check(self) -> None:
        """Stop the robot if its program is frozen."""
        if self.is_guarded and self.stops < STOPS and time.monotonic() >= self.due:
            write_now(self.number, self.data)
            if self.streams and unread(self.number) > STUCK:
                end_streams([self.number])
            self.stops += 1
            self.due = time.monotonic() + STOP_EVERY


def watch(program: socket.socket, parent: int) -> list[GuardedRobot]:
    """Watch until the program has died; return the robots that it left behind."""
    robots: dict[int, GuardedRobot] = {}
    heard, numbers = b"", []
    while True:
        if select.select([program], [], [], PERIOD if robots else IDLE_PERIOD)[0]:
            try:
                data, descriptors, _, _ = socket.recv_fds(program, 65536, 16)
            except OSError:
                break
            if not data:
                break
            heard += data
            numbers += descriptors
            while len(heard) >= MESSAGE.size:
                kind, streams, length, key = MESSAGE.unpack_from(heard)
                end = MESSAGE.size + length
                if len(heard) < end:
                    break
                command, heard = heard[MESSAGE.size : end], heard[end:]
                if kind in (GUARD, GUARD_DEATH):
                    robots[key] = GuardedRobot(numbers.pop(0), command, kind == GUARD, streams)
                elif kind == BEAT and key in robots:
                    robots[key].beat()
                elif kind == RELEASE:
                    if key in robots:
                        os.close(robots.pop(key).number)
                    write_now(program.fileno(), RELEASE)
        elif os.getppid() != parent:  # a fork of the program may hold the other end open for longer
            break
        for robot in robots.values():
            robot.check()
    return list(robots.values())


def stop_orphans(robots: list[GuardedRobot]) -> None:
    """Stop the robots of a program that has died; their answers are dropped."""
    for _ in range(2 if robots else 0):
        for robot in robots:
            write_now(robot.number, robot.data)
        drain([robot.number for robot in robots], LINGER_TIME)


def main() -> None:
    """Watch the program at the other end of the socket whose descriptor is the first argument."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGPIPE"):
        signal.signal(getattr(signal, name), signal.SIG_IGN)  # they are meant for the program
    with socket.socket(fileno=int(sys.argv[1])) as program:
        robots = watch(program, int(sys.argv[2]))
    stop_orphans(robots)
    os._exit(0)


if __name__ == "__main__":
    main()
