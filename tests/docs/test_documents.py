"""What the documents say is tried: their code runs, their command lines parse, their links lead somewhere."""

import contextlib
import io
import re
import shlex
import sys
from pathlib import Path

import pytest
from pages import PAGES, ROOT, Block, anchors, blocks, links, name_of, programs, prose

from elib.base.errors import ElibError
from elib.cli import main, program
from elib.cli.send import arguments_of
from elib.link.transport import parse_url, serial
from elib.robot.actions import catalogue
from elib.simulator.emulator.faultscript import parse
from elib.simulator.physics import World
from elib.simulator.worlds.files import parse as parse_world

ELSEWHERE = {ROOT / "docs/cookbook", ROOT / "docs/tutorial"}
"""Their programs are run in ``test_cookbook.py`` and ``test_tutorial.py``."""
WITH_PYTHON = [page for page in PAGES if blocks(page, "python") and page.parent not in ELSEWHERE]
LONG = {"docs/guides/fast-simulation.md", "docs/guides/gymnasium.md", "docs/guides/maps.md"}
"""Pages whose programs take the compiled engine, which takes many seconds to compile, or drive for minutes."""
WITH_CONSOLE = [page for page in PAGES if blocks(page, "console")]
DOCTORS_PAGES = [block for page in PAGES for block in blocks(page, "text") if re.search(r"\nlink: \S+\n\n", block.text)]
TABLES = {f"{name_of(page)}:{block.line}": block for page in PAGES for block in blocks(page, "toml")}
SCRIPTS = {where: block for where, block in TABLES.items() if "[[fault]]" in block.text}
WORLDS = {where: block for where, block in TABLES.items() if "[arena]" in block.text}
OTHER_PROGRAMS = {".", "./avoid", "export", "g++", "mcs", "mono", "node", "pip", "pytest", "python", "python3", "sudo"}


def test_there_are_pages_with_code() -> None:
    assert {"README.md", "docs/guides/timeouts.md"} <= {name_of(page) for page in WITH_PYTHON}
    assert {"README.md", "docs/guides/simulate.md"} <= {name_of(page) for page in WITH_CONSOLE}


def test_there_are_guides_that_show_what_their_programs_print() -> None:
    shown = {name_of(page) for page in WITH_PYTHON for _, output in programs(page) if output is not None}
    assert {"docs/guides/motion.md", "docs/guides/behaviours.md"} <= shown


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name_of(page), marks=[pytest.mark.long] if name_of(page) in LONG else [])
        for page in WITH_PYTHON
    ],
)
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


def test_every_command_line_is_one() -> None:
    wrong = []
    for page in WITH_CONSOLE:
        for block in blocks(page, "console"):
            for command, _ in commands(block.text):
                try:
                    check(shlex.split(command))
                except (AssertionError, ElibError, LookupError) as error:
                    wrong.append(f"{name_of(page)}:{block.line}: {command}: {error!r}")
    assert wrong == []


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


def test_every_fault_script_that_is_shown_is_one() -> None:
    assert len(SCRIPTS) >= 7  # those that come with elib, and an example on each page
    for where, block in SCRIPTS.items():
        assert parse(block.text.encode(), where).faults


def test_every_world_that_is_shown_is_one() -> None:
    assert len(WORLDS) == 6
    for where, block in WORLDS.items():
        world = World(parse_world(block.text.encode(), where))
        assert world.robots >= 1, where
        world.step()


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


def test_every_link_leads_somewhere() -> None:
    wrong = []
    for page in PAGES:
        for link in links(page):
            target, _, anchor = link.partition("#")
            path = (page.parent / target).resolve() if target else page
            if not path.exists():
                wrong.append(f"{name_of(page)} leads to {link}")
            elif anchor and anchor not in anchors(path):
                wrong.append(f"{name_of(page)} leads to {link}; there are {anchors(path)}")
    assert wrong == []


def test_the_prose_does_not_call_anything_easy() -> None:
    words = re.compile(r"\b(?:simply|just|easy|easily|obviously)\b", re.IGNORECASE)
    found = {name_of(page): words.findall(prose(page)) for page in PAGES}
    assert {name: each for name, each in found.items() if each} == {}


def test_every_page_can_be_reached_from_the_readme() -> None:
    reached, left = set(), [ROOT / "README.md"]
    while left:
        page = left.pop()
        if page in reached or page.suffix != ".md":
            continue
        reached.add(page)
        left += [(page.parent / link.partition("#")[0]).resolve() for link in links(page) if not link.startswith("#")]
    assert {name_of(page) for page in PAGES} - {name_of(page) for page in reached} <= {"CHANGELOG.md"}
