"""Settings that hold for all tests."""

import os
import random
import signal
from collections import Counter
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# No test fails for a machine that is busy with something else.
settings.register_profile("elib", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("seed", settings.get_profile("elib"), derandomize=False)
settings.load_profile("elib")

os.environ.pop("ELIB_ROBOT", None)  # no test drives the robot of the one who runs it

# What Numba compiles is kept in one place, for all processes of the tests and for the next run.
os.environ["XDG_CACHE_HOME"] = str(Path(__file__).parent.parent / ".cache")


def pytest_configure(config: pytest.Config) -> None:
    """Draw other examples for another ``--hypothesis-seed``; without it, each run is the same."""
    if config.getoption("--hypothesis-seed") is not None:
        settings.load_profile("seed")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the tests of the physics first, or run the files in the order of a seed: no test may need an earlier one.

    Of two processes, one then compiles the kernels while the other one has tests that need none.
    """
    seed = config.getoption("--hypothesis-seed")
    if seed is None:
        items.sort(key=lambda item: item.path.parent.name != "physics")
    else:
        files = sorted({item.path for item in items})
        random.Random(str(seed)).shuffle(files)
        items.sort(key=lambda item: files.index(item.path))


@pytest.hookimpl(wrapper=True, optionalhook=True)
def pytest_xdist_auto_num_workers() -> Generator[None, int, int]:
    """Run one process more than there are cores: many tests wait, for a process, a page or a robot in real time."""
    return (yield) + 1


def is_quick_lane(config: pytest.Config) -> bool:
    """Return whether `make test` runs, without the long forms."""
    return bool(config.option.markexpr == "not long")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give a test few random examples in the quick lane, or many: the many prove what the few do."""
    mark = metafunc.definition.get_closest_marker("examples")
    if mark is not None:
        few, many = mark.args
        case = few if is_quick_lane(metafunc.config) else pytest.param(many, marks=pytest.mark.long)
        metafunc.parametrize("examples", [case])


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let signals end what a test starts, also where the tests run in the background of a shell, which ignores some."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if name == "SIGINT" else signal.SIG_DFL)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say in one line what was not tried, and how to get it."""
    skipped = terminalreporter.stats.get("skipped", ())
    reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in skipped)
    parts = ["the long forms (make test-all)"] if is_quick_lane(config) else []
    parts += [f"{count} {'test' if count == 1 else 'tests'} ({reason})" for reason, count in sorted(reasons.items())]
    if parts:
        terminalreporter.write_line(f"Not tried: {'; '.join(parts)}")
