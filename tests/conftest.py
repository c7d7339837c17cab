"""Settings that hold for all tests."""

import os
import signal
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Every test is deterministic, and none fails for a machine that is busy with something else.
settings.register_profile("elib", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("elib")

os.environ.pop("ELIB_ROBOT", None)  # no test drives the robot of the one who runs it

# What Numba compiles is kept in one place, for all processes of the tests and for the next run.
os.environ["XDG_CACHE_HOME"] = str(Path(__file__).parent.parent / ".cache")


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let Ctrl-C end what a test starts, also where the tests run in the background of a shell, which ignores it."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say in one line what was not tried, and how to get it."""
    stats = terminalreporter.stats
    reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in stats.get("skipped", ()))
    parts = [f"{count} tests ({reason})" for reason, count in sorted(reasons.items())]
    if stats.get("deselected"):
        parts.insert(0, f"{len(stats['deselected'])} long forms (make test-all)")
    if parts:
        terminalreporter.write_line(f"Not tried: {'; '.join(parts)}")
