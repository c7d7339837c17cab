"""The hint for a missing extra: a command for this Python, with what elib was installed from."""

import importlib.metadata
import importlib.util
import json
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

import elib
from elib.base import extras
from elib.base.extras import install, page_folder

REQUIRES = ["numpy>=2.2", 'matplotlib>=3.10; extra == "plot"', 'aiohttp>=3.14; extra == "web"']
REQUIRES += ["msgspec>=0.20; sys_platform != \"none\" and extra == 'web'"]


class Installed:
    """Stands for elib as an installer left it."""

    requires = REQUIRES

    def __init__(self, direct: dict[str, Any] | None) -> None:
        self.direct = direct

    def read_text(self, name: str) -> str | None:
        assert name == "direct_url.json"
        return None if self.direct is None else json.dumps(self.direct)


@pytest.fixture
def as_installed(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(shutil, "which", {"pip": str(Path(sys.executable).parent / "pip")}.get)

    def set_to(direct: dict[str, Any] | None) -> None:
        monkeypatch.setattr(importlib.metadata, "distribution", lambda name: Installed(direct))

    return set_to


def test_from_a_folder_that_is_edited(as_installed, tmp_path: Path):
    as_installed({"url": tmp_path.as_uri(), "dir_info": {"editable": True}})
    assert install("plot") == f'install the extra plot: pip install -e "{tmp_path}[plot]"'


def test_from_a_folder(as_installed, tmp_path: Path):
    folder = tmp_path / "my robots"
    folder.mkdir()
    as_installed({"url": folder.as_uri(), "dir_info": {}})
    assert install("plot") == f'install the extra plot: pip install "{folder}[plot]"'


def test_from_a_wheel_that_is_still_there(as_installed, tmp_path: Path):
    wheel = tmp_path / "elib_epuck-1.0-py3-none-any.whl"
    wheel.touch()
    as_installed({"url": wheel.as_uri(), "archive_info": {}})
    assert install("web") == f'install the extra web: pip install "{wheel}[web]"'


@pytest.mark.parametrize("direct", [{"url": "file:///gone/elib.whl", "archive_info": {}}, None])
def test_where_the_files_are_gone_or_unknown_the_packages_are_named(as_installed, direct: dict[str, Any] | None):
    as_installed(direct)
    assert install("web") == 'install the extra web: pip install "aiohttp>=3.14" "msgspec>=0.20"'


def test_from_a_source_tree_that_is_not_installed(monkeypatch: pytest.MonkeyPatch, as_installed):
    def missing(name: str) -> None:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "distribution", missing)
    assert install("plot") == f'install the extra plot: pip install -e "{Path(__file__).parents[2]}[plot]"'


@pytest.mark.parametrize("is_checkout", [True, False])
def test_a_page_that_is_not_built_says_how_to_get_it(
    is_checkout: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    if is_checkout:
        tmp_path.joinpath("page").mkdir()
    monkeypatch.setattr(extras, "PACKAGE", tmp_path / "src/elib")
    with pytest.raises(elib.Unsupported, match="the page in the browser is not built") as caught:
        page_folder()
    way_out = f"build it, in the folder {tmp_path}: make page" if is_checkout else "install elib again where npm"
    assert caught.value.hint.startswith(way_out)


def test_the_pip_is_that_of_this_python(monkeypatch: pytest.MonkeyPatch, as_installed):
    as_installed(None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    monkeypatch.setattr(shutil, "which", {"pip": "/usr/bin/pip"}.get)
    assert install("plot") == f'install the extra plot: {sys.executable} -m pip install "matplotlib>=3.10"'
    monkeypatch.setattr(sys, "executable", "/my robots/bin/python")
    assert install("plot") == 'install the extra plot: "/my robots/bin/python" -m pip install "matplotlib>=3.10"'


def test_an_environment_of_uv_has_no_pip(monkeypatch: pytest.MonkeyPatch, as_installed):
    as_installed(None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(shutil, "which", {"uv": "/usr/bin/uv"}.get)
    assert install("plot") == f'install the extra plot: uv pip install --python {sys.executable} "matplotlib>=3.10"'


def test_in_a_page_of_a_browser_nothing_is_to_be_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "emscripten")
    assert install("record") == "run this program on a computer: the studio has no such packages"
