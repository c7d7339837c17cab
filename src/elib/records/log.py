"""The log of a robot's calls: text lines with the six columns that the tools of 2011 read.

::

    # elib log 1, names: python
    812.10250000 Ada call proximity 0 0
    812.15120000 Ada ok proximity 0 0
    #start of second round
"""

from __future__ import annotations

from typing import Literal, Self, get_args
from urllib.parse import quote

from elib.base.errors import ElibError
from elib.base.rules import Choice, Lines
from elib.link import session
from elib.link.session import Robot
from elib.records.lognames import name_of_2011
from elib.records.writer import LineWriter, Target

ROBOT_CLOSING_TIME = 0.2
"""s of real time for which closing a robot waits for its log: closing must be quick, wherever the log goes to."""

COMMENT = Lines(100_000)
"""The rule of a comment."""

Vocabulary = Literal["python", "2011"]
"""How a log names commands: as Python does (``proximity``), or as the library of 2011 did (``GetIR(..)``)."""

HEADER = "# elib log 1, names: {}"
"""First line of a log: its format and its vocabulary. A log without it is older and has the names of 2011."""


class Log:
    """Writes a line when a call begins, is answered or fails, and comments between them. Any thread may use it.

    It runs from the beginning, until it or the robot is closed.

    The columns are the time of the event, s on the robot's clock; the robot's name; ``call``, ``ok`` or ``ko``; the
    name of the command; the number of other calls that were not sent yet; the number of other calls that were not
    answered yet. Values are never logged. The time of an ``ok`` is when the answer came, even if the program took it
    later.

    Lines are in the file within a second, and all of them are there when the log or the robot is closed. A slow disk
    or pipe never delays the robot.

    Args:
        robot: An open robot.
        target: Path of a file, which is created or appended to, or an open text stream, which stays open.
        names: How commands are named; the header of the log says it.

    Raises:
        ArgumentError: The target takes no text, or there are no such names.
        LinkClosed: The robot is not open.
        OSError: The file cannot be opened.
    """

    def __init__(self, robot: Robot, target: Target, *, names: Vocabulary = "python") -> None:
        check_names(names)
        self._channel = robot.session
        self._name = escaped(robot.name)
        self._names: Vocabulary = names
        self._writer = LineWriter(target)
        self._writer.put(f"{HEADER.format(names)}\n")
        self._is_running = True
        # The calls that were logged and have no outcome yet, by name and time: only their outcomes are logged, or each
        # one would later be taken for that of another call.
        self._open: list[tuple[str, float]] = []
        self._channel.hooks.append(self._note)

    @property
    def is_running(self) -> bool:
        """Whether calls are being logged."""
        return self._is_running

    @property
    def is_closed(self) -> bool:
        """Whether the log has ended."""
        return self._writer.is_closed

    @property
    def target(self) -> str:
        """Name of the file or stream."""
        return self._writer.target

    def start(self) -> None:
        """Log again after :meth:`stop`. It is safe to call this while the log is running.

        Raises:
            ElibError: The log or its robot was closed, or the log could not be written.
        """
        self._check_open()
        self._is_running = True

    def stop(self) -> None:
        """Log no more calls until the next :meth:`start`; lines that wait are written now.

        The outcomes of calls that were logged before are still logged.
        """
        self._is_running = False
        self._writer.hurry()

    def comment(self, text: str) -> None:
        """Write ``#`` and *text*, also while the log is stopped; each line of *text* becomes a comment.

        Raises:
            ArgumentError: *text* is no text, or has more than 100,000 characters.
            ElibError: The log or its robot was closed, or the log could not be written.
        """
        self._check_open()
        self._remark(COMMENT.require(text, "the comment"))

    def close(self) -> None:
        """Write the lines that are left and end the log. A file is closed, a stream stays open.

        It is safe to call this again.

        Raises:
            ElibError: Lines could not be written.
        """
        self._leave()
        self._writer.close()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        state = "closed" if self.is_closed else "running" if self._is_running else "stopped"
        return f"<{type(self).__name__} {self.target} {state}>"

    def _check_open(self) -> None:
        self._writer.check()
        if self._writer.is_closed:
            raise ElibError(
                f"the log {self.target} is closed",
                hint="robot.log(...) makes another one; a log ends with its robot",
            )

    def _leave(self) -> None:
        self._is_running = False
        self._channel.hooks.remove(self._note)

    def _note(self, time: float, event: session.TraceEvent) -> None:
        """Log one event of the session; called in the event loop."""
        if isinstance(event, session.Ending) and self._channel.error is not None:
            self._leave()
            self._writer.end(ROBOT_CLOSING_TIME)
        elif isinstance(event, session.Ended):
            call = event.request.name, event.called
            if call in self._open:
                self._open.remove(call)
                self._write(time, "ok" if event.error is None else "ko", event.request.name)
        elif self._is_running:
            match event:
                case session.Called(request=request):
                    self._open.append((request.name, time))
                    self._write(time, "call", request.name)
                case _:
                    if remark := _remark_on(event):
                        self._remark(f"{time:.8f} {self._name} {remark}")

    def _write(self, time: float, word: str, name: str) -> None:
        channel = self._channel
        shown = logged_name(name, self._names)
        self._writer.put(f"{time:.8f} {self._name} {word} {shown} {channel.waiting} {channel.unanswered}\n")

    def _remark(self, text: str) -> None:
        self._writer.put("".join(f"#{line}\n" for line in text.splitlines() or [""]))


def check_names(names: str) -> None:
    """Check that there is such a vocabulary."""
    Choice(get_args(Vocabulary)).require(names, "names")


def logged_name(command: str, names: Vocabulary = "python") -> str:
    """Return the fourth column for a command: ``proximity``, or ``GetIR(..)`` in 2011."""
    return command if names == "python" else name_of_2011(command)


def escaped(name: str) -> str:
    """Return *name* as one word: blanks, ``%`` and characters that cannot be printed are written as in a URL.

    ``Ada L`` becomes ``Ada%20L``; ``urllib.parse.unquote`` reverses that.
    """
    return "".join(each if each.isprintable() and each not in " %" else quote(each, errors="replace") for each in name)


def _remark_on(event: session.TraceEvent) -> str:
    """Return a comment on an event that is not a call; empty if the event needs none."""
    match event:
        case session.Disconnected(error=error):
            return f"the link is down: {error.message}"
        case session.Reconnected(gap=gap):
            return f"the link is back after {gap:.3f} s"
        case session.Greeted() | session.ResetNoticed(sign="encoders"):  # the other sign is a greeting
            return "the robot has restarted unasked"
        case session.Noted(text=text, kind="state"):
            return f"state: {text}"
        case _:
            return ""
