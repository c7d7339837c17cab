"""The pages for those who change elib name what exists, and the page about the architecture names every package."""

import importlib
import re
from pathlib import Path

from pages import ROOT

PAGES = ("docs/architecture.md", "CONTRIBUTING.md")
TEXT = "\n".join((ROOT / page).read_text() for page in PAGES)
NAMED = sorted(set(re.findall(r"`((?:elib\.|(?:src|tests|docs)/)[\w./-]+)", TEXT)))
PACKAGES = sorted(
    path.relative_to(ROOT / "src/elib")
    for pattern in ("*", "*/*")
    for path in (ROOT / "src/elib").glob(pattern)
    if re.fullmatch("[a-z]+", path.name) and any(each.suffix not in ("", ".pyc") for each in path.rglob("*"))
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


def test_the_page_about_the_architecture_shows_every_package_once() -> None:
    shown: list[Path] = []
    for indent, name in re.findall(r"^( +)([a-z]+)/  ", (ROOT / "docs/architecture.md").read_text(), re.MULTILINE):
        shown.append(Path(name) if len(indent) == 2 else Path(shown[-1].parts[0], name))
    assert sorted(shown) == sorted({*PACKAGES, Path("panel/page")})  # that one is there when it is built


def test_no_class_name_stands_twice_in_a_wing() -> None:
    places: dict[tuple[str, str], list[str]] = {}
    for path in sorted((ROOT / "src/elib").rglob("*.py")):
        wing, *_ = path.relative_to(ROOT / "src/elib").parts
        for name in re.findall(r"^class (\w+)", path.read_text(), re.MULTILINE):
            places.setdefault((wing, name), []).append(path.name)
    assert len(places) > 500
    assert {name: files for name, files in places.items() if len(files) > 1} == {}


def test_limits_are_called_max_and_min() -> None:
    code = {path: path.read_text() for path in (ROOT / "src/elib").rglob("*.py")}
    limit = re.compile(r"^_?(?:MOST|LEAST|LONGEST|LARGEST|SHORTEST|SMALLEST)(?:_[A-Z_]+)?\b", re.MULTILINE)
    assert {path.name: found for path, text in code.items() if (found := limit.findall(text))} == {}
