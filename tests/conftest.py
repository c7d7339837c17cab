"""Settings that hold for all tests."""

import os
import signal

import pytest
from hypothesis import HealthCheck, settings

# Every test is deterministic, and none fails for a machine that is busy with something else.
settings.register_profile("elib", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("elib")

os.environ.pop("ELIB_ROBOT", None)  # no test drives the robot of the one who runs it


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let Ctrl-C end what a test starts, also where the tests run in the background of a shell, which ignores it."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
