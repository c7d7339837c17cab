"""How the cases of a test are spread over the two lanes: `make test` runs the quick ones, `make test-all` all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

import pytest


def short(cases: Iterable[object], *quick: object) -> list[object]:
    """Return all cases, of which only the *quick* ones run in the quick lane; a tuple gives several arguments."""
    return [
        case if case in quick else pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.long)
        for case in cases
    ]


def each_once(ones: Iterable[object], others: Sequence[object]) -> list[object]:
    """Return all pairs, of which the quick lane runs so many that each thing is in one of them."""
    quick = [(one, others[row % len(others)]) for row, one in enumerate(ones)]
    return short(product(ones, others), *quick)


def few_and_many(few: int, many: int) -> pytest.MarkDecorator:
    """Give a test its number of random *examples*: few in the quick lane, and many in the long one."""
    return pytest.mark.examples(few, many)
