"""What the source cites of the pages about the wire and the robot is there."""

import re

from pages import ROOT

FOLDERS = ("src", "tests", "docs", "benchmarks", "examples")
FILES = [
    *(path for folder in FOLDERS for kind in ("*.py", "*.md") for path in (ROOT / folder).rglob(kind)),
    *(ROOT / name for name in ("pyproject.toml", "CONTRIBUTING.md", "README.md")),
]
CITATION = re.compile(r"(wire-protocol|e-puck)\.md,\s(?:#\s)?(trap\s)?(\d+(?:\.\d+)?)")


def sections(page: str) -> set[str]:
    text = (ROOT / f"docs/reference/{page}.md").read_text(encoding="utf-8")
    found = set(re.findall(r"^#{2,3} (\d+(?:\.\d+)?) ", text, re.MULTILINE))
    traps = re.findall(r"^(\d+)\. ", text.partition("\n## 7 Traps\n")[2].partition("\n## 8 ")[0], re.MULTILINE)
    return found | {f"trap {number}" for number in traps}


def test_every_cited_section_and_trap_exists() -> None:
    known = {page: sections(page) for page in ("wire-protocol", "e-puck")}
    missing = [
        f"{path.relative_to(ROOT)}: {page}.md, {'trap ' if trap else ''}{number}"
        for path in FILES
        for page, trap, number in CITATION.findall(path.read_text(encoding="utf-8"))
        if f"{'trap ' if trap else ''}{number}" not in known[page]
    ]
    assert not missing


def test_the_traps_are_numbered_from_1_to_36() -> None:
    assert {name for name in sections("wire-protocol") if name.startswith("trap")} == {
        f"trap {number}" for number in range(1, 37)
    }
