"""What the tests of the doors share with those of the page: the loop on which a file's tests run."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "panel"))

from local_network import pytest_asyncio_loop_factories as pytest_asyncio_loop_factories
