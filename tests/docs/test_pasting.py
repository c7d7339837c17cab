"""Every command of the documents does what the page says when it is pasted: as printed, in an empty folder.

A command that serves is started, tried and ended by Ctrl-C. What a page shows below a command is compared. A block that
cannot run here says what it needs in a comment before it, ``<!-- needs a robot -->``; none is left out without one.

Exchanged is only what two runs on one computer would share, port numbers and ports in ``/tmp``, and how much is
computed where the page shows nothing of it: a run in real time ends after a second, and :data:`LESS` names the others.
"""

import contextlib
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from pages import PAGES, ROOT, Block, blocks, name_of
from test_documents import commands

from shared import PATIENCE, needs_page, wait_until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="pseudo terminals, signals and a POSIX shell")

REASONS = {
    "a robot": "a real one, on a port, a radio or a network",
    "a checkout": "make works in the folder of the project",
    "an administrator": "the system asks for a password",
    "Stable-Baselines3": "it brings PyTorch, hundreds of megabytes",
    "bubblewrap": "it isolates programs of other people, and is not everywhere",
    "an open network": "it listens to other computers",
    "the internet": "it installs packages",
    "minutes": "it computes for minutes",
    "the Foxglove app": "it is a program of its own",
    "another language": "its compiler or interpreter, and a program that is copied from the examples",
}
"""What a page may say that a block needs."""
BY_PROGRAMS = {"docs/guides/link-faults.md", "docs/guides/pandas.md", "docs/guides/records.md"}
"""Pages whose first Python program makes the file that their commands read."""
SHOWN = {
    "docs/guides/decode.md": ("run.txt", "text", 1),
    "docs/guides/worlds.md": ("gate.toml", "toml", 1),
    "docs/tutorial/01-first-robot.md": ("mine.py", "python", 1),
    "docs/tutorial/02-first-behaviour.md": ("roam.py", "python", 3),
    "docs/tutorial/05-first-evolution.md": ("hide.py", "python", 1),
    "docs/guides/states.md": ("machine.py", "python", 1),
}
"""Pages that show the file which their commands read: its name, the language of its blocks, and how many of the first
blocks are in it."""
PROGRAM = ":080000000001040000000000F3\n:1002000000000700000007000000070000000700D2\n:00000001FF\n"
"""A program for an e-puck1, ``program.hex``: a jump to 0x100, and a few instructions there."""

PROGRAMS = {"elib", "et", "export", "python"}
"""What is pasted here; no page can let a test install or remove something."""
SERVERS = {"joystick", "serve", "simulate"}
LINK = re.compile(r"\b(?:tcp|http|wifi|serial)://[^\s\"]+")
MINUTES = 10 * PATIENCE
"""s that a command may take on a busy machine, where the physics is compiled first."""
ENDED = (0, 128 + signal.SIGINT, -signal.SIGINT)
"""Exit codes of a command that ended by itself or by Ctrl-C."""
LESS = {
    "docs/guides/evolve.md": {
        "elib evolve avoid": "elib evolve avoid --generations 3",
        "--generations 200": "--generations 5",
    },
    "docs/guides/sweep.md": {"--for 30": "--for 3"},
    "docs/guides/cluster.md": {"--for 30": "--for 3"},
}
"""What is exchanged on a page so that less is computed, where the page shows no figures of it."""
ELSEWHERE = {"docs/guides/parity.md": "tests/studies/test_parity_guide.py"}
"""Pages whose commands another test runs, beside the text that the page shows."""
QUICK = {"README.md", "docs/tutorial/01-first-robot.md"}
"""What a newcomer pastes first."""

WITH_COMMANDS = [
    page
    for page in PAGES
    if (name_of(page) == "README.md" or page.is_relative_to(ROOT / "docs")) and blocks(page, "console")
]


