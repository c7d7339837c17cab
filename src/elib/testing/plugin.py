"""pytest fixtures and options, found by pytest where elib is installed.

Their names begin with elib: a project may have fixtures and options of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from elib.testing.bench import Bench

BAD_WEATHER = "elib_bad_weather"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--elib-robot URL``: the robot that hardware tests drive."""
    parser.getgroup("elib").addoption(
        "--elib-robot", metavar="URL", default=None, help="run hardware tests on this robot"
    )


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test with the fixture ``elib_bad_weather`` once in each weather, unless it says in which."""
    chosen = [marker.args[0] for marker in metafunc.definition.iter_markers("parametrize") if marker.args]
    if BAD_WEATHER in metafunc.fixturenames and not any(BAD_WEATHER in names for names in chosen):
        from elib.emulator.weatherfile import gallery

        metafunc.parametrize(BAD_WEATHER, gallery(), indirect=True)


@pytest.fixture
def elib_robot_url(request: pytest.FixtureRequest) -> str:
    """Return the URL given with ``--elib-robot``; without one the test is skipped."""
    url = request.config.getoption("--elib-robot")
    if url is None:
        pytest.skip("needs a robot: pytest --elib-robot serial:///dev/rfcomm0")
    return str(url)


@pytest.fixture
def elib_bench() -> Callable[..., Bench]:
    """Return a maker of freshly powered emulated robots: ``elib_bench("btcom-2.0", state)``."""
    from elib.testing.bench import Bench

    return Bench


@pytest.fixture
def elib_bad_weather(request: pytest.FixtureRequest) -> str:
    """Return the URL of a virtual robot in bad weather; the test runs once in each that comes with elib.

    To choose, or to use files of your own::

        @pytest.mark.parametrize("elib_bad_weather", ["flaky-bluetooth", "storm.toml"], indirect=True)
    """
    from elib.testing.weather import weather

    return weather(request.param)
