import pytest
from world_rig import ENGINES


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    """Each engine; the compiled one if Numba is installed."""
    if request.param == "compiled":
        pytest.importorskip("numba")
    name: str = request.param
    return name
