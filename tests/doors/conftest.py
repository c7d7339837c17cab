"""What the tests of the doors share with those of the page: the loop on which a file's tests run."""

from local_network import pytest_asyncio_loop_factories as pytest_asyncio_loop_factories
