"""Run jobs here, in worker processes of this computer, or on a Dask cluster: the same code for all of them.

A worker may die at any time, and the connection to the scheduler may break: the jobs that were lost run again. So a
job must be a function whose only effect is its result. An error of a job itself ends the run.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import logging
import os
import pickle
import platform
import queue
import reprlib
import signal
import socket
import sys
import threading
import time
import traceback
import uuid
import warnings
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any
from urllib.parse import urlsplit

import elib
from elib.base.errors import ArgumentError, ElibError, LinkError, LinkLost, LinkNotFound, Unsupported, about
from elib.base.extras import install
from elib.base.plaintext import plain
from elib.base.rules import Whole

LOOPBACK = "127.0.0.1"
PORT = 8786
"""The port of a Dask scheduler, unless another one is named."""
MAX_GREETING = 1_000_000
"""Bytes of the first message of a scheduler, by far: it has some hundred."""
POLL = 1.0
"""s between two looks at a cluster from which no result comes."""
ANSWER_TIME = 5.0
"""s that a scheduler has to answer."""
START_TIME = 60.0
"""s that the workers have to start, and to import elib. On a busy computer this took 20 s."""
PATIENCE = 600.0
"""s without any worker, or without the scheduler, after which a run gives up. A computer restarts in this time."""
REPORT_INTERVAL = 30.0
"""s without any worker after which elib says so, and opens the cluster again. A worker that died is replaced in 3 s."""
MAX_LOSSES = 10
"""How often Dask may give a job up before elib does. Dask gives it up when its fourth worker has died
(``distributed.scheduler.allowed-failures``); after forty workers it is the job that kills them."""
MAX_WORKERS = 1000
AHEAD = 2
"""Jobs at the cluster for each thread of its workers: a worker that has ended one begins the next at once."""
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)
"""The environment of workers: there is one for each core, and more threads would only disturb each other."""

Job = tuple[Any, ...]


def print_message(text: str) -> None:
    """Print a message on stderr."""
    print(plain(text), file=sys.stderr, flush=True)


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
            LinkLost: There was no worker, or no scheduler, for a long time.
        """


