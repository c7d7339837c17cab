"""What differs between firmwares is data of their profiles."""

import ast
from pathlib import Path

import pytest

import elib
from elib.link.protocol.profiles import PROFILES, recognise

SOURCE = Path(elib.__file__).parent


def compared_texts(tree: ast.AST) -> list[str]:
    """Return every text that something is compared with, by ``==``, ``in`` or ``case``."""
    sides: list[ast.AST] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            sides += [node.left, *node.comparators]
        elif isinstance(node, ast.MatchValue):
            sides.append(node.value)
    inner = [part for side in sides for part in (getattr(side, "elts", None) or [side])]
    return [part.value for part in inner if isinstance(part, ast.Constant) and isinstance(part.value, str)]


def test_a_comparison_with_a_firmwares_name_is_found() -> None:
    for code in ("name == 'epuck2'", "'epuck2' != x.name", "x in ('btcom-2.0', 'y')", "match x:\n case 'epuck2': pass"):
        assert set(compared_texts(ast.parse(code))) & PROFILES.keys()


def test_no_firmwares_name_is_tested_outside_the_profiles_and_the_emulated_firmwares() -> None:
    found = [
        f"{path.relative_to(SOURCE)}: {text}"
        for path in SOURCE.rglob("*.py")
        for written in [path.read_text(encoding="utf-8")]
        if any(name in written for name in PROFILES)
        for text in compared_texts(ast.parse(written))
        if text in PROFILES
    ]
    assert found == []


@pytest.mark.parametrize(
    ("version", "firmware"),
    [
        ("Version 1.1.3 September 2006", "btcom-1.1.3"),
        ("Version 2.0.0 January 2008", "btcom-2.0"),
        ("Version 1.2.2 November 2018 GCtronic", "asercom-1.2.2"),
        ("Version 2.0 January 2018 GCtronic", "epuck2"),
        ("Version 1.9 never GCtronic", "asercom-1.2.2"),
        ("Version 3.0 GCtronic", "epuck2"),
        ("Version 7.3", "btcom-2.0"),
        ("Version", "btcom-1.1.3"),
    ],
)
def test_a_version_that_is_not_known_gets_the_nearest_profile_of_its_family(version: str, firmware: str) -> None:
    assert recognise(version).name == firmware