def hold_ports(stack: contextlib.ExitStack, count: int) -> int:
    """Hold some ports in a row, and return the first one: other programs get others.

    Nothing listens on them, so a server that asks for one gets it, as servers set ``SO_REUSEADDR``.
    """
    while True:
        with contextlib.ExitStack() as attempt, contextlib.suppress(OSError):
            first = hold(attempt, 0)
            for port in range(first + 1, first + count):
                hold(attempt, port)
            stack.push(attempt.pop_all())
            return first


def hold(stack: contextlib.ExitStack, port: int) -> int:
    line = stack.enter_context(socket.socket())
    line.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    line.bind(("127.0.0.1", port))
    return int(line.getsockname()[1])


class Terminal:
    """A shell in a folder of its own, as a reader of one page uses it."""

    def __init__(self, folder: Path, less: dict[str, str] | None = None) -> None:
        self.folder = folder
        self.less = less or {}
        self.held = contextlib.ExitStack()
        self.port = hold_ports(self.held, 20)
        self.running: list[subprocess.Popen[bytes]] = []
        self.variables = {
            "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
            "HOME": str(folder),
            "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache")),  # what is compiled stays
            "COLUMNS": "80",
            "PYTHONUNBUFFERED": "1",
        }

    def line(self, command: str) -> str:
        """Return the command as it is run here."""
        for much, less in self.less.items():
            command = command.replace(much, less)
        if is_in_real_time(command):
            command = f"{re.sub(r' --for [0-9]+', '', command)} --for 1"
        return command.replace("4000", str(self.port)).replace("/tmp/", f"{self.folder}/")

    def start(self, command: str) -> tuple[subprocess.Popen[bytes], Path, Path]:
        place = self.folder / f".{len(list(self.folder.glob('.*.out')))}"
        out, error = place.with_name(f"{place.name}.out"), place.with_name(f"{place.name}.err")
        with out.open("wb") as stdout, error.open("wb") as stderr:
            started = subprocess.Popen(
                ["bash", "-c", self.line(command)],
                cwd=self.folder,
                env=self.variables,
                stdin=subprocess.DEVNULL,
                stdout=stdout,
                stderr=stderr,
                start_new_session=True,
            )
        self.running.append(started)
        return started, out, error

    def paste(self, command: str, output: str) -> None:
        """Run a command, and compare what it prints with what the page shows."""
        words = [word for word in shlex.split(command) if not re.match(r"[A-Z_]+=", word)]
        assert words[0] in PROGRAMS, f"{command}: what does it need? Say it in a comment before its block"
        if words[0] == "export":
            self.variables |= dict(each.split("=", 1) for each in shlex.split(command)[1:])
            return
        started, out, error = self.start(command)
        if words[:1] == ["elib"] and words[1] in SERVERS:
            self.probe(started, out, error, is_seen="--view" in words or words[1] in ("joystick", "serve"))
            if not {"--tcp", "--pty"} & set(words):  # a port with a name is there for the commands below
                self.end(started)
        else:
            started.wait(MINUTES)
        said = error.read_text(encoding="utf-8")
        assert "Traceback" not in said, said
        assert started.poll() in (None, *ENDED), out.read_text(encoding="utf-8") + said
        if output:
            printed = out.read_text(encoding="utf-8").rstrip()
            assert (printed or said.rstrip()) == output  # elib run tells on stderr how it went

    def probe(self, server: subprocess.Popen[bytes], out: Path, error: Path, *, is_seen: bool) -> None:
        """Wait until a server says where it is, and look whether it is there."""

        def links_of_server() -> list[str]:
            said = out.read_text(encoding="utf-8") + error.read_text(encoding="utf-8")
            links = LINK.findall(said)
            assert links or server.poll() is None, said
            return links if not is_seen or any(link.startswith("http") for link in links) else []

        links = wait_until(links_of_server)
        for link in links:
            scheme, _, place = link.partition("://")
            if scheme == "serial":
                assert Path(place).exists()
            elif scheme == "http":
                with urllib.request.urlopen(link, timeout=PATIENCE) as answer:
                    assert answer.status == 200
            else:
                host, _, port = place.rpartition(":")
                socket.create_connection((host, int(port)), timeout=PATIENCE).close()

    def end(self, started: subprocess.Popen[bytes]) -> None:
        """End a command as Ctrl-C does, and wait for it."""
        if started.poll() is None:
            os.killpg(started.pid, signal.SIGINT)
            started.wait(MINUTES)

    def close(self) -> None:
        """End everything that still runs."""
        for started in self.running:
            with contextlib.suppress(ProcessLookupError):
                self.end(started)
            assert started.returncode in ENDED, started.args
        self.held.close()


