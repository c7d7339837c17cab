"""Jobs run here, in workers that die, and on a cluster: always to the same results."""

from __future__ import annotations

import contextlib
import gc
import itertools
import os
import signal
import socket
import subprocess
import sys
import threading
import warnings
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import psutil
import pytest

import elib
from elib.base.errors import ArgumentError, ElibError, LinkError, LinkLost, LinkNotFound
from elib.learn import executor as module
from elib.learn.executor import Executor, open_executor
from shared import PATIENCE, held_port, wait_until

HERE = Path(__file__).parent
SEARCHED = os.pathsep.join(map(str, (HERE, HERE.parent)))
"""Where a worker finds this file and what it imports."""


def square(number: int) -> tuple[int, int]:
    return number * number, os.getpid()


def fail_at_three(number: int) -> int:
    if number == 3:
        raise ArgumentError("three is too many", hint="take two")
    return number


def leave(number: int) -> None:
    sys.exit(number)


def orbit(number: int, steps: int) -> tuple[float, int]:
    """Return a number whose last bit depends on every step, and the process that calculated it."""
    value = number / 7
    for _ in range(steps):
        value = 3.9 * value * (1 - value) if 0 < value < 1 else 0.3
    return value, os.getpid()


def crash(number: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.fixture(scope="module")
def two_workers() -> Iterator[Executor]:
    with open_executor(2) as executor:
        yield executor


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait for a cluster as long as a busy machine may take."""
    monkeypatch.setattr(module, "ANSWER_TIME", PATIENCE)


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """The address of a cluster that runs already, in processes of its own."""
    import distributed

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:
        yield cluster.scheduler_address


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


@pytest.mark.usefixtures("patient")
def test_a_cluster_that_runs_can_be_used(scheduler: str) -> None:
    with open_executor(cluster=scheduler) as executor:
        assert dict(executor.run(square, [(4,)]))[0][0] == 16
        assert executor.width == 2


@pytest.mark.usefixtures("patient")
def test_workers_with_another_elib_are_refused(scheduler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(elib, "__version__", "9.9.9")
    with (
        pytest.raises(LinkError, match=r"has elib .*, and this computer has 9\.9\.9"),
        open_executor(cluster=scheduler),
    ):
        pass


def test_nobody_can_reach_the_workers(two_workers: Executor) -> None:
    results = dict(two_workers.run(square, [(k,) for k in range(20)]))
    assert ports_of([psutil.Process(process) for process in {process for _, process in results.values()}]) == []


def ports_of(family: list[Any]) -> list[Any]:
    """Return the addresses at which processes listen."""
    return [each.laddr for process in family for each in process.net_connections() if each.status == "LISTEN"]


def test_a_killed_worker_changes_nothing_in_the_result(two_workers: Executor) -> None:
    found: dict[int, float] = {}
    for k, (value, process) in two_workers.run(orbit, [(k, 1000) for k in range(8)]):
        if not found:
            os.kill(process, signal.SIGKILL)
        found[k] = value
    assert found == {k: orbit(k, 1000)[0] for k in range(8)}


def test_a_worker_that_dies_without_a_job_is_replaced(two_workers: Executor) -> None:
    for _, (_, process) in two_workers.run(orbit, [(1, 1000)]):
        os.kill(process, signal.SIGKILL)
    wait_until(lambda: not psutil.pid_exists(process))
    assert dict(two_workers.run(square, [(4,)]))[0][0] == 16


@pytest.mark.long
def test_killed_workers_change_nothing_in_the_result() -> None:
    jobs = [(k, 200_000) for k in range(16)]
    undisturbed = {k: orbit(*job)[0] for k, job in enumerate(jobs)}
    found: dict[int, float] = {}
    killed = set()
    with open_executor(2) as executor:
        for k, (value, process) in executor.run(orbit, jobs):
            found[k] = value
            if len(found) % 5 == 0:  # by the count of results, not by time: the one that gave the last one dies
                os.kill(process, signal.SIGKILL)
                killed.add(process)
    assert len(killed) == 3
    assert found == undisturbed


@pytest.mark.long
def test_a_job_that_kills_its_workers_ends_the_run_at_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_DEATHS", 2)
    with (
        open_executor(1) as executor,
        pytest.raises(ElibError, match=r"job 0 of 1, crash.*: its worker died 2 times"),
    ):
        list(executor.run(crash, [(1,)]))


@pytest.mark.long
def test_workers_end_with_their_parent(tmp_path: Path) -> None:
    program = (
        "import threading\n"
        "from elib.learn.executor import open_executor\n"
        "if __name__ == '__main__':\n"
        "    with open_executor(1) as executor:\n"
        "        print('open', flush=True)\n"
        "        threading.Event().wait()\n"
    )
    path = tmp_path / "holds_workers.py"
    path.write_text(program)
    with subprocess.Popen([sys.executable, str(path)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline() == b"open\n"
        family = [psutil.Process(parent.pid), *psutil.Process(parent.pid).children(recursive=True)]
        assert len(family) > 1
        assert ports_of(family) == []
        parent.kill()
    _, alive = psutil.wait_procs(family[1:], timeout=PATIENCE)
    assert alive == []


class Cluster:
    """A Dask cluster of other processes: a scheduler and one worker, which tests kill and start."""

    def __init__(self, folder: Path, port: int) -> None:
        self.port = port  # of the schedulers, one after the other
        self.address = f"tcp://127.0.0.1:{port}"
        self._folder = folder
        self._processes: list[subprocess.Popen[bytes]] = []

    def start_scheduler(self) -> subprocess.Popen[bytes]:
        return self._start(
            "scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--dashboard-address", "127.0.0.1:0"
        )

    def start_worker(self, **environment: str) -> subprocess.Popen[bytes]:
        options = ["--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1", "--local-directory", str(self._folder)]
        return self._start("worker", self.address, "--no-nanny", *options, **environment)

    def _start(self, *line: str, **environment: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-c", "from dask.__main__ import main; main()", *line]
        with (self._folder / "log").open("ab") as log:
            process = subprocess.Popen(
                command, stdout=log, stderr=log, env={**os.environ, "PYTHONPATH": SEARCHED, **environment}
            )
        self._processes.append(process)
        return process

    def close(self) -> None:
        for process in self._processes:
            process.kill()
            process.wait()


@pytest.fixture
def cluster(patient: None, tmp_path: Path) -> Iterator[Cluster]:
    with held_port() as port:
        found = Cluster(tmp_path, port)
        yield found
        found.close()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()  # Dask forgets a socket that is dialled when it is closed: no later test shall be told of it


def wait_for(cluster: Cluster) -> None:
    """Wait until the cluster answers; its processes take some seconds to start."""

    def answers() -> bool:
        with contextlib.suppress(LinkError), open_executor(cluster=cluster.address):
            return True
        return False

    wait_until(answers)


@pytest.mark.long
def test_a_run_survives_a_worker_of_its_cluster(cluster: Cluster) -> None:
    cluster.start_scheduler()
    worker = cluster.start_worker()
    wait_for(cluster)
    with open_executor(cluster=cluster.address) as executor:
        found: dict[int, float] = {}
        for k, (value, _) in executor.run(orbit, [(k, 200_000) for k in range(12)]):
            found[k] = value
            if len(found) == 4:
                worker.kill()
                worker.wait()
                worker = cluster.start_worker()
    assert found == {k: orbit(k, 200_000)[0] for k in range(12)}


def test_a_lost_scheduler_ends_the_run_and_the_error_says_how_it_goes_on(cluster: Cluster) -> None:
    scheduler = cluster.start_scheduler()
    cluster.start_worker()
    wait_for(cluster)
    with (
        open_executor(cluster=cluster.address) as executor,
        pytest.raises(LinkLost, match="the connection to the scheduler is lost") as caught,
    ):
        for _ in executor.run(orbit, [(k, 200_000) for k in range(8)]):
            scheduler.kill()
    assert "the same command again" in str(caught.value.hint)


@pytest.mark.long
def test_workers_with_another_python_or_without_elib_are_refused(
    cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cluster.start_scheduler()
    good = cluster.start_worker()
    wait_for(cluster)
    with monkeypatch.context() as patch:
        patch.setattr(module.platform, "python_version", lambda: "3.99.1")
        with (
            pytest.raises(LinkError, match=r"the scheduler .* has Python .*, and this computer has 3\.99"),
            open_executor(cluster=cluster.address),
        ):
            pass
    good.kill()
    good.wait()
    (tmp_path / "without" / "elib").mkdir(parents=True)
    (tmp_path / "without" / "elib" / "__init__.py").write_text("raise ModuleNotFoundError('No module named elib')")
    cluster.start_worker(PYTHONPATH=str(tmp_path / "without"))
    with (
        pytest.raises(LinkError, match=r"cannot run elib: .*No module named elib"),
        open_executor(cluster=cluster.address),
    ):
        pass


@pytest.mark.parametrize("greeting", [b"", b"SSH-2.0-OpenSSH_9.2 and so on"])
def test_what_is_not_a_scheduler_is_said_soon(greeting: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "ANSWER_TIME", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        is_refused = threading.Event()

        def answer() -> None:
            with server.accept()[0] as line:
                line.sendall(greeting)
                is_refused.wait(PATIENCE)

        thread = threading.Thread(target=answer)
        thread.start()
        with pytest.raises(LinkNotFound, match="no Dask scheduler answers at"), open_executor(cluster=address):
            pass
        is_refused.set()
        thread.join()


def test_where_nobody_listens_no_scheduler_is_waited_for() -> None:
    with (
        held_port() as port,
        pytest.raises(LinkNotFound, match="no Dask scheduler answers at"),
        open_executor(cluster=f"tcp://127.0.0.1:{port}"),
    ):
        pass


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"workers": 0}, "workers is 0"),
        ({"workers": 2, "cluster": "tcp://127.0.0.1:8786"}, "exclude each other"),
        ({"cluster": "127.0.0.1:8786"}, "the address of a Dask scheduler"),
        ({"cluster": "tcp://127.0.0.1:port"}, "the address of a Dask scheduler"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=message), open_executor(**arguments):
        pass


def test_a_cluster_without_workers_is_waited_for_not_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = itertools.count(0.0, 10.0)  # s; at each look ten have passed
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    monkeypatch.setattr(module, "POLL", 0.0)
    client = SimpleNamespace(scheduler=SimpleNamespace(ncores=dict), sync=lambda ask, **_: ask())
    client.get_executor = lambda **_: SimpleNamespace(submit=lambda *_: Future())
    monkeypatch.setattr(module, "_join", lambda *_: client)
    executor = module._Cluster("tcp://127.0.0.1:8786", print)
    executor.open()
    with pytest.raises(LinkError, match=r"tcp://127\.0\.0\.1:8786 has had no workers for 120 s"):
        list(executor.run(orbit, [(1, 1)]))
