"""``make studio``: what it puts into the folder, and what it says where something cannot be fetched."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from shared import PATIENCE

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]
NOT_BUILT = 3


def build(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "release/studio.py"), *map(str, arguments)]
    environ = {**os.environ, **environment}
    return subprocess.run(command, env=environ, capture_output=True, text=True, timeout=5 * PATIENCE, check=False)


def test_elib_is_in_it_without_what_a_page_cannot_use_and_a_wheel_that_was_given(tmp_path: Path) -> None:
    (tmp_path / "wheels").mkdir()
    (tmp_path / "wheels/more-1.0-py3-none-any.whl").write_bytes(b"a wheel")
    done = build("--to", tmp_path / "studio", "--wheels", tmp_path / "wheels")
    if done.returncode == NOT_BUILT:
        pytest.skip(done.stderr.splitlines()[0])
    assert done.returncode == 0, done.stderr
    assert " MB, compressed " in done.stdout
    found = {path.name for path in (tmp_path / "studio").iterdir()}
    assert {"index.html", "known.json", "pyodide.asm.wasm", "service.js", "worker.js"} <= found
    scripts = "".join(path.read_text(encoding="utf-8") for path in (tmp_path / "studio").glob("*.js"))
    assert scripts.count('"more-1.0-py3-none-any.whl"') == 2  # what Python loads, and what is kept
    names = zipfile.ZipFile(next((tmp_path / "studio").glob("elib_epuck-*.whl"))).namelist()
    assert {"elib/studio/worker.py", "elib/lab/labs/square/lab.toml", "elib/simulator/worlds/arena.toml"} <= {*names}
    assert [name for name in names if name.startswith(("elib/cli/", "elib/learn/", "elib/doors/"))] == []


def test_without_the_wheel_it_says_so_and_leaves_what_was_there(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text("older")
    done = build("--to", tmp_path, PIP_NO_INDEX="1", PIP_FIND_LINKS="", PIP_CONFIG_FILE=os.devnull)
    assert done.returncode == NOT_BUILT, done.stderr
    assert "is not built: " in done.stderr.splitlines()[0]
    assert "Traceback" not in done.stderr
    assert (tmp_path / "index.html").read_text() == "older"
