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


def test_the_program_says_its_version_without_loading_the_parser_or_numpy() -> None:
    code = "import sys; from elib.cli import main; main(['--version']); print(*sys.modules)"
    out = run_python(code, check=True)
    version, modules = out.stdout.splitlines()
    assert version == f"elib {__version__}"
    assert not {"cyclopts", "rich", "numpy", "PIL", "elib.simulator.physics"} & set(modules.split())


def test_the_list_of_commands_imports_none_of_them() -> None:
    code = "import sys; from elib.cli import main; main(['--help']); print(*sys.modules)"
    out = run_python(code, check=True)
    modules = set(out.stdout.splitlines()[-1].split())
    assert not {"numpy", "PIL", "asyncio", "elib.simulator.physics", "elib.robot"} & modules
    assert not {f"elib.cli.{name}" for name in COMMANDS} & modules


@pytest.mark.long
def test_watch_starts_without_the_behaviours() -> None:
    code = "import sys, elib.cli.watch; print(*sys.modules)"
    out = run_python(code, check=True)
    assert not {"elib.behaviours", "elib.robot.swarms"} & set(out.stdout.split())


def test_sending_loads_neither_numpy_nor_pillow_unless_there_is_a_picture() -> None:
    code = "import sys; from elib.cli import main; main(['send', 'proximity', '--json']); print(*sys.modules)"
    out = run_python(code, check=True)
    assert not {"numpy", "PIL"} & set(out.stdout.splitlines()[-1].split())


def test_sending_over_a_link_loads_no_simulator_and_nothing_of_the_page_of_learning_or_of_labs() -> None:
    code = """
        import sys
        from elib.cli import main
        main(["send", "proximity", "--robot", "tcp://127.0.0.1:9"])  # port 9: no robot listens there
        print(*sys.modules)
        """
    out = run_python(code, check=True)
    loaded = {name.split(".")[1] for name in out.stdout.split() if name.startswith("elib.")}
    assert {"link", "robot"} <= loaded
    assert not {"simulator", "panel", "learn", "lab", "doors", "behaviours"} & loaded


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
