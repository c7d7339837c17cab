"""What the tests of robots share."""

from __future__ import annotations

import itertools
import signal
from types import SimpleNamespace

import pytest

from elib.robot import portal


@pytest.fixture(autouse=True)
def no_signal_is_ignored() -> None:
    """Let signals end what a test starts, also where the tests run in the background of a shell or without hang-ups."""
    for name in ("SIGHUP", "SIGQUIT", "SIGTSTP", "SIGTERM"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


@pytest.fixture
def thought_takes_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let what the program does between its calls take no time, so that no busy computer changes simulated time.

    Otherwise a program that works for a twentieth of a second counts as one that waits, and its begun calls go on.
    """
    ticks = itertools.count()
    monkeypatch.setattr(portal, "time", SimpleNamespace(monotonic=lambda: next(ticks) * 1e-9))
