"""The tutorial shows what its programs print, leads from page to page, and needs nothing but the simulator."""

import contextlib
import io
import re
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from pages import ROOT, all_blocks, links, name_of, programs

PAGES = sorted((ROOT / "docs/tutorial").glob("*.md"))


def test_there_are_seven_pages() -> None:
    assert [page.stem for page in PAGES] == [
        "01-first-robot",
        "02-first-behaviour",
        "03-when-things-fail",
        "04-first-swarm",
        "05-first-evolution",
        "06-first-states",
        "07-where-am-i",
    ]


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_each_program_prints_what_is_shown_below_it(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["a program"])
    names: dict[str, object] = {"__name__": "a program"}
    for block, shown in programs(page):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile("\n" * (block.line - 1) + block.text, str(page), "exec"), names)
        assert printed.getvalue().rstrip() == (shown.text if shown else ""), f"{name_of(page)}:{block.line}"


def test_every_text_block_is_the_output_of_a_program() -> None:
    shown = [(page, output.line) for page in PAGES for _, output in programs(page) if output]
    assert shown == [(page, block.line) for page in PAGES for block in all_blocks(page) if block.language == "text"]


def test_programs_run_on_virtual_robots_as_fast_as_they_can() -> None:
    for page in PAGES:
        urls = re.findall(r'"(sim://[^"]*|serial:[^"]*)"', "\n".join(block.text for block, _ in programs(page)))
        assert urls, name_of(page)
        assert [url for url in urls if "speed=max" not in url] == [], name_of(page)


def test_each_page_leads_to_the_next() -> None:
    for page, following in pairwise(PAGES):
        assert following.name in links(page)
