"""The pages for those who change elib name what exists, and the page about the architecture names every package."""

import importlib
import re

import pytest
from pages import ROOT

PAGES = ("docs/architecture.md", "CONTRIBUTING.md")
TEXT = "\n".join((ROOT / page).read_text() for page in PAGES)
NAMED = sorted(set(re.findall(r"`((?:elib\.|(?:src|tests|docs)/)[\w./-]+)", TEXT)))
PACKAGES = sorted(
    path.name for path in (ROOT / "src/elib").iterdir() if path.is_dir() and re.fullmatch("[a-z]+", path.name)
)


@pytest.mark.parametrize("name", NAMED)
def test_what_the_pages_name_exists(name: str) -> None:
    if "/" in name:
        assert (ROOT / name).exists()
    elif not is_module(name):
        module, _, attribute = name.rpartition(".")
        assert is_module(module), f"there is no {module}"
        assert hasattr(importlib.import_module(module), attribute)


def is_module(name: str) -> bool:
    path = ROOT / "src" / name.replace(".", "/")
    return path.is_dir() or path.with_suffix(".py").is_file()


@pytest.mark.parametrize("package", PACKAGES)
def test_the_page_about_the_architecture_names_every_package(package: str) -> None:
    assert f"`elib.{package}`" in (ROOT / "docs/architecture.md").read_text()
