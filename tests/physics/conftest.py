"""The engines of the tests, and what is compiled for them: three sets, each by one process for all."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from world_rig import ENGINES, compile_episodes, compile_threads, compile_worlds

from elib.simulator.physics.engine import _cache_folder, engine_named

shared: set[object] = set()
"""What the three sets compiled in this process."""


@contextmanager
def one_process_at_a_time(path: Path) -> Iterator[None]:
    """Let other processes of the tests wait until this one is done; they then find its compiled code."""
    try:
        import fcntl
    except ImportError:  # On Windows both compile.
        yield
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def compiled() -> set[object]:
    """Return the kernels that this process compiled, or found compiled, and for which use."""
    if "numba" not in sys.modules:
        return set()
    return {key for key, ready in engine_named("compiled")._dispatchers.items() if ready.signatures}


def compile_set(make: Callable[[], None]) -> None:
    with one_process_at_a_time(_cache_folder() / "tests.lock"):
        make()
    shared.update(compiled())


@pytest.fixture(scope="session")
def compiled_worlds() -> None:
    """Compiled worlds in one thread, with all sensors."""
    compile_set(compile_worlds)


@pytest.fixture(scope="session")
def compiled_threads() -> None:
    """Compiled readings in two threads."""
    compile_set(compile_threads)


@pytest.fixture(scope="session")
def compiled_episodes() -> None:
    """Compiled steered episodes."""
    compile_set(compile_episodes)


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    """Each engine."""
    name: str = request.param
    return name


@pytest.fixture
def own_kernel() -> None:
    """Allow a quick test to compile something for itself alone: it is tiny."""


@pytest.fixture(autouse=True)
def nothing_else_is_compiled(request: pytest.FixtureRequest) -> Iterator[None]:
    """Keep the quick tests to what is compiled once for all of them."""
    is_long = request.node.get_closest_marker("long")
    parameters = request.node.callspec.params if "callspec" in vars(request.node) else {}
    if parameters.get("engine") == "compiled" and not is_long:
        request.getfixturevalue("compiled_worlds")
    before = compiled()
    yield
    if not is_long and "own_kernel" not in request.fixturenames:
        more = compiled() - before - shared
        assert not more, f"it compiles for itself, which is slow; use one of the sets, or mark it as long: {more}"
