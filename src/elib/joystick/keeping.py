"""What is kept of one robot in the panel: the log, and the flight recorder."""

from __future__ import annotations

from abc import abstractmethod

from elib.errors import ArgumentError, ElibError
from elib.recording.log import Log
from elib.recording.recorder import Recorder
from elib.robot.aio import Epuck


class Keeping:
    """A robot's place, as far as files of it are written.

    Attributes:
        log: The log file that is being written, or None.
        recorder: The recording that is being written, or None.
    """

    def __init__(self) -> None:
        self.log: Log | None = None
        self.recorder: Recorder | None = None

    @property
    @abstractmethod
    def robot(self) -> Epuck:
        """The robot."""

    @abstractmethod
    def note(self, text: str, *, kind: str = "note", is_bad: bool = False) -> None:
        """Add a line to the event log."""

    def start_log(self, path: str) -> None:
        """Append a line for each call to a file, instead of the one before.

        Raises:
            ElibError: It cannot be, or the robot is not connected.
        """
        self.stop_log()
        try:
            self.log = self.robot.log(path)
        except OSError as error:
            raise _unwritable(path, error) from None
        self.note(f"logging to {path}", kind="panel")

    def stop_log(self) -> None:
        """Log no more."""
        log, self.log = self.log, None
        self._close(log, "the log has ended")

    def start_recorder(self, path: str) -> None:
        """Record everything into a file that does not exist yet, instead of the one before.

        Raises:
            ElibError: It cannot be, or the robot is not connected.
        """
        self.stop_recorder()
        try:
            self.recorder = self.robot.record(path)
        except OSError as error:
            raise _unwritable(path, error) from None
        self.note(f"recording to {path}", kind="panel")

    def stop_recorder(self) -> None:
        """Record no more."""
        recorder, self.recorder = self.recorder, None
        self._close(recorder, "the recording has ended")

    def _close(self, record: Log | Recorder | None, words: str) -> None:
        if record is None:
            return
        try:
            record.close()
        except ElibError as error:
            self.note(error.message, kind="panel", is_bad=True)
        else:
            self.note(words, kind="panel")


def _unwritable(path: str, error: OSError) -> ArgumentError:
    return ArgumentError(f"{path!r} cannot be written: {error.strerror or error}")


__all__ = ["Keeping"]
