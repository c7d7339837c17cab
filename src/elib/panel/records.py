"""The log and the recording of one robot in the panel. Both can be asked for before the robot is connected."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from elib.base.errors import ArgumentError, ElibError
from elib.records.log import Log
from elib.records.recorder import Recorder
from elib.robot.aio import Epuck

T = TypeVar("T", Log, Recorder)


class Records:
    """What is written of one robot.

    Args:
        note: Called with a text, and whether it went wrong.

    Attributes:
        log: The log that is being written, or None.
        recorder: The recording that is being written, or None.
        armed_log: The path of a log that begins as soon as the robot is connected; empty if there is none.
        armed_recording: Likewise of a recording.
    """

    def __init__(self, note: Callable[[str, bool], object]) -> None:
        self.log: Log | None = None
        self.recorder: Recorder | None = None
        self.armed_log = self.armed_recording = ""
        self._note = note

    @property
    def is_writing(self) -> bool:
        """Whether anything is being written."""
        return self.log is not None or self.recorder is not None

    def begin(self, robot: Epuck) -> None:
        """Write what was asked for before the robot was connected; an error goes into the event log."""
        log, self.armed_log = self.armed_log, ""
        recording, self.armed_recording = self.armed_recording, ""
        try:
            if log:
                self.start_log(robot, log)
            if recording:
                self.start_recorder(robot, recording)
        except ElibError as error:
            self._note(error.message, True)

    def start_log(self, robot: Epuck | None, path: str) -> None:
        """Append a line for each call to a file, instead of the one before; None waits until a robot is connected.

        Raises:
            ElibError: The file cannot be written.
        """
        self.stop_log()
        if robot is None:
            self.armed_log = path
        else:
            self.log = _opened(robot.log, path)
            self._note(f"logging to {path}", False)

    def stop_log(self) -> None:
        """Write the log no more."""
        self.armed_log = ""
        log, self.log = self.log, None
        self._close(log, "the log has ended")

    def start_recorder(self, robot: Epuck | None, path: str) -> None:
        """Record everything into a new file, instead of the one before; None waits until a robot is connected.

        Raises:
            ElibError: The file cannot be written, or the extra ``record`` is not installed.
        """
        self.stop_recorder()
        if robot is None:
            self.armed_recording = path
        else:
            self.recorder = _opened(robot.record, path)
            self._note(f"recording to {path}", False)

    def stop_recorder(self) -> None:
        """Record no more."""
        self.armed_recording = ""
        recorder, self.recorder = self.recorder, None
        self._close(recorder, "the recording has ended")

    def stop(self) -> None:
        """Write nothing more."""
        self.stop_log()
        self.stop_recorder()

    def break_off(self) -> None:
        """Write no more of a robot that could not be prepared. Its log goes on when it is connected."""
        if self.is_writing:
            log = "" if self.log is None else self.log.target
            self.stop()
            self.armed_log = log

    def _close(self, record: Log | Recorder | None, words: str) -> None:
        if record is None:
            return
        try:
            record.close()
        except ElibError as error:
            self._note(error.message, True)
        else:
            self._note(words, False)


def _opened(start: Callable[[str], T], path: str) -> T:
    try:
        return start(path)
    except OSError as error:
        raise ArgumentError(f"{path!r} cannot be written: {error.strerror or error}") from None
