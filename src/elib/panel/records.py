"""The log and the recording of one robot in the panel. Both can be asked for before the robot is connected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from elib.base.errors import ArgumentError, ElibError
from elib.records.log import Log
from elib.records.recorder import Recorder
from elib.robot.aio import Epuck

T = TypeVar("T", Log, Recorder)
GetRobot = Callable[[], Epuck | None]


class Writing(Generic[T]):
    """What is written of one robot into one file."""

    def __init__(
        self, words: str, robot: GetRobot, open_file: Callable[[Epuck, str], T], note: Callable[[str, bool], object]
    ) -> None:
        self.file: T | None = None  # what is being written, or None
        self.armed = ""  # the path of a file that begins as soon as the robot is connected; empty if there is none
        self._open: Callable[[Epuck, str], T] = open_file
        self._words, self._robot, self._note = words, robot, note

    def start(self, path: str) -> None:
        """Write into a file, instead of the one before; without a robot, from the moment when one is connected.

        An ElibError says that the file cannot be written, or that the extra ``record`` is not installed.
        """
        self.stop()
        robot = self._robot()
        if robot is None:
            self.armed = path
            return
        try:
            self.file = self._open(robot, path)
        except OSError as error:
            raise ArgumentError(f"{path!r} cannot be written: {error.strerror or error}") from None
        self._note(f"the {self._words} is written to {path}", False)

    def begin(self) -> None:
        """Write what was asked for before the robot was connected; an error goes into the event log."""
        armed, self.armed = self.armed, ""
        try:
            if armed:
                self.start(armed)
        except ElibError as error:
            self._note(error.message, True)

    def stop(self) -> None:
        """Write no more; an error goes into the event log."""
        self.armed = ""
        file, self.file = self.file, None
        if file is None:
            return
        try:
            file.close()
        except ElibError as error:
            self._note(error.message, True)
        else:
            self._note(f"the {self._words} has ended", False)


class Records:
    """What is written of one robot."""

    def __init__(self, robot: GetRobot, note: Callable[[str, bool], object]) -> None:
        # a line for each call, appended to a file
        self.log = Writing[Log]("log", robot, lambda robot, path: robot.log(path), note)
        # everything, in a new file
        self.recording = Writing[Recorder]("recording", robot, lambda robot, path: robot.record(path), note)

    @property
    def is_writing(self) -> bool:
        """Whether anything is being written."""
        return self.log.file is not None or self.recording.file is not None

    def begin(self) -> None:
        """Write what was asked for before the robot was connected."""
        self.log.begin()
        self.recording.begin()

    def stop(self) -> None:
        """Write nothing more."""
        self.log.stop()
        self.recording.stop()

    def break_off(self) -> None:
        """Write no more of a robot that could not be prepared. Its log goes on when it is connected."""
        if self.is_writing:
            log = "" if self.log.file is None else self.log.file.target
            self.stop()
            self.log.armed = log