def is_in_real_time(command: str) -> bool:
    """Whether the command needs as long as the robot: nothing says ``speed=max``."""
    return command.startswith("elib run ") and "--list" not in command and "speed=max" not in command


def runs_here(block: Block) -> Iterator[tuple[str, str]]:
    """Yield the commands of a block that need nothing which is missing, with their outputs."""
    for command, output in commands(block.text):
        if not block.cannot_run and not (block.needs_at and block.needs_at in command):
            yield command, output


def test_there_are_pages_with_commands() -> None:
    assert {"README.md", "docs/guides/simulate.md", "docs/tutorial/01-first-robot.md"} <= set(
        map(name_of, WITH_COMMANDS)
    )


def test_every_command_is_run_or_its_block_says_what_it_needs() -> None:
    counts = {"run": 0, "marked": 0}
    for page in WITH_COMMANDS:
        for block in blocks(page, "console"):
            where = f"{name_of(page)}:{block.line}"
            lines, here = commands(block.text), list(runs_here(block))
            assert lines, f"{where}: no line begins with $"
            assert not block.needs or block.needs in REASONS, f"{where}: say one of {', '.join(REASONS)}"
            assert not block.needs_at or 0 < len(here) < len(lines), f"{where}: {block.needs_at} fits all or none"
            counts["run"] += len(here)
            counts["marked"] += len(lines) - len(here)
    assert counts["run"] > counts["marked"]


def marks_of(page: Path) -> list[pytest.MarkDecorator]:
    """Say which pages are for the long lane, and which need the page in the browser."""
    marks = [] if name_of(page) in QUICK else [pytest.mark.long]
    text = "\n".join(block.text for block in blocks(page, "console"))
    return [*marks, needs_page] if re.search(r"elib (joystick|serve)|--view", text) else marks


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name_of(page), marks=marks_of(page))
        for page in WITH_COMMANDS
        if name_of(page) not in ELSEWHERE and any(any(runs_here(block)) for block in blocks(page, "console"))
    ],
)
def test_the_commands_of_a_page_do_what_it_says(page: Path, tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, LESS.get(name_of(page)))
    (tmp_path / "program.hex").write_text(PROGRAM)
    if name_of(page) in BY_PROGRAMS:
        program = blocks(page, "python")[0].text
        subprocess.run([sys.executable, "-c", program], cwd=tmp_path, check=True, capture_output=True, timeout=MINUTES)
    if name_of(page) in SHOWN:
        name, language, count = SHOWN[name_of(page)]
        text = "\n".join(block.text for block in blocks(page, language)[:count])
        (tmp_path / name).write_text(f"{text}\n", encoding="utf-8")
    with contextlib.closing(terminal):
        for block in blocks(page, "console"):
            for command, output in runs_here(block):
                terminal.paste(command, output)


@pytest.mark.parametrize(
    ("command", "output"),
    [
        ("elib send selector", "position  4"),
        pytest.param("elib send selektor", "", marks=pytest.mark.long),
        pytest.param("elib simulate --world nowhere", "", marks=pytest.mark.long),
        ("sudo true", ""),
    ],
)
def test_a_command_that_does_something_else_would_be_noticed(command: str, output: str, tmp_path: Path) -> None:
    with contextlib.closing(Terminal(tmp_path)) as terminal, pytest.raises(AssertionError):
        try:
            terminal.paste(command, output)
        finally:
            terminal.running.clear()
