"""The parser and the process around it: arranging tokens, exit codes, what a failure looks like."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from elib_process import COMMAND, PATIENCE, Told, elib, environment

from elib import __version__
from elib.cli.program import COMMANDS, build, parse
from shared import run_python


def meaning(line: str) -> tuple[object, object]:
    command, bound = parse(build(line.split()), line.split())
    return command, dict(bound.arguments)


@pytest.mark.parametrize(
    ("typed", "same"),
    [
        ("send set-speed 1 -1", "send set_speed 1 -1"),
        ("send set-speed 1 1 --json", "send set_speed 1 1 --json"),
        ("run Go_X_cm --robot U", "run go-x-cm --robot U"),
        ("run avoid --robot U -- --cruise 0.3", "run avoid --robot U --cruise 0.3"),
        ("decode --as raw -", "decode - --as raw"),
        ("simulate --pty /tmp/p arena", "simulate --pty=/tmp/p arena"),
        ("simulate --pty arena", "simulate --pty= arena"),
        ("simulate --pty my.toml", "simulate --pty= my.toml"),
        ("simulate --pty --tcp 0", "simulate --pty= --tcp 0"),
        ("simulate --view", "simulate --view="),
        ("simulate --view square", "simulate --view= square"),
        ("simulate square --view 8700 --control", "simulate square --view=8700 --control="),
        ("simulate --control 127.0.0.1:0 --robots 3", "simulate --control=127.0.0.1:0 --robots 3"),
        ("simulate --view --verbose", "simulate --view= --verbose"),
        ("simulate --wifi square", "simulate --wifi= square"),
        ("simulate square --wifi 0.0.0.0:1000 --view", "simulate square --wifi=0.0.0.0:1000 --view="),
        ("simulate --host square", "simulate --host= square"),
        ("simulate --host 192.168.1.5 square", "simulate --host=192.168.1.5 square"),
        ("simulate --host ::", "simulate --host=::"),
        ("simulate --host mine.toml", "simulate --host= mine.toml"),
        ("simulate --host --shared", "simulate --host= --shared"),
    ],
)
def test_names_may_be_written_in_several_ways_and_values_left_out(typed: str, same: str) -> None:
    assert meaning(typed) == meaning(same)


def test_a_behaviour_that_is_not_named_is_chosen_from_the_page(printed: Told) -> None:
    page = printed("run")
    assert page.startswith("Usage: elib run [OPTIONS] [PROGRAM] [ARGUMENTS...]")
    assert "\nBehaviours:\n" in page


def test_help_names_every_command_and_fits_eighty_columns(printed: Told) -> None:
    page = printed("--help")
    assert all(f"  {name}" in page and summary.split(":")[0].rstrip(".") in page for name, summary in COMMANDS.items())
    assert all(len(line) <= 80 for line in page.splitlines())


def test_a_command_line_without_words_shows_the_help(printed: Told) -> None:
    assert "Usage: elib COMMAND" in printed()


def test_every_command_has_a_help_page_of_eighty_columns(printed: Told) -> None:
    for name in COMMANDS:
        page = printed(name, "--help")
        usage = page.partition("\n")[0]
        assert usage.startswith(f"Usage: elib {name}"), name
        assert "--" not in usage, "an argument that is an option too"
        assert [line for line in page.splitlines() if len(line) > 80] == []


def test_every_page_has_examples_that_are_understood(printed: Told) -> None:
    pages = [(name,) for name in COMMANDS if name != "et"]  # its own parser writes its page
    pages += [(name, each) for name in ("send", "record", "world", "lab") for each in build([name])[name]]
    for words in pages:
        if words[-1].startswith("-"):
            continue
        page = printed(*words, "--help")
        assert "\n\n    " not in page
        lines = re.findall(r"^  elib (.+)$", page.partition("\nFor example:\n")[2], re.MULTILINE)
        if len(words) == 1 and words[0] not in ("world", "lab"):  # the pages of their commands have them
            assert lines, words
        for line in lines:
            meaning(line)


@pytest.mark.parametrize(
    ("words", "usage"),
    [
        ("watch", "[OPTIONS] [NAMES...]"),
        ("record", "[OPTIONS] FILE [NAMES...]"),
        ("compare", "[OPTIONS] [FIRST] [SECOND]"),
        ("simulate", "[OPTIONS] [WORLD]"),
        ("doctor", "[OPTIONS] [URL]"),
        ("send set_camera", "[OPTIONS] [WIDTH] [HEIGHT] [ZOOM] [MODE]"),
        ("world show", "[OPTIONS] NAME"),
    ],
)
def test_a_usage_line_names_the_arguments(printed: Told, words: str, usage: str) -> None:
    assert printed(*words.split(), "--help").splitlines()[0] == f"Usage: elib {words} {usage}"


@pytest.mark.parametrize(
    ("tokens", "message"),
    [
        (["snd"], "elib has no command 'snd'\nhint: did you mean elib send?"),
        (["--robot", "U", "send", "proximity"], "elib has no option '--robot'\nhint: options follow the command"),
        (
            ["send", "--within", "2", "proximity"],
            "elib send has no option '--within'\nhint: options follow the command",
        ),
        (["run", "--for", "2", "avoid"], "options follow the name of avoid\nhint: elib run avoid --robot URL"),
        (["demo", "--sed", "1"], "--sed"),
        (["simulate", "--robots"], "--robots"),
    ],
)
def test_what_is_not_understood_is_wrong_usage(refused: Told, tokens: list[str], message: str) -> None:
    err = refused(*tokens)
    assert err.startswith("error: ")
    assert message in err


HEAVY = {"numpy", "PIL", "elib.simulator.physics"}


@pytest.mark.parametrize(
    ("program", "absent"),
    [
        ("main(['--version'])", HEAVY | {"cyclopts", "rich"}),
        ("main(['--help'])", HEAVY | {"asyncio", "elib.robot"} | {f"elib.cli.{name}" for name in COMMANDS}),
        pytest.param("import elib.cli.watch", {"elib.behaviours", "elib.robot.swarms"}, marks=pytest.mark.long),
        ("main(['send', 'proximity', '--json'])", {"numpy", "PIL"}),
        (
            "main(['send', 'proximity', '--robot', 'tcp://127.0.0.1:9'])",  # port 9: no robot listens there
            {f"elib.{wing}" for wing in ("simulator", "panel", "learn", "lab", "doors", "behaviours")},
        ),
    ],
)
def test_a_command_loads_no_more_than_it_needs(program: str, absent: set[str]) -> None:
    out = run_python(f"import sys; from elib.cli import main; {program}; print('loaded:', *sys.modules)", check=True)
    loaded = set(out.stdout.partition("loaded:")[2].split())
    assert "elib.cli" in loaded
    assert not absent & loaded


def test_the_installed_program_and_the_module_are_the_same() -> None:
    done = subprocess.run([*COMMAND, "--version"], capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"elib {__version__}\n", "")
    script = os.path.join(os.path.dirname(sys.executable), "elib")
    installed = subprocess.run([script, "--version"], capture_output=True, text=True, timeout=PATIENCE, check=True)
    assert installed.stdout == done.stdout


def test_errors_of_a_process_have_no_traceback_and_no_colour() -> None:
    done = elib("send", "set_speed", "5", "5")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "error: left is 5 rev/s; it must be a number from -1 to 1 rev/s\n"
        "hint: elib send set_speed --help has the rule of every robot\n"
    )


def test_a_reader_that_closes_the_pipe_early_is_not_an_error(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    try:
        with (tmp_path / "errors").open("wb") as errors:
            process = subprocess.Popen([*COMMAND, "send", "help_text"], stdout=writer, stderr=errors, env=environment())
            assert process.wait(PATIENCE) == 1
    finally:
        os.close(writer)
    assert (tmp_path / "errors").read_text() == ""
