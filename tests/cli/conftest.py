"""How the tests of the command line call it in their own process."""

from collections.abc import Callable

import pytest

from elib.cli import main


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Return a function that runs a command, which must succeed, and returns what it printed."""

    def run(*words: object) -> str:
        capsys.readouterr()  # of what ran before
        assert main([*map(str, words)]) == 0
        return capsys.readouterr().out

    return run


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Return a function that runs a command, which must fail and print no result, and returns its complaint.

    It must end with *code*; with None, a failure and a wrong call are both right.
    """

    def run(*words: object, code: int | None = 2) -> str:
        capsys.readouterr()
        assert main([*map(str, words)]) in ((1, 2) if code is None else (code,))
        out, err = capsys.readouterr()
        assert out == ""
        assert "Traceback" not in err
        return err

    return run
