"""Run jobs here, in worker processes of this computer, or on a Dask cluster: the same code for all of them.

A worker may die at any time: the jobs that it had run again. So a job must be a function whose only effect is its
result. An error of a job itself ends the run, and so does the loss of a cluster.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib.metadata
import importlib.util
import logging
import multiprocessing
import os
import pickle
import platform
import reprlib
import signal
import socket
import threading
import time
import traceback
import warnings
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection
from typing import Any
from urllib.parse import urlsplit

import elib
from elib.base.errors import ArgumentError, ElibError, LinkError, LinkLost, LinkNotFound, Unsupported, about
from elib.base.extras import install
from elib.base.plaintext import say
from elib.base.rules import Whole

LOOPBACK = "127.0.0.1"
PORT = 8786
"""The port of a Dask scheduler, unless another one is named."""
POLL = 1.0
"""s between two looks at a cluster from which no result comes."""
ANSWER_TIME = 5.0
"""s that a scheduler has to answer."""
START_TIME = 60.0
"""s that the workers have to start, and to import elib. On a busy computer this took 20 s."""
PATIENCE = 120.0
"""s without any worker after which a run gives up."""
MAX_DEATHS = 10
"""Times that a job may lose its worker here: after so many it is the job that kills it. Dask gives it up after four
(``distributed.scheduler.allowed-failures``)."""
AGAIN = "start scheduler and workers, and then the same command again: it goes on with what is left"
MAX_WORKERS = 1000
AHEAD = 2
"""Jobs under way for each thread of the workers: one that has ended a job begins the next at once."""
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)
"""The environment of workers: there is one for each core, and more threads would only disturb each other."""

Job = tuple[Any, ...]


class Executor(ABC):
    """Something that runs jobs.

    Attributes:
        width: How many jobs run at once. On a cluster it changes when workers come and go.
        threads: How many threads a job may use: None means one a core.
    """

    width: int = 1
    threads: int | None = 1

    @abstractmethod
    def run(self, function: Callable[..., Any], jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
        """Call a function with the arguments of each job.

        Args:
            function: A function of a module. It may be called more than once for a job.
            jobs: The arguments of each call. They can be pickled, and so can the results.

        Yields:
            The index of a job, from 0, and its result, in the order in which the jobs end.

        Raises:
            ElibError: A job failed. The message names it, and its own error is the ``__cause__``.
            LinkLost: There was no worker for a long time, or the scheduler was lost.
        """


@contextlib.contextmanager
def open_executor(
    workers: int | None = None, cluster: str | None = None, *, tell: Callable[[str], object] = say
) -> Iterator[Executor]:
    """Open what runs the jobs: this process, if neither workers nor a cluster are named.

    Args:
        workers: Start this many worker processes on this computer. They listen nowhere, and end with this process.
        cluster: Address of the scheduler of a Dask cluster that runs already: ``tcp://host:8786``.
        tell: Function that is called with messages about the workers.

    Raises:
        ArgumentError: Both are given, or one of them is wrong.
        LinkNotFound: No scheduler answers at the address.
        LinkError: The workers do not start, or those of the cluster cannot run the jobs of this elib.
        Unsupported: Dask is not installed.
    """
    if workers is not None and cluster is not None:
        raise ArgumentError(
            "workers and cluster exclude each other", hint="a cluster has its own workers: leave workers out"
        )
    if workers is None and cluster is None:
        yield _Here()
        return
    executor: _Workers
    if cluster is not None:
        executor = _Cluster(cluster, tell)
    else:
        executor = _Pool(Whole(1, MAX_WORKERS).require(workers, "workers"), tell)
    if importlib.util.find_spec("distributed") is None:  # which brings cloudpickle, too
        raise Unsupported("workers need the package distributed (Dask), which is not installed", hint=install("learn"))
    try:
        executor.open()
        yield executor
    finally:
        executor.close()


class _Here(Executor):
    threads = None

    def run(self, function: Callable[..., Any], jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
        for k, job in enumerate(jobs):
            try:
                result = function(*job)
            except Exception as error:
                raise _failed(function, jobs, k, error) from error
            yield k, result


class _Workers(Executor):
    """Runs jobs in other processes, by the futures of a pool of Python or of Dask."""

    def __init__(self, tell: Callable[[str], object]) -> None:
        self._tell = tell
        self._closing = contextlib.ExitStack()

    def close(self) -> None:
        """Close what runs the jobs, and end those under way. Safe to repeat."""
        with contextlib.suppress(Exception):  # what is broken cannot be closed in good order
            self._closing.close()

    def run(self, function: Callable[..., Any], jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
        waiting = deque(range(len(jobs)))
        sent: dict[Future[bytes], int] = {}  # which job, by its future
        deaths: Counter[int] = Counter()
        try:
            while waiting or sent:
                while waiting and len(sent) < AHEAD * self.width:
                    k = waiting.popleft()
                    sent[self._send(_pickled(function, jobs, k))] = k
                for future in self._wait(sent):
                    k = sent.pop(future)
                    result, problem = None, future.exception()
                    if isinstance(problem, BrokenProcessPool):
                        deaths[k] += 1
                        if deaths[k] < MAX_DEATHS:
                            waiting.appendleft(k)
                            continue
                        problem = LinkLost(
                            f"its worker died {MAX_DEATHS} times",
                            hint="does it need more memory than there is? Does it crash Python?",
                        )
                    if problem is None:
                        result, problem = pickle.loads(future.result())
                    if problem is not None:
                        raise _failed(function, jobs, k, problem) from problem
                    yield k, result
        finally:
            for future in sent:
                future.cancel()

    @abstractmethod
    def open(self) -> None:
        """Open what runs the jobs; LinkError if it cannot be used."""

    @abstractmethod
    def _send(self, payload: bytes) -> Future[bytes]:
        """Hand a job over, for :func:`_call`."""

    @abstractmethod
    def _wait(self, sent: Collection[Future[bytes]]) -> Collection[Future[bytes]]:
        """Wait a moment, and return the futures that have ended; LinkLost if nothing runs jobs any more."""


class _Pool(_Workers):
    """Worker processes of this computer. When one dies, all start again."""

    def __init__(self, workers: int, tell: Callable[[str], object]) -> None:
        super().__init__(tell)
        self.width = workers
        self._pool: ProcessPoolExecutor | None = None

    def open(self) -> None:
        context = multiprocessing.get_context("spawn")
        with contextlib.ExitStack() as stack:
            before = {name: os.environ[name] for name in ONE_THREAD.keys() & os.environ.keys()}
            stack.callback(os.environ.update, before)
            for name in ONE_THREAD.keys() - before.keys():
                stack.callback(os.environ.pop, name, None)
            os.environ.update(ONE_THREAD)  # for the workers, which inherit it
            theirs, ours = context.Pipe(duplex=False)
            pool = ProcessPoolExecutor(self.width, context, initializer=_begin, initargs=(theirs,))
            for end in (pool.shutdown, theirs.close, ours.close):  # the last one comes first, and ends the workers
                stack.callback(end)
            try:
                for started in [pool.submit(os.getpid) for _ in range(self.width)]:
                    started.result(START_TIME)
            except Exception as error:
                raise LinkError(
                    f"the workers do not start: {type(error).__name__}: {error}",
                    hint="a program that starts workers does so below the line: if __name__ == '__main__':",
                ) from error
            self._pool, self._closing = pool, stack.pop_all()

    def _send(self, payload: bytes) -> Future[bytes]:
        if self._pool is None:
            self.open()
        assert self._pool is not None
        try:
            return self._pool.submit(_call, payload)
        except BrokenProcessPool as error:
            lost: Future[bytes] = Future()
            lost.set_exception(error)
            return lost

    def _wait(self, sent: Collection[Future[bytes]]) -> Collection[Future[bytes]]:
        done = wait(sent, POLL, FIRST_COMPLETED).done
        if any(isinstance(future.exception(), BrokenProcessPool) for future in done):
            done = wait(sent, START_TIME).done  # a pool that has lost a process ends all jobs
            self._tell("a worker died; the jobs under way run again")
            self.close()
            self._pool = None
        return done


def _begin(line: Connection) -> None:
    """Prepare a worker of this computer: it ends with the program, whose end of the line is closed then."""

    def end_with_the_program() -> None:
        with contextlib.suppress(EOFError, OSError):
            line.recv_bytes()
        os._exit(0)

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program
    os.environ["NUMBA_NUM_THREADS"] = "1"
    threading.Thread(target=end_with_the_program, daemon=True).start()


class _Cluster(_Workers):
    """A Dask cluster, which runs the jobs of a dead worker on another one by itself."""

    def __init__(self, address: str, tell: Callable[[str], object]) -> None:
        super().__init__(tell)
        self._address, self._host = address, _parse(address)

    def open(self) -> None:
        with contextlib.ExitStack() as stack:
            self._client = _join(self._address, self._host, self._tell, stack)
            self._closing = stack.pop_all()
        self._executor = self._client.get_executor(pure=False)
        self._seen = time.monotonic()  # when there was a worker
        self._look()

    def _send(self, payload: bytes) -> Future[bytes]:
        future: Future[bytes] = self._executor.submit(_call, payload)
        return future

    def _wait(self, sent: Collection[Future[bytes]]) -> Collection[Future[bytes]]:
        done = wait(sent, POLL, FIRST_COMPLETED).done
        if any(future.cancelled() or isinstance(future.exception(), asyncio.CancelledError) for future in done):
            raise LinkLost("the connection to the scheduler is lost", hint=AGAIN)
        self._look()
        return done

    def _look(self) -> None:
        """Look how many workers there are, and do not wait for them without an end."""
        with contextlib.suppress(Exception):  # Dask raises several
            threads = self._client.sync(self._client.scheduler.ncores, callback_timeout=ANSWER_TIME)
            self.width = sum(map(int, threads.values())) or self.width
            if threads:
                self._seen = time.monotonic()
        if time.monotonic() - self._seen >= PATIENCE:
            raise LinkLost(f"{self._address} has had no workers for {PATIENCE:.0f} s", hint=AGAIN)


def _pickled(function: Callable[..., Any], jobs: Sequence[Job], k: int) -> bytes:
    """Return a job for :func:`_call`."""
    import cloudpickle

    try:
        return bytes(cloudpickle.dumps((function, jobs[k])))
    except Exception as error:
        raise _failed(function, jobs, k, error) from error


def _call(payload: bytes) -> bytes:
    """Do a job on a worker, and return its result and its error, pickled: an error that Dask raises is then its own."""
    import cloudpickle

    try:
        function, job = pickle.loads(payload)
        return bytes(cloudpickle.dumps((function(*job), None)))
    except BaseException as error:  # SystemExit would end the worker
        error.add_note(f"On the worker:\n{traceback.format_exc().rstrip()}")
        try:
            answer = bytes(cloudpickle.dumps((None, error)))
            pickle.loads(answer)
        except Exception:
            answer = pickle.dumps((None, RuntimeError(f"{type(error).__name__}: {error}")))
        return answer


def _failed(function: Callable[..., Any], jobs: Sequence[Job], k: int, error: BaseException) -> ElibError:
    """Return the error that ends a run, which names the job."""
    name = getattr(function, "__name__", "the function")
    job = f"job {k} of {len(jobs)}, {name}({', '.join(map(reprlib.repr, jobs[k]))}), failed"
    if isinstance(error, ElibError):
        return about(job, error)
    return ElibError(f"{job}: {type(error).__name__}: {error}")


def _parse(address: str) -> tuple[str, int]:
    """Return host and port of a scheduler."""
    with contextlib.suppress(ValueError):  # the port is not a number
        url = urlsplit(address)
        if url.scheme in ("tcp", "tls") and url.hostname:
            return url.hostname, url.port or PORT
    raise ArgumentError(
        f"cluster is {address!r}; it must be the address of a Dask scheduler", hint=f"such as tcp://{LOOPBACK}:{PORT}"
    )


def _join(address: str, host: tuple[str, int], tell: Callable[[str], object], stack: contextlib.ExitStack) -> Any:
    """Connect to a cluster that runs already, and return the client."""
    import distributed
    from distributed.utils import silence_logging_cmgr

    stack.enter_context(silence_logging_cmgr(logging.CRITICAL))  # it reports a lost connection at length
    try:
        # Dask itself waits for a scheduler as long as for one that it has lost.
        with socket.create_connection(host, ANSWER_TIME) as line:
            # Its first message begins with its length, which is small, unlike the text of other servers. Over TLS the
            # client speaks first.
            if address.startswith("tcp:") and not line.recv(8).endswith(bytes(5)):
                raise OSError("what answers is not a Dask scheduler")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it compares versions, and so does _check_versions
            client = distributed.Client(address, timeout=START_TIME, set_as_default=False)
    except Exception as error:
        raise LinkNotFound(
            f"no Dask scheduler answers at {address}: {error}",
            hint="start one with: dask scheduler --host ADDRESS --port 8786",
        ) from error
    stack.callback(client.close, timeout=ANSWER_TIME)
    try:
        client.wait_for_workers(1, timeout=ANSWER_TIME)
        _check_versions(address, client, tell)
    except LinkError:
        raise
    except Exception as error:
        raise LinkError(
            f"no worker of {address} answers", hint=f"start one on each computer with: dask worker {address}"
        ) from error
    return client


def _check_versions(address: str, client: Any, tell: Callable[[str], object]) -> None:
    """Check that the workers can run what this elib sends."""

    def require(who: str, name: str, theirs: str, ours: str) -> None:
        if theirs != ours:
            raise LinkError(
                f"{who} at {address} has {name} {theirs}, and this computer has {ours}",
                hint="install the same versions everywhere",
            )

    found = client.get_versions()
    for who, answer in {"the scheduler": found["scheduler"], **found["workers"]}.items():
        packages = answer["packages"]
        require(who, "Python", _minor(packages["python"]), _minor(platform.python_version()))
        require(who, "Dask", packages["distributed"], importlib.metadata.version("distributed"))
    here = describe()
    for who, there in client.run(describe, on_error="return").items():
        if not isinstance(there, dict):
            raise LinkError(
                f"{who} at {address} cannot run elib: {there}",
                hint="install the same elib there, with its extra learn",
            )
        require(who, "elib", there["elib"], here["elib"])
        different = [f"{name} {there[name]} instead of {ours}" for name, ours in here.items() if there[name] != ours]
        if different:
            tell(f"{who} has {', '.join(different)}: results may differ in their last digits")


def describe() -> dict[str, str]:
    """Return what the results on a computer depend on."""
    return {"elib": elib.__version__, "machine": platform.machine(), **versions_of("numpy", "numba")}


def versions_of(*packages: str) -> dict[str, str]:
    """Return the versions of those packages that are installed."""
    found = {}
    for package in packages:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found[package] = importlib.metadata.version(package)
    return found


def _minor(version: str) -> str:
    return ".".join(version.split(".")[:2])
