"""What the page "Does elib suit you?" counts is counted again, and its program for Enki runs where Enki is."""

import shutil
import subprocess
from pathlib import Path

import pytest
from pages import ROOT, blocks

from shared import PATIENCE

PAGE = ROOT / "docs/concepts/does-elib-suit-you.md"
WEBOTS = ROOT / "docs/reference/from-webots.md"
NUMBERS = {7: "seven", 11: "eleven", 16: "sixteen"}


def lines(text: str) -> int:
    return sum(bool(line.strip()) for line in text.splitlines())


def test_the_lines_of_the_first_programs_are_counted_right() -> None:
    page = " ".join(PAGE.read_text(encoding="utf-8").split())
    ours, theirs = lines(blocks(WEBOTS, "python")[0].text), lines(blocks(WEBOTS, "text")[0].text)
    enki = lines(blocks(PAGE, "cpp")[0].text)
    assert f"elib: {NUMBERS[ours]} lines, Webots: {NUMBERS[theirs]} lines" in page
    assert f"a program of {NUMBERS[ours]} lines drives" in page
    assert f"Enki: {NUMBERS[enki]} lines" in page


@pytest.mark.long
@pytest.mark.skipif(
    not (shutil.which("g++") and Path("/usr/include/enki").exists()), reason="it needs g++ and Debian's libenki-dev"
)
def test_the_program_for_enki_prints_what_the_page_says(tmp_path: Path) -> None:
    (tmp_path / "first.cpp").write_text(blocks(PAGE, "cpp")[0].text)
    subprocess.run(["g++", "first.cpp", "-o", "first", "-lenki"], cwd=tmp_path, check=True, timeout=2 * PATIENCE)
    said = subprocess.run([tmp_path / "first"], check=True, capture_output=True, text=True, timeout=PATIENCE).stdout
    shown = PAGE.read_text(encoding="utf-8").partition("C++, which print ")[2].partition(" s ")[0]
    assert round(float(said.split()[0]), 2) == float(shown)
