"""et as a person runs it, without a process of its own."""

import io
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pytest

from elib.records.et import main

SAMPLE = """\
812.10250000 Ada call GetIR(..) 0 0
812.11310000 Ada call GetLight(..) 0 1
812.12390000 Ada call Motors(..) 1 2
812.15120000 Ada ok GetIR(..) 1 2
#start of second round
812.19840000 Ada ok GetLight(..) 0 1
812.32700000 Ada ko Motors(..) 0 0
812.50000000 Ada call GetSelector(..) 0 0
812.54000000 Ada call Stop(..) 0 0
812.57500000 Ada ok Stop(..) 0 0
812.57600000 Ada ok GetSelector(..) 0 0
"""
"""The sample of the library of 2011."""


@dataclass(frozen=True)
class Run:
    """What a run left behind."""

    code: int
    out: str
    err: str


class Terminal(io.TextIOWrapper):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def run(
    *arguments: str,
    log: str | bytes = SAMPLE,
    on_terminal: bool = False,
    program: Callable[[Sequence[str]], int] = main,
) -> Run:
    """Run ``et`` with *log* on its standard input, and a terminal for its messages if wished."""
    data = log.encode() if isinstance(log, str) else log
    streams = [io.TextIOWrapper(io.BytesIO(each), encoding="utf-8", newline="") for each in (data, b"", b"")]
    if on_terminal:
        streams[2] = Terminal(io.BytesIO(), encoding="utf-8", newline="")
    with pytest.MonkeyPatch.context() as patch:
        for name, stream in zip(("stdin", "stdout", "stderr"), streams, strict=True):
            patch.setattr(sys, name, stream)
        code = program(arguments)
        for stream in streams[1:]:
            stream.flush()
    out, err = (stream.buffer.getvalue().decode() for stream in streams[1:])  # type: ignore[attr-defined]
    return Run(code, out, err)


def result(*arguments: str, log: str | bytes = SAMPLE) -> str:
    """Return what ``et`` prints; it ends well and complains about nothing."""
    found = run(*arguments, log=log)
    assert (found.code, found.err) == (0, ""), found
    return found.out


def complaint(*arguments: str, log: str | bytes = SAMPLE) -> str:
    """Return what ``et`` says about wrong usage or bad input."""
    found = run(*arguments, log=log)
    assert found.code == 2, found
    assert found.err.startswith("error: ")
    return found.err.removeprefix("error: ").rstrip()