@contextlib.contextmanager
def open_executor(
    workers: int | None = None, cluster: str | None = None, *, tell: Callable[[str], object] = print_message
) -> Iterator[Executor]:
    """Open what runs the jobs: this process, if neither workers nor a cluster are named.

    Args:
        workers: Start this many worker processes on this computer. They listen on 127.0.0.1 only, and end with this
            process.
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
    if workers is not None:
        workers = Whole(1, MAX_WORKERS).require(workers, "workers")
    if cluster is not None:
        _parse(cluster)
    if workers is None and cluster is None:
        yield _Here()
        return
    try:
        from distributed.utils import silence_logging_cmgr
    except ImportError:
        raise Unsupported(
            "workers need the package distributed (Dask), which is not installed", hint=install("learn")
        ) from None
    connect = partial(_start_workers, workers or 1) if cluster is None else partial(_join, cluster, tell)
    executor = _Dask(connect, tell)
    with silence_logging_cmgr(logging.CRITICAL):  # Dask reports every worker that dies, at length
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


class _Dask(Executor):
    """The client of a cluster, which is opened again if it is lost.

    Args:
        connect: Function that opens the cluster and returns its client; what is to be closed goes on the stack.
        tell: Function that is called with messages.
    """

    def __init__(self, connect: Callable[[contextlib.ExitStack], Any], tell: Callable[[str], object]) -> None:
        self._connect = connect
        self._tell = tell
        self._closing = contextlib.ExitStack()
        self._client: Any = None
        self._trouble = "the scheduler does not answer"
        self._idle_since = self._reported = 0.0

    def open(self) -> None:
        """Open the cluster.

        Raises:
            LinkError: The cluster cannot be used.
        """
        with contextlib.ExitStack() as stack:
            self._client = self._connect(stack)
            self._closing = stack.pop_all()
        self._count_threads()

    def close(self) -> None:
        """Close the cluster. Safe to repeat."""
        self._client = None
        with contextlib.suppress(Exception):  # what is broken cannot be closed in good order
            self._closing.close()

    def run(self, function: Callable[..., Any], jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
        run = _Run(function, jobs, self._tell)
        self._idle_since = self._reported = time.monotonic()
        try:
            while run.is_unfinished:
                if self._client is None:
                    run.take_back()
                    threading.Event().wait(POLL)
                    try:
                        self.open()
                    except LinkError as error:
                        self._trouble = error.message
                else:
                    run.send(self._client, AHEAD * self.width)
                    found = run.take()
                    if found is not None:
                        yield found
                    if run.is_cut_off or self._client.status != "running":
                        self._tell("the connection to the scheduler is lost; the jobs that it had run again")
                        self.close()
                self._look()
        finally:
            run.take_back()

    def _count_threads(self) -> int | None:
        """Return how many threads all workers have; None if the scheduler does not say it."""
        if self._client is None:
            return None
        try:
            threads = self._client.sync(self._client.scheduler.ncores, callback_timeout=ANSWER_TIME)
        except Exception:  # Dask raises several
            return None
        count = sum(map(int, threads.values()))
        self.width = count or self.width
        return count

    def _look(self) -> None:
        """Look whether there is a worker. Tell now and then that there is none; open the cluster again after a while.

        Raises:
            LinkLost: There was none for too long.
        """
        now = time.monotonic()
        threads = self._count_threads()
        if threads:
            self._idle_since = self._reported = now
            return
        idle = now - self._idle_since
        why = "there are no workers" if threads == 0 else self._trouble
        if idle >= PATIENCE:
            raise LinkLost(f"{why}, for {idle:.0f} s now", hint="start the workers, and then the same command again")
        if now - self._reported >= REPORT_INTERVAL:
            self._reported = now
            self._tell(f"{why}, for {idle:.0f} s now; elib gives up after {PATIENCE:.0f} s")
            self.close()


class _Run:
    """The jobs of one call: those that wait, and those that are at the cluster.

    Attributes:
        is_cut_off: Whether the client is of no use any more.
    """

    def __init__(self, function: Callable[..., Any], jobs: Sequence[Job], tell: Callable[[str], object]) -> None:
        self.is_cut_off = False
        self._function = function
        self._jobs = jobs
        self._tell = tell
        self._waiting = deque(range(len(jobs)))
        self._sent: dict[int, Any] = {}
        self._ended: queue.SimpleQueue[tuple[int, Any]] = queue.SimpleQueue()
        self._losses: Counter[int] = Counter()

    @property
    def is_unfinished(self) -> bool:
        """Whether a job has no result yet."""
        return bool(self._waiting or self._sent)

    def send(self, client: Any, most: int) -> None:
        """Send jobs to the cluster, until it has *most* of them."""
        import cloudpickle

        self.is_cut_off = False
        while self._waiting and len(self._sent) < most:
            k = self._waiting[0]
            try:
                payload = cloudpickle.dumps((self._function, self._jobs[k]))
            except Exception as error:
                raise _failed(self._function, self._jobs, k, error) from error
            try:
                future = client.submit(_call, payload, key=f"elib-{uuid.uuid4().hex}", pure=False)
                future.add_done_callback(lambda future, k=k: self._ended.put((k, future)))
            except Exception:  # Dask raises several, if the connection is lost
                self.is_cut_off = True
                return
            self._sent[k] = future
            self._waiting.popleft()

    def take(self) -> tuple[int, Any] | None:
        """Wait for a result, and return it with the index of its job; None if there is none yet.

        Raises:
            ElibError: A job failed.
        """
        try:
            k, future = self._ended.get(timeout=POLL)
        except queue.Empty:
            return None
        if k not in self._sent or self._sent[k] is not future:
            return None  # it was taken back
        del self._sent[k]
        self._waiting.appendleft(k)
        if future.status == "error":
            self._count_loss(k, future)
        elif future.status == "cancelled":
            self.is_cut_off = True
        else:
            try:
                answer = future.result(timeout=START_TIME)
            except Exception:  # the worker died with the result
                return None
            result, error = pickle.loads(answer)
            if error is not None:
                raise _failed(self._function, self._jobs, k, error) from error
            self._waiting.popleft()
            return k, result
        return None

    def take_back(self) -> None:
        """Let all jobs that are at the cluster wait again."""
        self._waiting.extendleft(sorted(self._sent, reverse=True))
        for future in self._sent.values():
            with contextlib.suppress(Exception):
                future.release()
        self._sent.clear()

    def _count_loss(self, k: int, future: Any) -> None:
        """Count that Dask gave a job up.

        Raises:
            ElibError: It did so too often, or for another reason than that workers died.
        """
        from distributed.scheduler import KilledWorker

        try:
            error = future.exception(timeout=ANSWER_TIME)
        except Exception:  # the connection broke meanwhile: the job runs again
            return
        if not isinstance(error, KilledWorker):
            raise _failed(self._function, self._jobs, k, error) from error
        self._losses[k] += 1
        if self._losses[k] >= MAX_LOSSES:
            reason = LinkLost(
                f"its worker died {MAX_LOSSES * (error.allowed_failures + 1)} times",
                hint="does it need more memory than there is? Does it crash Python?",
            )
            raise _failed(self._function, self._jobs, k, reason) from error
        self._tell(f"job {k} of {len(self._jobs)} lost its worker {error.allowed_failures + 1} times; it runs again")


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


def _start_workers(workers: int, stack: contextlib.ExitStack) -> Any:
    """Start workers on this computer, and return the client."""
    import dask
    import distributed

    before = {name: os.environ.get(name) for name in ONE_THREAD}
    stack.callback(_restore, before)  # Dask sets them in this process too
    # A worker that takes longer than this to come back would be given up: on a busy computer 15 s are not enough.
    stack.enter_context(dask.config.set({"distributed.deploy.lost-worker-timeout": "1 hour"}))
    try:
        cluster = distributed.LocalCluster(
            n_workers=0,  # they come below: what interrupts their start closes the cluster in good order
            threads_per_worker=1,
            processes=True,
            host=LOOPBACK,
            scheduler_kwargs={"dashboard": False, "dashboard_address": f"{LOOPBACK}:0"},
            silence_logs=logging.CRITICAL,
            memory_limit=0,
            preload=[__name__],
            env=ONE_THREAD | {"NUMBA_NUM_THREADS": "1"},
        )
        stack.callback(cluster.close, timeout=START_TIME)
        client = distributed.Client(cluster.scheduler_address, timeout=START_TIME, set_as_default=False)
        stack.callback(client.close, timeout=ANSWER_TIME)
        cluster.scale(workers)
        client.wait_for_workers(workers, timeout=START_TIME)
    except Exception as error:
        raise LinkError(
            f"the workers do not start: {type(error).__name__}: {error}",
            hint="a program that starts workers does so below the line: if __name__ == '__main__':",
        ) from error
    return client


def dask_setup(worker: object) -> None:
    """Prepare a worker of this computer; Dask looks for this name. Ctrl-C is for the program that started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _restore(environment: Mapping[str, str | None]) -> None:
    for name, value in environment.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


