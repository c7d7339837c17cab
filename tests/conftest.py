"""What holds for all tests."""

import signal

import pytest


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let Ctrl-C end what a test starts, also where the tests run in the background of a shell, which ignores it."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
