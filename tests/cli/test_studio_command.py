"""``elib studio``: it serves a folder that was built, to this computer alone."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from pathlib import Path
from urllib.request import urlopen

import pytest
from elib_process import PATIENCE, started

from elib.cli import studio


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
def test_the_folder_is_served_until_ctrl_c_with_the_types_that_browsers_ask_for(tmp_path: Path) -> None:
    for name in ("index.html", "worker.js", "pyodide.asm.wasm", "pyodide.asm.mjs"):
        (tmp_path / name).write_text(name)
    with started("studio", str(tmp_path), "--port", "0", "--no-browser") as server:
        url = server.out.line().strip()
        assert url.startswith("http://127.0.0.1:")
        with urlopen(url, timeout=PATIENCE) as answer:
            assert answer.read() == b"index.html"
        for name, kind in (
            ("worker.js", "text/javascript"),
            ("pyodide.asm.mjs", "text/javascript"),
            ("pyodide.asm.wasm", "application/wasm"),
        ):
            with urlopen(url + name, timeout=PATIENCE) as answer:
                assert answer.headers["Content-Type"] == kind
        assert server.end(signal.SIGINT) == 0
        assert server.err.rest() == ""


def test_where_it_is_not_built_it_says_how(
    refused: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(studio, "STUDIO", tmp_path)
    assert "make studio" in refused("studio", "--no-browser")
    assert "make studio" in refused("studio", tmp_path / "not-there", "--no-browser")
