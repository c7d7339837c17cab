"""Labs and programs for the tests of labs."""

from __future__ import annotations

import contextlib
import os
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

from elib.lab import Lab, VariantResult, load_lab, run_variant
from elib.lab.running import PlainProgram
from shared import PATIENCE

WORLD = """
[arena]
size = [1.0, 0.6]

[epuck]
quality = "ideal"

[[box]]
name = "crate"
position = [0.8, 0.3]
size = [0.06, 0.06]
pushable = true

[[stripe]]
points = [[0.1, 0.3], [0.9, 0.3]]

[[robot]]
position = [0.3, 0.3]
"""
TOP = 'title = "A lab"\nsummary = "A task."\ntime = 20\n'
GIVEN = '[[variant]]\nname = "given"\nworld = "world.toml"\n'
SURVIVES = '[[goal]]\nname = "ends"\nkind = "survives"\n'


def lab_in(folder: Path, goals: str = SURVIVES, *, variants: str = GIVEN, top: str = TOP, world: str = WORLD) -> Lab:
    """Write a lab and read it."""
    folder.joinpath("world.toml").write_text(world)
    folder.joinpath("lab.toml").write_text(top + variants + goals)
    return load_lab(folder)


def run_program(lab: Lab, text: str, *, variant: int = 0, wall: float = 120.0, **environment: str) -> VariantResult:
    """Run the text of a program in a variant of a lab."""
    path = lab.folder / "program.py"
    path.write_text(text)
    with patch.dict(os.environ, environment):
        return run_variant(lab, lab.variants[variant], lambda link: PlainProgram(path, link), wall=wall)


class Talker:
    """Something that writes to the link as no program of elib would.

    Args:
        link: The program's end of the link.
        talk: Called with a copy of it, in a thread.
    """

    output = ""

    def __init__(self, link: socket.socket, talk: Callable[[socket.socket], object]) -> None:
        self._link = link.dup()
        self._is_done = False
        self._thread = threading.Thread(target=self._run, args=(talk,), daemon=True)
        self._thread.start()

    def poll(self) -> int | None:
        return 0 if self._is_done or not self._thread.is_alive() else None

    def kill(self) -> None:
        with contextlib.suppress(OSError):
            self._link.shutdown(socket.SHUT_RDWR)
        self._thread.join(PATIENCE)
        assert not self._thread.is_alive()

    def _run(self, talk: Callable[[socket.socket], object]) -> None:
        try:
            talk(self._link)
            self._link.shutdown(socket.SHUT_WR)
            self._is_done = True
            while self._link.recv(65536):
                pass
        except OSError:
            pass  # the marker has hung up
        finally:
            self._link.close()
