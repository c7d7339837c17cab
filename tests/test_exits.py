"""How a program ends: exit codes, errors on stderr, and streams that are closed or full."""

from __future__ import annotations

import errno
import os
import subprocess
import sys

import pytest

from elib.base.errors import ArgumentError, LinkLost
from elib.base.exits import DONE, FAILED, INTERRUPTED, WRONG_USAGE, exit_code
from shared import PATIENCE


def fail(error: BaseException) -> int:
    def work() -> None:
        raise error

    return exit_code(work)


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (ArgumentError("no such thing", hint="another"), WRONG_USAGE, "error: no such thing\nhint: another\n"),
        (LinkLost("it is gone\x1b[2J"), FAILED, "error: it is gone\\x1b[2J\n"),
        (FileNotFoundError(errno.ENOENT, "No such file", "a.log"), FAILED, "error: a.log: No such file\n"),
        (KeyboardInterrupt(), INTERRUPTED, ""),
    ],
)
def test_an_error_is_printed_with_its_exit_code(
    error: BaseException, code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert fail(error) == code
    assert capsys.readouterr().err == said


def test_work_that_ends_well_is_done(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(lambda: print("result")) == DONE
    assert capsys.readouterr() == ("result\n", "")


def test_an_error_of_the_system_that_names_no_file_is_a_defect() -> None:
    with pytest.raises(OSError, match="of the program"):
        fail(OSError(errno.EINVAL, "of the program"))


@pytest.mark.parametrize("closed", ["stdout", "stderr", "both"])
def test_streams_that_are_closed_change_nothing_but_the_exit_code(closed: str) -> None:
    code = (
        "import os, sys; from elib.base.exits import exit_code; from elib.base.errors import ArgumentError\n"
        "def work():\n    print('x' * 100000); raise ArgumentError('wrong')\n"
        "sys.exit(exit_code(work))"
    )
    reader, writer = os.pipe()
    os.close(reader)
    streams = {
        "stdout": writer if closed in ("stdout", "both") else subprocess.DEVNULL,
        "stderr": writer if closed in ("stderr", "both") else subprocess.PIPE,
    }
    done = subprocess.run([sys.executable, "-c", code], **streams, timeout=PATIENCE, check=False)
    os.close(writer)
    assert done.returncode == (WRONG_USAGE if closed == "stderr" else FAILED)
    assert not done.stderr
