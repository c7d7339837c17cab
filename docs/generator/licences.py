"""The page of licences: what the core and each extra install, from requirements/dev.txt and the packages themselves."""

from __future__ import annotations

import json
import re
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

from generator.markdown import joined, table

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/reference/licences.md"
INTRODUCTION = """# Licences

elib itself is under the [MIT licence](../../LICENSE). This page lists the packages that are installed with it, and the
licence that each of them names. Versions are given where elib asks for the package directly; the versions that are
tested are in the folder `requirements`. Some packages, such as NumPy and Pillow, contain further libraries; their
licences are installed with the package. The tools for developing elib are not listed: they are not installed with it.
"""
PAGE_INTRODUCTION = """## The page in the browser

The page and the studio are built from these packages of npm. The file `licences.txt` beside the built page holds the
texts of the licences of all that is in it.
"""
WHY = {
    "@codemirror/autocomplete": "completion in the editor of the studio",
    "@codemirror/commands": "keys in programs that are shown",
    "@codemirror/lang-python": "colours of Python in programs that are shown",
    "@codemirror/language": "colours of programs that are shown",
    "@codemirror/search": "finding text in the editor of the studio",
    "@codemirror/state": "programs that are shown",
    "@codemirror/view": "programs that are shown",
    "@fontsource-variable/inter": "the font",
    "@preact/signals": "what the page shows follows what it knows",
    "@lezer/highlight": "colours of programs that are shown",
    "aiohttp": "the server of the pages in the browser",
    "cmaes": "evolution by CMA-ES",
    "cyclopts": "the command line",
    "distributed": "workers on other computers: Dask",
    "duckdb": "writes Parquet files",
    "esbuild": "builds the page",
    "foxglove-sdk": "the server of Foxglove's protocol",
    "gymnasium": "environments for learning programs",
    "intelhex": "reads Intel HEX files",
    "lucide": "icons",
    "matplotlib": "draws plots",
    "mcap": "reads and writes recordings",
    "mcp": "the Model Context Protocol of agents",
    "msgspec": "the messages of recordings, and those between server and page",
    "numba": "compiles the simulator",
    "opencv-python-headless": "finds tags in pictures",
    "numpy": "arrays: pictures, worlds, tables",
    "pettingzoo": "environments with several agents",
    "pillow": "picture files",
    "preact": "the elements of the page",
    "pyodide": "Python in the studio",
    "rich": "help pages and live lines in the terminal",
    "serialx": "serial ports",
    "three": "worlds in three dimensions",
    "uplot": "charts",
}
"""What elib needs a package for that it asks for directly; a new one needs its line here."""
ELSEWHERE = {"pywin32": "PSF"}
"""The licences of packages that only other systems install, as they name them."""
Packages = dict[str, tuple[set[str], str]]
"""Of each package: which packages need it, and its system if only one does."""
SYSTEMS = {"win32": "Windows", "darwin": "macOS"}


def page() -> str:
    """Return the page."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    packages, known = _locked(), _known()
    core = {_name(line): _versions(line) for line in project["dependencies"]}
    in_core = _with_needs(set(core), packages)
    parts = [INTRODUCTION, "## The core\n\n" + _table(in_core, core, packages, known)]
    for extra, lines in project["optional-dependencies"].items():
        direct = {_name(line): _versions(line) for line in lines}
        direct.pop(project["name"], None)  # an extra may contain other extras
        if direct:
            rest = _with_needs(set(direct), packages) - in_core
            parts.append(f"## The extra {extra}\n\n{_table(rest, direct, packages, known)}")
    parts.append(PAGE_INTRODUCTION + "\n" + _of_the_page())
    return joined(parts)


def _of_the_page() -> str:
    """Return the table of what the page is built from; npm notes in its lock file what only tools need."""
    lock: dict[str, dict[str, Any]] = json.loads((ROOT / "page/package-lock.json").read_text(encoding="utf-8"))[
        "packages"
    ]
    used = {
        path.removeprefix("node_modules/"): about
        for path, about in lock.items()
        if path and not about.keys() & {"dev", "optional"}
    }
    packages = {
        name: ({user for user, about in used.items() if name in about.get("dependencies", ())}, "") for name in used
    }
    return _table(
        set(used), lock[""]["dependencies"], packages, {name: about["license"] for name, about in used.items()}
    )


def _table(names: set[str], direct: dict[str, str], packages: Packages, known: dict[str, str]) -> str:
    rows = []
    for name in sorted(names):
        users, system = packages[name]
        why = WHY[name] if name in direct else f"for {', '.join(sorted(users & names))}"
        licence = known.get(name) or _licence(name)
        rows.append((name, direct.get(name, ""), licence, why + (f"; on {system}" if system else "")))
    return table(("Package", "Versions", "Licence", "Why it is there"), rows)


def _locked() -> Packages:
    """Return the committed packages."""
    found = {}
    text = (ROOT / "requirements/dev.txt").read_text(encoding="utf-8")
    for block in re.split(r"^(?=\w)", text, flags=re.MULTILINE)[1:]:
        system = re.search(r"sys_platform == '(\w+)'", block)
        users = set(re.findall(r"[\w.-]+", block.partition("# via ")[2]))
        if system and system[1] == "emscripten":  # Python in a browser has no ports
            continue
        found[_name(block)] = users, SYSTEMS[system[1]] if system else ""
    return found


def _with_needs(names: set[str], packages: Packages) -> set[str]:
    """Return *names* and all packages that these need."""
    needed = {name for name, (users, _) in packages.items() if users & names} | names
    return names if needed == names else _with_needs(needed, packages)


def _known() -> dict[str, str]:
    """Return the licences as the page has them: what is installed here and now does not change it."""
    text = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    return dict(re.findall(r"^\| ([\w.-]+) \| [^|]*(?:\\\|[^|]*)* \| (.+?) \|", text, re.MULTILINE))


def _licence(name: str) -> str:
    """Return the licence that an installed package names."""
    try:
        about = metadata(name)
    except PackageNotFoundError:
        return ELSEWHERE[name]
    named = about["License-Expression"] or about["License"] or ""
    of_class = [each.rpartition(" :: ")[2] for each in about.get_all("Classifier", []) if each.startswith("License ::")]
    return named if named and "\n" not in named and len(named) < 80 else ", ".join(of_class) or named.splitlines()[0]


def _name(line: str) -> str:
    return re.split(r"[^\w.-]", line, maxsplit=1)[0].lower().replace("_", "-")


def _versions(line: str) -> str:
    return line[len(_name(line)) :].strip()
