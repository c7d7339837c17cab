"""The wheel holds all that elib reads when it runs, and says the version that elib says."""

import os
import subprocess
import sys
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

import elib
from elib.base.files import PAGE
from shared import needs_page

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    alone = os.environ | {"ELIB_NO_PAGE": "1"}  # with the page as it is
    subprocess.run(command, cwd=ROOT, env=alone, check=True, capture_output=True, timeout=120)
    return zipfile.ZipFile(next(folder.glob("*.whl")))


def test_every_file_of_the_package_is_in_the_wheel(wheel: zipfile.ZipFile) -> None:
    source = ROOT / "src"
    files = {path.relative_to(source).as_posix() for path in (source / "elib").rglob("*") if path.is_file()}
    packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    guides = {f"elib/guides/{path.name}" for path in (ROOT / "docs/guides").iterdir()}
    assert packed == guides | {name for name in files if "/__pycache__/" not in name}
    assert packed >= {
        "elib/py.typed",
        "elib/simulator/worlds/arena.toml",
        "elib/simulator/faults/flaky-bluetooth.toml",
    }


@needs_page
def test_the_wheel_holds_the_built_page_and_nothing_that_it_is_built_from(wheel: zipfile.ZipFile) -> None:
    names = set(wheel.namelist())
    assert names >= {f"elib/{PAGE}/index.html", f"elib/{PAGE}/login.html"}
    assert not [name for name in names if name.endswith((".ts", ".tsx", ".mjs")) or "node_modules" in name]


def test_the_version_stands_in_one_place(wheel: zipfile.ZipFile) -> None:
    (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    metadata = Parser().parsestr(wheel.read(name).decode())
    assert metadata["Version"] == elib.__version__
    assert metadata["License-Expression"] == "MIT"
    assert f'__version__ = "{elib.__version__}"' in (ROOT / "src/elib/__init__.py").read_text()
    assert elib.__version__ not in (ROOT / "pyproject.toml").read_text()
