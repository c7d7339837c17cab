"""How a matrix of cases is spread over the two lanes of the tests."""

from __future__ import annotations

from collections.abc import Iterable

import pytest


def short(cases: Iterable[object], *quick: object) -> list[object]:
    """Return all cases, of which only the *quick* ones run in `make test`; `make test-all` runs them all."""
    return [case if case in quick else pytest.param(case, marks=pytest.mark.long) for case in cases]
