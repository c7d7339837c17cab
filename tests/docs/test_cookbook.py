"""The cookbook: every program is whole and small, has a sentence before it, and prints what is shown below it."""

import contextlib
import io
import re
import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest
from pages import ROOT, Block, all_blocks, links, name_of, programs

from lanes import short
from shared import PATIENCE, run_python

PAGES = sorted(path for path in (ROOT / "docs/cookbook").glob("*.md") if path.name != "README.md")
MIN_LINES, MAX_LINES = 4, 15
"""Lines of a program that are not empty."""
SILENT = {"tests.md", "notebooks.md"}
"""Their programs need not print: a test that passes says nothing, and a notebook shows its last value."""
LONG = {"behaviours.md", "simulate-and-worlds.md"}
"""Their programs drive for minutes of simulated time."""


def sections(page: Path) -> list[str]:
    return re.split(r"^## ", page.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]


def size(block: Block) -> int:
    return sum(bool(line.strip()) for line in block.text.splitlines())


def test_there_are_more_than_sixty_programs() -> None:
    assert sum(len(list(programs(page))) for page in PAGES) >= 60


def test_each_program_has_a_heading_and_one_sentence() -> None:
    for page in PAGES:
        for section in sections(page):
            heading, sentence, code = re.split(r"\n\n(?=\S)", section.strip(), maxsplit=2)
            assert re.fullmatch(r"(?:`[^`]*`|[^.`])+\.", " ".join(sentence.split())), f"{heading}: not one sentence"
            assert code.startswith("```python\n"), heading
        count = sum(block.language == "python" for block in all_blocks(page))
        assert len(list(programs(page))) == len(sections(page)) == count, name_of(page)


def test_each_program_is_whole_small_and_has_its_output() -> None:
    for page in PAGES:
        for block, shown in programs(page):
            where = f"{name_of(page)}:{block.line}"
            assert "import" in block.text, where
            assert MIN_LINES <= size(block) <= MAX_LINES, f"{where}: {size(block)} lines"
            assert max(map(len, block.text.splitlines())) <= 100, f"{where}: too wide to read"
            assert shown is not None or page.name in SILENT, f"{where}: it prints nothing"


@pytest.mark.long  # the examples, which make check looks at, prove the same of a few
def test_each_program_passes_a_strict_type_checker(tmp_path: Path) -> None:
    for page in PAGES:
        for block, _ in programs(page):
            (tmp_path / f"{page.stem.replace('-', '_')}_{block.line}.py").write_text(
                block.text + "\n", encoding="utf-8"
            )
    checker = [sys.executable, "-m", "mypy", "--strict", "."]
    done = subprocess.run(checker, cwd=tmp_path, capture_output=True, text=True, timeout=10 * PATIENCE)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, id=name_of(page), marks=[pytest.mark.long] if page.name in LONG else []) for page in PAGES],
)
def test_each_program_runs_alone_and_prints_what_is_shown(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["a program"])
    for block, shown in programs(page):
        folder = tmp_path / str(block.line)
        folder.mkdir()
        monkeypatch.chdir(folder)
        printed, complained = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(complained):
            exec(compile("\n" * (block.line - 1) + block.text, str(page), "exec"), {"__name__": "__main__"})
        assert printed.getvalue().rstrip() == (shown.text if shown else ""), f"{name_of(page)}:{block.line}"
        assert complained.getvalue() == "", f"{name_of(page)}:{block.line}"


DRAWN = {
    "Stop at a black line": r"on the line:",
    "Follow a wall": r"at the goal",
    "Follow a line": r"on the line 100 %",
    "Drive until something is near": r"stopped after 2\d cm",
    "Follow a hand": r"stands [23]\.\d cm away",
    "Avoid obstacles": r"drove for 30 s",
    "Drive until blocked, then turn": r"(\d+ s: turned by \d\.\d rad\n){4,14}$",
    "A Braitenberg vehicle": r"nearest at the end: \d{1,3} ",
    "Light up where something is near": r"LED [017] is lit",
    "Beep like a parking car": r"\d\.\d cm: beep",
    "A world of your own": r"the box is 3\d cm ahead",
}
"""Programs that need sensors to tell something, and what they print on every robot."""


@pytest.mark.parametrize(
    ("heading", "seed"),
    short(product(DRAWN, range(2)), ("Stop at a black line", 0)),
)
def test_a_program_does_the_same_on_robots_whose_sensors_differ_as_real_ones_do(
    heading: str, seed: int, tmp_path: Path
) -> None:
    (section,) = [each for page in PAGES for each in sections(page) if each.startswith(f"{heading}\n")]
    program = section.partition("```python\n")[2].partition("```")[0]
    program = program.replace("?speed=max", f"?quality=typical&seed={seed}&speed=max")
    done = run_python(program, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.match(DRAWN[heading], done.stdout), done.stdout


def test_the_index_leads_to_every_program() -> None:
    index = links(ROOT / "docs/cookbook/README.md")
    for page in PAGES:
        led_to = {link for link in index if link.startswith(f"{page.name}#")}
        assert len(led_to) == len(sections(page)), name_of(page)
