"""The watchdog's own process, which stops a robot whose program has died or frozen.

It runs as a script and imports nothing of elib, so that it starts fast. Its standard output is the open line to the
robot, its standard input a pipe in which the program writes while its event loop runs. The pipe ends with the program.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import sys
import time

FROZEN_AFTER = 0.5
"""s without a beat after which a program counts as frozen, once there was one."""
PERIOD = 0.1
"""s between two checks."""
STOPS, STOP_EVERY = 3, 0.5
"""How often a robot of a frozen program is told to stop, and s between: the line may lose bytes."""
LINGER_TIME = 0.15
"""s for which a line is kept open after each of the two stops for the robot of a dead program."""
WRITE_TIME = 0.2
"""s in which a line must take the bytes."""
STUCK = 16384
"""Bytes unread by a frozen program above which a robot on Wi-Fi may be stuck: it takes no command while it cannot send.
Its sensors alone need 3 s for them, a picture has more."""
LOOK_EVERY = 0.02
"""s between two looks at what a robot on Wi-Fi sends: about one of its cycles without a picture."""
FEW, CALM = 4096, 12
"""Bytes of one look, more than the packets of a cycle without a picture, and looks in a row that had so few: then it
has gone through several cycles, and a command that asks for no picture is taken (wire-protocol.md, 4.4)."""
TAKING_TIME = 13.0
"""s in which it takes a command at most: pictures came up to 5.9 s late (measured-robots: latency.wifi_picture), and a
second one may have followed before the command could be sent."""


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


def drain(number: int, seconds: float) -> None:
    """Read and drop what comes on an open line, until it ends or the time is over. Never raises."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0 and select.select([number], [], [], left)[0]:
        if read_all(number) is None:
            return


def read_all(number: int) -> int | None:
    """Read and drop what waits on an open line; return how many bytes that were, None if the line has ended."""
    size = 0
    while select.select([number], [], [], 0)[0]:
        try:
            data = os.read(number, 65536)
        except BlockingIOError:
            break
        except OSError:
            return None
        if not data:
            return None
        size += len(data)
    return size


def end_streams(numbers: list[int]) -> None:
    """Let robots on Wi-Fi take their last command, then end their connections. Never raises.

    The command must ask for no pictures: a robot that has taken it sends small packets alone, one after the other.
    They are read meanwhile, for a robot that cannot send takes no command. What the program would read behind that is
    out of step, so it must not go on.
    """
    end = time.monotonic() + TAKING_TIME
    calm = dict.fromkeys(numbers, 0)
    while any(looks < CALM for looks in calm.values()) and time.monotonic() < end:
        time.sleep(LOOK_EVERY)
        for number in numbers:
            size = read_all(number)
            if size is None:
                calm[number] = CALM  # it is gone
            elif size > FEW:
                calm[number] = 0
            elif size > 0:
                calm[number] += 1
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


def watch(beats: int, line: int, stop: bytes, parent: int, *, streams: bool) -> None:
    """Watch until the program has died; stop its robot whenever it is frozen.

    Args:
        beats: The pipe in which the program writes.
        line: The robot's line.
        stop: The bytes that stop the robot.
        parent: The program's number: a fork of it may hold the pipe open for longer.
        streams: The robot streams packets, over Wi-Fi. Its connection is ended if it may be stuck.
    """
    stops, due = 0, float("inf")
    while True:
        if select.select([beats], [], [], PERIOD)[0]:
            if not os.read(beats, 65536):
                return
            stops, due = 0, time.monotonic() + FROZEN_AFTER
        elif os.getppid() != parent:
            return
        elif stops < STOPS and time.monotonic() >= due:
            write_now(line, stop)
            if streams and unread(line) > STUCK:
                end_streams([line])
            stops, due = stops + 1, time.monotonic() + STOP_EVERY


def main() -> None:
    """Watch a robot; the arguments are the bytes that stop it, the program's number, and whether it streams."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGPIPE"):
        signal.signal(getattr(signal, name), signal.SIG_IGN)  # they are meant for the program
    beats, line, stop = sys.stdin.fileno(), sys.stdout.fileno(), bytes.fromhex(sys.argv[1])
    streams = sys.argv[3] == "True"
    watch(beats, line, stop, int(sys.argv[2]), streams=streams)
    for _ in range(1 if streams else 2):
        write_now(line, stop)
        if streams:
            end_streams([line])
        else:
            drain(line, LINGER_TIME)  # answers that are not wanted
    os._exit(0)


if __name__ == "__main__":
    main()
