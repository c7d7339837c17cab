"""pytest fixtures and options, found by pytest where elib is installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from elib.emulator.weatherfile import gallery

if TYPE_CHECKING:
    from elib.testing.bench import Bench


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--robot URL``: the robot that hardware tests drive."""
    parser.getgroup("elib").addoption("--robot", metavar="URL", default=None, help="run hardware tests on this robot")


@pytest.fixture
def robot_url(request: pytest.FixtureRequest) -> str:
    """Return the URL given with ``--robot``; without one the test is skipped."""
    url = request.config.getoption("--robot")
    if url is None:
        pytest.skip("needs a robot: pytest --robot serial:///dev/rfcomm0")
    return str(url)


@pytest.fixture
def bench() -> Callable[..., Bench]:
    """Return a maker of freshly powered emulated robots: ``bench("btcom-2.0", state)``."""
    from elib.testing.bench import Bench

    return Bench


@pytest.fixture(params=gallery())
def bad_weather(request: pytest.FixtureRequest) -> str:
    """Return the URL of a virtual robot in bad weather; the test runs once in each that comes with elib.

    To choose, or to use files of your own::

        @pytest.mark.parametrize("bad_weather", ["flaky-bluetooth", "storm.toml"], indirect=True)
    """
    from elib.testing.weather import weather

    return weather(request.param)
