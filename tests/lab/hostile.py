"""Programs that a marker has to stand. Most solve the lab as well, after a trick that must come to nothing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

HONEST = """
import elib
with elib.connect() as robot:
    robot.drive(0.10)
"""


@dataclass(frozen=True)
class Hostile:
    """A program, and what comes of it.

    Attributes:
        source: The program.
        said: A regular expression for one of the marker's remarks; None if nothing need be said.
        shows: A regular expression for what it prints; None if that depends on who marks, or is harmless.
        breaks: Whether it breaks the rules of the link, and has no points.
    """

    source: str
    said: str | None = None
    shows: str | None = None
    breaks: bool = False


def before(trick: str, shows: str | None = None, said: str | None = None) -> Hostile:
    """Return a program that does the trick, whatever comes of it, and then solves the lab."""
    body = "".join(f"    {line}\n" for line in trick.strip().splitlines())
    return Hostile(f"try:\n{body}except BaseException as error:\n    print(repr(error))\n{HONEST}", said, shows)


NOT_THERE = "FileNotFoundError|PermissionError|Read-only file system"
NO_NETWORK = "unreachable|refused"
COMPUTED = "computed for more than"

HOSTILE = {
    # What never ends, and what takes all there is.
    "endless_loop": Hostile("while True: pass\n", COMPUTED),
    "endless_in_robot_time": Hostile("import elib\nwith elib.connect() as robot:\n    while True: robot.proximity()\n"),
    "endless_threads": Hostile(
        "import threading\ndef spin():\n    while True: pass\n"
        "for _ in range(10000): threading.Thread(target=spin).start()\n",
        "failed|exit code|computed",
    ),
    "eats_memory": Hostile("eaten = []\nwhile True: eaten.append(bytearray(50_000_000))\n", "memory|exit"),
    "eats_shared_memory": Hostile(
        "import mmap\neaten = []\nwhile True:\n"
        "    eaten.append(mmap.mmap(-1, 1 << 25))\n    eaten[-1][:] = bytes(1 << 25)\n",
        "memory|exit code",
    ),
    "prints_a_gigabyte": Hostile("line = 'x' * 100_000\nfor _ in range(10_000): print(line)\n" + HONEST),
    "fills_the_disk": Hostile(
        "for n in range(10_000):\n    with open(f'{n}.bin', 'wb') as f: f.write(bytes(1_000_000))\n",
        "exit code",
    ),
    "one_huge_file": Hostile(
        "with open('a.bin', 'wb') as f:\n    while True: f.write(bytes(1_000_000))\n", "exit code"
    ),
    # Other processes.
    "fork_bomb": Hostile(
        "import os\nwhile True:\n    try: os.fork()\n    except OSError: pass\n", f"memory|{COMPUTED}"
    ),
    "leaves_a_process": before("import os\nif os.fork() == 0:\n    while True: pass"),
    "shell": before("import subprocess\nsubprocess.run(['sh', '-c', 'id'])"),
    "os_system": before("import os\nos.system('id')"),
    "uses_multiprocessing": before(
        "import multiprocessing\nmultiprocessing.get_context('fork').Process(target=print).start()"
    ),
    "kills_the_marker": before("import os, signal\nos.kill(os.getppid(), signal.SIGKILL)"),
    "kills_everybody": before("import os\nos.kill(-1, 9)", "ProcessLookupError"),
    "reads_proc": before("print(open('/proc/1/environ', 'rb').read())", f"{NOT_THERE}|PYTHONHASHSEED"),
    "writes_proc_mem": before("import os\nopen(f'/proc/{os.getppid()}/mem', 'r+b')", NOT_THERE),
    "ptrace": before("import ctypes\nctypes.CDLL(None).ptrace(16, 1, 0, 0)"),
    # Files.
    "reads_hidden_variants": before("print(open('{lab}/teacher/hidden.toml').read())", NOT_THERE),
    "reads_the_solution": before("import shutil\nshutil.copy('{lab}/teacher/solution.py', 'mine.py')", NOT_THERE),
    "reads_another_one": before("from pathlib import Path\nprint(Path('{class}/honest.py').read_text())", NOT_THERE),
    "lists_the_class": before("import os\nprint(os.listdir('{class}'))", NOT_THERE),
    "writes_outside": before("open('{class}/owned.txt', 'w').write('x')", NOT_THERE),
    "reads_passwords": before("print(open('/etc/passwd').read())", NOT_THERE),
    "changes_elib": before("import elib, pathlib\npathlib.Path(elib.__file__).write_text('')", NOT_THERE),
    "links_out": before("import os\nos.symlink('/etc/shadow', 'mine')\nprint(open('mine').read())", NOT_THERE),
    # The network.
    "network": before("import urllib.request\nurllib.request.urlopen('http://192.0.2.1/')", NO_NETWORK),
    "phones_home": before("import socket\nsocket.create_connection(('127.0.0.1', 22), 1)", NO_NETWORK),
    "opens_a_port": before("import socket\ns = socket.socket()\ns.bind(('', 9999))"),
    # The simulator and its link.
    "searches_the_memory": before(
        "import gc\nfor thing in gc.get_objects():\n    if type(thing).__name__ == 'Simulation': print(thing)",
        shows=r"\A\Z",
    ),
    "climbs_frames": before(
        "import sys\nframe = sys._getframe()\nwhile frame:\n    print(list(frame.f_globals))\n    frame = frame.f_back",
    ),
    "forges_messages": Hostile(
        "import os\nfor fd in range(3, 200):\n"
        "    try: os.write(fd, b'\\xff' * 64)\n    except OSError: pass\n" + HONEST,
        "broke the link's rules",
        breaks=True,
    ),
    "opens_the_link": before(
        "import os\nfor fd in range(3, 200):\n    try: os.fdopen(fd, 'wb')\n    except OSError: pass",
        said="exit code",  # the file is closed at once, and the link with it
    ),
    "closes_the_link": Hostile("import os\nos.closerange(3, 200)\n" + HONEST, "exit code|failed|broke"),
    "leaves_in_the_middle": Hostile("import elib, os\nrobot = elib.connect()\nrobot.set_speed(1, 1)\nos._exit(0)\n"),
    "says_it_is_done": Hostile("import sys\nprint('all goals hold')\nsys.exit(0)\n"),
    "lies_about_time": Hostile(
        "import elib, asyncio, time\ntime.monotonic = lambda: 0.0\ntime.time = lambda: 0.0\n"
        "asyncio.BaseEventLoop.time = lambda self: 0.0\n" + HONEST
    ),
    "asks_for_the_world": before(
        "import elib\nfrom elib.testing import world_of\nwith elib.connect() as robot:\n    world_of(robot)",
        "Unsupported|Error",
    ),
    "rewrites_elib": before(
        "import elib.lab.marker as marker\nmarker.judge = marker.run_variant = lambda *a, **k: None"
    ),
}
"""Hostile programs by name. ``{lab}`` and ``{class}`` stand for the folders of the lab and of the submissions."""


def runs(process: int) -> bool:
    """Return whether a process is there and not merely waiting for its parent to notice its end."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
