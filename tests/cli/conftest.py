"""How the tests of the command line call it in their own process."""

import pytest
from elib_process import Ran, Told

from elib.cli import main


@pytest.fixture
def ran(capsys: pytest.CaptureFixture[str]) -> Ran:
    """Return a function that runs a command, and returns its exit code and what it wrote to stdout and stderr."""

    def run(*words: object) -> tuple[int, str, str]:
        capsys.readouterr()  # of what ran before
        try:
            code = main([*map(str, words)])
        except SystemExit as ending:
            code = int(ending.code or 0)
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def printed(ran: Ran) -> Told:
    """Return a function that runs a command, which must succeed, and returns what it printed."""

    def run(*words: object) -> str:
        code, out, err = ran(*words)
        assert code == 0, err
        return out

    return run


@pytest.fixture
def refused(ran: Ran) -> Told:
    """Return a function that runs a command, which must fail and print no result, and returns its complaint.

    It must end with *code*; with None, a failure and a wrong call are both right.
    """

    def run(*words: object, code: int | None = 2) -> str:
        ended, out, err = ran(*words)
        assert ended in ((1, 2) if code is None else (code,))
        assert out == ""
        assert "Traceback" not in err
        return err

    return run
