"""What the tests of robots share."""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import pytest

from elib.robot import portal


@pytest.fixture
def thought_takes_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let what the program does between its calls take no time, so that no busy computer changes simulated time.

    Otherwise a program that works for a twentieth of a second counts as one that waits, and its begun calls go on.
    """
    ticks = itertools.count()
    monkeypatch.setattr(portal, "time", SimpleNamespace(monotonic=lambda: next(ticks) * 1e-9))
