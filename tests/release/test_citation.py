"""CITATION.cff says how to cite this version, with what is true of it and nothing else."""

import tomllib
from pathlib import Path

import pytest
import yaml

import elib

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def citation() -> dict:
    return yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))


def test_it_has_what_the_format_asks_for(citation: dict) -> None:
    assert citation["cff-version"] == "1.2.0"
    assert citation.keys() >= {"message", "title", "authors"}
    assert all(reference.keys() >= {"type", "title", "authors"} for reference in citation["references"])


def test_it_is_of_this_version(citation: dict) -> None:
    assert citation["version"] == elib.__version__


def test_it_says_what_the_package_says(citation: dict) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert citation["license"] == project["license"]
    assert citation["authors"] == project["authors"]


def test_it_names_no_identifier_that_does_not_exist(citation: dict) -> None:
    assert not citation.keys() & {"doi", "identifiers", "url", "repository", "repository-code", "date-released"}
