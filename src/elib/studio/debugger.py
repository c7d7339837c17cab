"""The line of a program that runs, breakpoints, single steps, and the values of its variables."""

from __future__ import annotations

import contextlib
import reprlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FrameType, FunctionType, ModuleType
from typing import Any, Literal

from msgspec import Struct

from elib.studio.place import Place

Step = Literal["on", "over", "into", "out"]
MAX_VARIABLES = 200
HAS_LINES = hasattr(sys, "monitoring")
"""Whether Python tells of the lines that run: from 3.12 on."""

_short = reprlib.Repr()
_short.maxlevel, _short.maxstring, _short.maxother = 3, 200, 200
_short.maxlist = _short.maxtuple = _short.maxset = _short.maxdict = 20


class Variable(Struct):
    """A variable of the program: its value as text, and its type."""

    name: str
    value: str
    type: str


class Called(Struct):
    """A function of the program that has been called and goes on, and its line."""

    function: str
    line: int


class Debugger:
    """Follows one program.

    Args:
        place: Where it runs.
        paused: Called when it is about to stand still.
    """

    def __init__(self, place: Place, paused: Callable[[], object]) -> None:
        self.breakpoints: set[int] = set()  # lines before which it is to stand still
        self.line: int | None = None  # the line that runs; None before the first one
        self._place, self._paused = place, paused
        self._file = ""
        self._top: FrameType | None = None
        self._step: Step = "on"
        self._chain: list[FrameType] = []
        """Where it stands still, and those that have called that, when a step begins."""

    @contextlib.contextmanager
    def following(self, file: str) -> Iterator[None]:
        """Follow the program in *file* while the block lasts."""
        self._file, self.line = file, None
        folder = Path(file).parent
        self.go("on")
        if not HAS_LINES:
            yield
            return
        watch: Any = sys.monitoring  # type: ignore[attr-defined]  # from Python 3.12 on
        tool, events = watch.DEBUGGER_ID, watch.events
        watch.use_tool_id(tool, "elib")

        def started(code: CodeType, _: int) -> object:
            if code.co_filename == file:
                watch.set_local_events(tool, code, events.LINE | events.JUMP | events.PY_RETURN)
            elif Path(code.co_filename).parent == folder:
                watch.set_local_events(tool, code, events.JUMP)  # it can be stopped
            return watch.DISABLE

        watch.register_callback(tool, events.PY_START, started)
        watch.register_callback(tool, events.LINE, self._at)
        watch.register_callback(tool, events.JUMP, self._place.line)  # a loop may be one line
        watch.register_callback(tool, events.PY_RETURN, self._returned)
        watch.set_events(tool, events.PY_START)
        watch.restart_events()
        try:
            yield
        finally:
            watch.set_events(tool, 0)
            watch.free_tool_id(tool)
            self._top = None
            self.go("on")

    def go(self, how: Step) -> None:
        """Let the program go on, to the next line of a kind or to the next breakpoint."""
        self._chain = [] if how in ("on", "into") else self._stack()
        self._step = how
        self._place.is_held = False

    def hold(self) -> None:
        """Let the program stand still where it is."""
        self._place.is_held = True

    def stack(self) -> list[Called]:
        """Return the functions of the program that go on, the innermost first."""
        return [Called(frame.f_code.co_name, frame.f_lineno) for frame in self._stack()]

    def variables(self) -> list[Variable]:
        """Return the variables that the innermost function sees: its own, then those of the file."""
        found: dict[str, object] = {}
        for frame in self._stack()[:1]:
            found = {**frame.f_locals, **{key: value for key, value in frame.f_globals.items() if key not in found}}
        return [
            Variable(name, _text(value), type(value).__name__)
            for name, value in found.items()
            if not name.startswith("__") and not isinstance(value, ModuleType | FunctionType | type)
        ][:MAX_VARIABLES]

    def _stack(self) -> list[FrameType]:
        """Return the frames of the program, the innermost first: those of the line that ran last."""
        frame: FrameType | None = self._top
        found = []
        while frame is not None:
            if frame.f_code.co_filename == self._file:
                found.append(frame)
            frame = frame.f_back
        return found

    def _at(self, code: CodeType, line: int) -> None:
        self.line = line
        frame = sys._getframe(1)  # noqa: SLF001  # the only way to the program's variables
        self._top = frame
        is_step = self._step == "into" or (self._step != "on" and frame in self._chain[self._step == "out" :])
        if is_step or line in self.breakpoints:
            self.hold()
            self._paused()
        self._place.line()

    def _returned(self, *_: object) -> None:
        """Let a step over the last line of a function without a caller in the program end at the next line of all."""
        if self._step in ("over", "out") and self._chain and sys._getframe(1) is self._chain[0]:  # noqa: SLF001
            self._chain.pop(0)
            self._step = "over" if self._chain else "into"


def _text(value: object) -> str:
    try:
        return _short.repr(value)
    except Exception as error:
        return f"it cannot be shown: {type(error).__name__}"
