"""What tests of several files of this folder are given."""

import pytest
from served_rig import seen

from elib.testing import EmulatedRobot

__all__ = ["seen"]


@pytest.fixture
def bench(firmware: str) -> EmulatedRobot:
    """An emulated robot with the *firmware* of the test's case."""
    return EmulatedRobot(firmware)
