"""Fixtures and options of elib's pytest plugin, which pytest finds where elib is installed.

Their names begin with elib, because a project may have fixtures and options of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from elib.testing import EmulatedRobot

LINK_FAULTS = "elib_link_faults"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--elib-robot URL``: the robot that hardware tests drive."""
    parser.getgroup("elib").addoption(
        "--elib-robot", metavar="URL", default=None, help="run hardware tests on this robot"
    )


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test with the fixture ``elib_link_faults`` once under each fault script, unless it names its own."""
    chosen = [marker.args[0] for marker in metafunc.definition.iter_markers("parametrize") if marker.args]
    if LINK_FAULTS in metafunc.fixturenames and not any(LINK_FAULTS in names for names in chosen):
        from elib.simulator.emulator.faultscript import gallery

        metafunc.parametrize(LINK_FAULTS, gallery(), indirect=True)


@pytest.fixture
def elib_robot_url(request: pytest.FixtureRequest) -> str:
    """Return the URL given with ``--elib-robot``; without one the test is skipped."""
    url = request.config.getoption("--elib-robot")
    if url is None:
        pytest.skip("needs a robot: pytest --elib-robot serial:///dev/rfcomm0")
    return str(url)


@pytest.fixture
def elib_emulated_robot() -> Callable[..., EmulatedRobot]:
    """Return the class :class:`elib.testing.EmulatedRobot`: ``elib_emulated_robot("btcom-2.0", state)``."""
    from elib.testing import EmulatedRobot

    return EmulatedRobot


@pytest.fixture
def elib_link_faults(request: pytest.FixtureRequest) -> str:
    """Return the URL of a virtual robot under a fault script; the test runs once under each that comes with elib.

    To choose scripts, or to use files of your own::

        @pytest.mark.parametrize("elib_link_faults", ["flaky-bluetooth", "storm.toml"], indirect=True)
    """
    from elib.testing import with_faults

    return with_faults(request.param)