def _parse(address: str) -> tuple[str, str, int]:
    """Return scheme, host and port of a scheduler.

    Raises:
        ArgumentError: It is not the address of one.
    """
    try:
        url = urlsplit(address)
        if url.scheme in ("tcp", "tls") and url.hostname:
            return url.scheme, url.hostname, url.port or PORT
    except ValueError:  # the port is not a number
        pass
    raise ArgumentError(
        f"cluster is {address!r}; it must be the address of a Dask scheduler", hint=f"such as tcp://{LOOPBACK}:{PORT}"
    )


def _knock(address: str) -> None:
    """Check that a scheduler answers: Dask itself would wait for ever for a computer that is connected and silent.

    Raises:
        OSError: It does not answer, or something else does.
    """
    scheme, host, port = _parse(address)
    with socket.create_connection((host, port), ANSWER_TIME) as line:
        if scheme == "tcp":  # over TLS the client speaks first
            # A message of Dask begins with its length. It is small, unlike the text that other servers send.
            length = line.recv(8)
            if len(length) < 8 or int.from_bytes(length, "little") > MAX_GREETING:
                raise OSError("what answers is not a Dask scheduler")


def _join(address: str, tell: Callable[[str], object], stack: contextlib.ExitStack) -> Any:
    """Connect to a cluster that runs already, and return the client."""
    import distributed

    try:
        _knock(address)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it compares versions, and so does _check_versions
            client = distributed.Client(address, timeout=ANSWER_TIME, set_as_default=False)
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
    """Check that the workers can run what this elib sends.

    Raises:
        LinkError: They have another Python, Dask or elib.
    """
    ask = partial(client.sync, callback_timeout=START_TIME)
    answers = ask(client.scheduler.broadcast, msg={"op": "versions", "packages": []}, on_error="ignore")
    answers = {"the scheduler": ask(client.scheduler.versions), **answers}
    for who, answer in answers.items():
        packages = answer["packages"]
        for name, theirs, ours in (
            ("Python", _minor(packages["python"]), _minor(platform.python_version())),
            ("Dask", packages["distributed"], importlib.metadata.version("distributed")),
        ):
            if theirs != ours:
                raise LinkError(
                    f"{who} at {address} has {name} {theirs}, and this computer has {ours}",
                    hint="install the same versions everywhere",
                )
    here = describe()
    for who, there in client.run(describe, on_error="return").items():
        if not isinstance(there, dict):
            raise LinkError(
                f"{who} at {address} cannot run elib: {there}",
                hint="install the same elib there, with its extra learn",
            )
        if there["elib"] != here["elib"]:
            raise LinkError(
                f"{who} at {address} has elib {there['elib']}, and this computer has {here['elib']}",
                hint="install the same version everywhere",
            )
        different = [
            f"{name} {there.get(name)} instead of {here[name]}" for name in here if there.get(name) != here[name]
        ]
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
