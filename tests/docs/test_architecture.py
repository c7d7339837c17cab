"""The pages for those who change elib name what exists, and the page about the architecture names every package."""

import importlib
import re

from pages import ROOT

PAGES = ("docs/architecture.md", "CONTRIBUTING.md")
TEXT = "\n".join((ROOT / page).read_text() for page in PAGES)
NAMED = sorted(set(re.findall(r"`((?:elib\.|(?:src|tests|docs)/)[\w./-]+)", TEXT)))
PACKAGES = sorted(
    path.name for path in (ROOT / "src/elib").iterdir() if path.is_dir() and re.fullmatch("[a-z]+", path.name)
)


def test_what_the_pages_name_exists() -> None:
    assert len(NAMED) > 50
    assert [name for name in NAMED if not exists(name)] == []


def exists(name: str) -> bool:
    if "/" in name:
        return (ROOT / name).exists()
    if is_module(name):
        return True
    module, _, attribute = name.rpartition(".")
    return is_module(module) and hasattr(importlib.import_module(module), attribute)


def is_module(name: str) -> bool:
    path = ROOT / "src" / name.replace(".", "/")
    return path.is_dir() or path.with_suffix(".py").is_file()


def test_the_page_about_the_architecture_names_every_package() -> None:
    text = (ROOT / "docs/architecture.md").read_text()
    assert [package for package in PACKAGES if f"`elib.{package}`" not in text] == []
