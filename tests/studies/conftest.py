from pathlib import Path

import pytest
from parity_drives import Hidden, drive, hidden_robot


@pytest.fixture(scope="session")
def hidden(tmp_path_factory: pytest.TempPathFactory) -> Hidden:
    """A recording of a minute of a robot that is not nominal."""
    return hidden_robot(tmp_path_factory.mktemp("hidden"), 11, duration=60)


@pytest.fixture(scope="session")
def nominal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a third of a minute of a nominal robot."""
    return drive(
        "sim://square?speed=max&quality=ideal&seed=4", tmp_path_factory.mktemp("nominal") / "nominal.mcap", duration=20
    )
