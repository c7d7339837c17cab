"""The committed versions follow pyproject.toml, and no file names the index that they were fetched from."""

import json
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
NAME = PROJECT["project"]["name"]
RENEW = "requirements/ does not follow pyproject.toml; renew it with: make lock"
# In two pieces each, so that this file does not hold them.
INDEXES = re.compile("py" r"pi\.|python" "hosted|npm" r"js\.|yarn" "pkg", re.IGNORECASE)
MADE = {"uv.lock", "node_modules", "build", "dist", "site", "__pycache__"}


@dataclass(frozen=True, slots=True)
class Locked:
    """One line of a file in requirements/: what it pins, its hashes, and who asks for it."""

    requirement: Requirement
    hashes: frozenset[str]
    via: str

    @property
    def name(self) -> str:
        return canonicalize_name(self.requirement.name)

    @property
    def version(self) -> str:
        return str(self.requirement.specifier).removeprefix("==")


def locked(name: str) -> list[Locked]:
    found = []
    for block in re.split(r"^(?=\w)", (ROOT / "requirements" / name).read_text(), flags=re.MULTILINE)[1:]:
        hashes = re.findall(r"^    --hash=(\S+)", block, re.MULTILINE)
        via = re.search(r"^    # via (.*)", block, re.MULTILINE)
        requirement = Requirement(block.splitlines()[0].removesuffix("\\"))
        found.append(Locked(requirement, frozenset(hashes), via[1] if via else ""))
    return found


def asked(*, everything: bool) -> Iterator[Requirement]:
    """Yield what pyproject.toml names itself: for the core, or for all extras and the tools as well."""
    project, groups = PROJECT["project"], PROJECT["dependency-groups"]
    lines = list(project["dependencies"])
    if everything:
        lines += [line for extra in project["optional-dependencies"].values() for line in extra]
        lines += [line for group in groups.values() for line in group if isinstance(line, str)]
    for line in lines:
        requirement = Requirement(line)
        if canonicalize_name(requirement.name) != NAME:
            yield requirement


def files() -> Iterator[Path]:
    """Yield what is committed, and perhaps a little more."""
    for path in ROOT.iterdir():
        if path.is_file() and path.name not in MADE:
            yield path
        elif path.name == ".ci" or (not path.name.startswith(".") and path.name not in MADE):
            yield from (each for each in path.rglob("*") if each.is_file() and not MADE & {*each.parts})


@pytest.mark.parametrize("name", ["core.txt", "dev.txt"])
def test_the_committed_versions_are_those_that_the_project_asks_for(name: str) -> None:
    lines = locked(name)
    wanted = list(asked(everything=name == "dev.txt"))
    direct = {line.name for line in lines if f"{NAME} (pyproject.toml" in line.via}
    assert direct == {canonicalize_name(each.name) for each in wanted}, RENEW
    for requirement in wanted:
        for line in lines:
            if line.name == canonicalize_name(requirement.name):
                assert requirement.specifier.contains(line.version), f"{line.requirement}: {requirement}; {RENEW}"


def test_the_demo_installs_the_versions_that_are_tested() -> None:
    assert {(str(line.requirement), line.hashes) for line in locked("core.txt")} <= {
        (str(line.requirement), line.hashes) for line in locked("dev.txt")
    }, RENEW


@pytest.mark.parametrize("name", ["core.txt", "dev.txt", "uv.txt", "node.txt"])
def test_each_committed_version_has_its_hashes(name: str) -> None:
    lines = locked(name)
    assert lines
    for line in lines:
        assert re.fullmatch(r"==[\w.+]+", str(line.requirement.specifier)), line
        assert line.hashes, line
        assert all(re.fullmatch(r"sha256:[0-9a-f]{64}", each) for each in line.hashes)


def test_the_committed_versions_name_no_address() -> None:
    for path in (ROOT / "requirements").iterdir():
        assert not re.search(r"://|^-", path.read_text(), re.MULTILINE), path
    packages = json.loads((ROOT / "page/package-lock.json").read_text())["packages"]
    assert not [name for name, package in packages.items() if "resolved" in package]
    assert "index" not in PROJECT["tool"]["uv"]


def test_no_file_names_an_index_of_packages() -> None:
    named = []
    for path in files():
        text = path.read_bytes().decode("utf-8", errors="replace")
        named += [f"{path.relative_to(ROOT)}: {match[0]}" for match in INDEXES.finditer(text)]
    assert not named
