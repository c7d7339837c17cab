"""What the documents say is tried: their code runs, their command lines parse, their links lead somewhere."""

import contextlib
import io
import re
import shlex
import sys
from pathlib import Path

import pytest
from pages import PAGES, ROOT, Block, anchors, blocks, links, name_of, programs, prose

from elib.cli import main, program
from elib.cli.send import arguments_of
from elib.emulator.faultscript import parse
from elib.physics import World
from elib.physics.worldfile import parse as parse_world
from elib.robot.actions import catalogue
from elib.transport import parse_url, serial

WITH_PYTHON = [page for page in PAGES if blocks(page, "python") and page.parent != ROOT / "docs/cookbook"]
"""The programs of the cookbook are whole, each for itself: ``test_cookbook.py``."""
WITH_CONSOLE = [page for page in PAGES if blocks(page, "console")]
DOCTORS_PAGES = [block for page in PAGES for block in blocks(page, "text") if re.search(r"\nlink: \S+\n\n", block.text)]
SCRIPTS = [block for page in PAGES for block in blocks(page, "toml") if "[[fault]]" in block.text]
WORLDS = [block for page in PAGES for block in blocks(page, "toml") if "[arena]" in block.text]
OTHER_PROGRAMS = {".", "./avoid", "export", "g++", "mcs", "mono", "node", "pip", "pytest", "python", "python3", "sudo"}


def test_there_are_pages_with_code() -> None:
    assert {"README.md", "docs/guides/timeouts.md"} <= {name_of(page) for page in WITH_PYTHON}
    assert {"README.md", "docs/guides/simulate.md"} <= {name_of(page) for page in WITH_CONSOLE}


def test_there_are_guides_that_show_what_their_programs_print() -> None:
    shown = {name_of(page) for page in WITH_PYTHON for _, output in programs(page) if output is not None}
    assert {"docs/guides/motion.md", "docs/guides/behaviours.md"} <= shown


@pytest.mark.parametrize("page", WITH_PYTHON, ids=name_of)
def test_every_python_block_runs_and_prints_what_is_shown_right_below_it(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["a program"])
    names: dict[str, object] = {"__name__": "a program"}
    for block in blocks(page, "python"):
        compile(block.text, str(page), "exec")  # those that need a robot too
    for block, shown in programs(page):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile("\n" * (block.line - 1) + block.text, str(page), "exec"), names)
        assert shown is None or printed.getvalue().rstrip() == shown.text, f"{name_of(page)}:{block.line}"


@pytest.mark.parametrize("page", WITH_CONSOLE, ids=name_of)
def test_every_command_line_is_one(page: Path) -> None:
    for block in blocks(page, "console"):
        for command, _ in commands(block.text):
            check(shlex.split(command))


def test_there_is_a_doctors_page_of_a_robot_and_one_of_a_missing_port() -> None:
    assert sorted(link_of(block) for block in DOCTORS_PAGES) == ["/dev/rfcomm7", "sim://?speed=max"]


@pytest.mark.skipif(sys.platform != "linux", reason="the doctor's advice is each system's own")
@pytest.mark.parametrize("block", DOCTORS_PAGES, ids=lambda block: link_of(block))
def test_the_doctor_says_what_the_guide_shows(
    block: Block, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(serial, "list_ports", lambda: ["/dev/ttyS0"])
    is_healthy = "FAIL" not in block.text
    with contextlib.nullcontext() if is_healthy else pytest.raises(SystemExit, match="1"):
        assert main(["doctor", link_of(block)]) == 0
    _, _, said = capsys.readouterr().out.partition("\nlink: ")  # the line before names this computer
    assert said.rstrip() == block.text.partition("\nlink: ")[2]


def link_of(block: Block) -> str:
    return block.text.partition("\nlink: ")[2].partition("\n")[0]


@pytest.mark.parametrize("block", SCRIPTS, ids=lambda block: f"line {block.line}")
def test_a_fault_script_that_is_shown_is_one(block: Block) -> None:
    assert parse(block.text.encode(), "shown").faults


def test_the_guide_and_the_reference_show_fault_scripts() -> None:
    assert len(SCRIPTS) >= 7  # those that come with elib, and an example on each page


@pytest.mark.parametrize("block", WORLDS, ids=lambda block: f"line {block.line}")
def test_a_world_that_is_shown_is_one(block: Block) -> None:
    world = World(parse_world(block.text.encode(), "shown.toml"))
    assert world.robots >= 1
    world.step()


def test_the_guide_and_the_reference_show_worlds() -> None:
    assert len(WORLDS) == 5


def commands(text: str) -> list[tuple[str, str]]:
    """Take a block apart into command lines and the output shown below each."""
    parts = re.split(r"^\$ ", text, flags=re.MULTILINE)
    assert not parts[0].strip(), f"output before any command: {parts[0]!r}"
    return [(part.partition("\n")[0], part.partition("\n")[2].rstrip()) for part in parts[1:]]


def check(words: list[str]) -> None:
    """Fail unless a shell would find the program and the program would take its arguments."""
    program, *rest = [word for word in words if not re.match(r"[A-Z_]+=", word)]
    if program == "elib":
        check_elib(rest)
    elif program == "make":
        assert re.search(rf"^{rest[0]}:", (ROOT / "Makefile").read_text(), re.MULTILINE), words
    elif program == ".venv/bin/python":
        assert (ROOT / rest[0]).is_file(), words
    else:
        assert program in OTHER_PROGRAMS, words


def check_elib(tokens: list[str]) -> None:
    _, bound = program.parse(program.build(tokens), tokens)
    if "--robot" in tokens:
        parse_url(tokens[tokens.index("--robot") + 1])
    if tokens[0] == "send" and tokens[1] != "COMMAND":
        arguments_of(catalogue()[tokens[1]], [str(text) for text in bound.args])


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_link_leads_somewhere(page: Path) -> None:
    for link in links(page):
        target, _, anchor = link.partition("#")
        path = (page.parent / target).resolve() if target else page
        assert path.exists(), f"{name_of(page)} leads to {link}"
        assert not anchor or anchor in anchors(path), f"{name_of(page)} leads to {link}; there are {anchors(path)}"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_prose_does_not_call_anything_easy(page: Path) -> None:
    found = re.findall(r"\b(?:simply|just|easy|easily|obviously)\b", prose(page), re.IGNORECASE)
    assert not found


def test_every_page_can_be_reached_from_the_readme() -> None:
    reached, left = set(), [ROOT / "README.md"]
    while left:
        page = left.pop()
        if page in reached or page.suffix != ".md":
            continue
        reached.add(page)
        left += [(page.parent / link.partition("#")[0]).resolve() for link in links(page) if not link.startswith("#")]
    assert {name_of(page) for page in PAGES} - {name_of(page) for page in reached} <= {"CHANGELOG.md"}
