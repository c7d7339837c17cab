"""Jobs run here, in workers that die, and on a cluster that goes away: always to the same results."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator

import pytest

from elib.errors import ArgumentError, ElibError
from elib.learn.executor import Executor, open_executor

pytest.importorskip("distributed", reason="needs the extra learn")


def square(number: int) -> tuple[int, int]:
    return number * number, os.getpid()


def fail_at_three(number: int) -> int:
    if number == 3:
        raise ArgumentError("three is too many", hint="take two")
    return number


def leave(number: int) -> None:
    sys.exit(number)


@pytest.fixture(scope="module")
def two_workers() -> Iterator[Executor]:
    with open_executor(2) as executor:
        yield executor


def test_without_workers_jobs_run_in_this_process() -> None:
    with open_executor() as executor:
        assert executor.width == 1
        assert list(executor.run(square, [(k,) for k in range(3)])) == [(k, (k * k, os.getpid())) for k in range(3)]


def test_workers_are_other_processes_and_every_job_is_done_once(two_workers: Executor) -> None:
    results = dict(two_workers.run(square, [(k,) for k in range(20)]))
    assert two_workers.width == 2
    assert [results[k][0] for k in range(20)] == [k * k for k in range(20)]
    assert os.getpid() not in {process for _, process in results.values()}


def test_no_jobs_have_no_results(two_workers: Executor) -> None:
    assert list(two_workers.run(square, [])) == []


@pytest.mark.parametrize("workers", [None, 2])
def test_an_error_of_a_job_ends_the_run_and_names_the_job(workers: int | None, request: pytest.FixtureRequest) -> None:
    with open_executor() as here:
        executor = here if workers is None else request.getfixturevalue("two_workers")
        with pytest.raises(ArgumentError, match=r"job 3 of 5, fail_at_three\(3\), failed: three is too many") as caught:
            list(executor.run(fail_at_three, [(k,) for k in range(5)]))
    assert caught.value.hint == "take two"
    assert isinstance(caught.value.__cause__, ArgumentError)


def test_a_job_that_exits_does_not_take_its_worker_along(two_workers: Executor) -> None:
    with pytest.raises(ElibError, match="SystemExit: 7"):
        list(two_workers.run(leave, [(7,)]))
    assert dict(two_workers.run(square, [(4,)]))[0][0] == 16
