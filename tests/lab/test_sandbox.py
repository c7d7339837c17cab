from __future__ import annotations

import os
import platform
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hostile import runs

from elib.base.errors import Unsupported
from elib.lab import lockstep, sandbox
from elib.lab.sandbox import LIMITS, Child, Limits, start
from shared import wait_until

GREETING = (
    lockstep.LETTER.pack(1 + lockstep.GREETING.size + 1, lockstep.HELLO) + lockstep.GREETING.pack(1, 0.0, 1) + b"s"
)
"""What a marker with one robot says first."""

Runs = Callable[..., Child]


@pytest.fixture
def run(walls: None) -> Iterator[Runs]:
    """Run a program behind walls to its end; the files beside it are named without their ``.py``."""
    children = []

    def run(source: str, seconds: float = 60, limits: Limits = LIMITS, **files: str) -> Child:
        ours, theirs = socket.socketpair()
        with ours:
            ours.sendall(GREETING)
            with theirs:
                every = {"main.py": source} | {f"{name}.py": text for name, text in files.items()}
                contents = {name: text.encode() for name, text in every.items()}
                children.append(start(contents, "main.py", theirs, limits=limits))
            children[-1].wait(seconds)
        code = children[-1].poll()
        children[-1].kill()
        children[-1].ended_with = code
        return children[-1]

    yield run
    for child in children:
        child.kill()


def behind_walls(source: str, user: int) -> str:
    """Return what Python of the system prints behind the same walls."""
    if not Path("/usr/bin/python3").exists():
        pytest.skip("the system has no Python of its own")
    walls = sandbox._walls((), (), Limits(), user == 0)
    command = [*walls, *(() if user else ("/usr/bin/setpriv", "--reuid=61999", "--regid=61999", "--clear-groups"))]
    command += ["/usr/bin/python3", "-c", source]
    environment = sandbox._environment("/home/student")
    who = {} if user == os.geteuid() else {"user": user, "group": user, "extra_groups": []}
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment, cwd="/", **who)
    return done.stdout + done.stderr


USERS = (0, 65534) if os.geteuid() == 0 else (os.geteuid(),)


@pytest.mark.usefixtures("walls")
@pytest.mark.parametrize("user", USERS)
def test_the_walls_hold(user: int) -> None:
    said = behind_walls(
        """
import os, socket
def tries(name, what):
    try: print(name, "CAN", what())
    except OSError as error: print(name, "cannot", error)
def write(path): open(path, "w").write("x"); return path
for place in ("/", "/usr", "/usr/bin", "/dev", "/etc", "/proc/sys/kernel"):
    tries("write", lambda: write(place + "/elib-owned"))
tries("root", lambda: os.setuid(0) if os.getuid() else 1 / 0)
tries("network", lambda: socket.create_connection(("192.0.2.1", 80), 2))
tries("loopback", lambda: socket.create_connection(("127.0.0.1", 22), 2))
others = sorted(int(name) for name in os.listdir("/proc") if name.isdigit() and int(name) != os.getpid())
print("others", others)
for other in others:
    tries("memory", lambda: open(f"/proc/{other}/mem", "r+b"))
    tries("signal", lambda: os.kill(other, 9))
print("places", sorted(os.listdir("/")))
tries("home", lambda: write("/home/student/mine"))
print("capabilities", [line.split()[1] for line in open("/proc/self/status") if line.startswith("CapEff")])
""",
        user,
    )
    can = [line for line in said.splitlines() if " CAN " in line]
    assert can == ["home CAN /home/student/mine"], said
    assert said.count("cannot") == (11 if user == 0 else 9), said
    assert f"others {[1] if user == 0 else []}" in said
    assert "'tmp'" in said
    assert "capabilities ['0000000000000000']" in said
    for place in ("root", "work", "var"):
        assert f"'{place}'" not in said


def test_a_program_sees_only_its_own_files(run: Runs) -> None:
    child = run("import helper, os; print(sorted(os.listdir()), helper.NAME)", helper="NAME = 'mine'")
    assert child.output == "['helper.py', 'main.py'] mine\n"


HARMLESS = """
import os, threading, tempfile, traceback, json, asyncio, multiprocessing, ctypes, subprocess, logging, pathlib
import platform, uuid, time, pickle, inspect, sqlite3, glob
import numpy as np
from PIL import Image
Image.fromarray(np.zeros((10, 10), dtype=np.uint8)).save("a.png")
Image.open("a.png").load()
np.savetxt("x.csv", np.linalg.inv(np.eye(30)))
np.loadtxt("x.csv")
try: 1 / 0
except ZeroDivisionError: traceback.print_exc()
thread = threading.Thread(target=lambda: open("x.csv").read())
thread.start()
thread.join()
with tempfile.NamedTemporaryFile() as file: file.write(b"x")
with tempfile.TemporaryDirectory() as folder: open(folder + "/x", "w").close()
async def work(): await asyncio.sleep(0)
asyncio.run(work())
platform.platform(), uuid.uuid4(), uuid.getnode(), platform.processor(), time.localtime()
logging.basicConfig(filename="log.txt")
logging.error("x")
import elib
inspect.getsource(elib.connect)
os.makedirs("out/a", exist_ok=True)
pathlib.Path("out/a/b.json").write_text(json.dumps({}))
list(os.walk(os.path.expanduser("~"))), glob.glob("*.png"), os.listdir()
sqlite3.connect("mine.db").close()
open(os.devnull, "w").close()
os.kill(os.getpid(), 0)
try:
    import matplotlib.pyplot as plt
    plt.plot([1, 2])
    plt.savefig("p.png")
except ImportError: pass
print("all done")
"""


@pytest.mark.long
def test_what_libraries_do_for_an_honest_program_works(run: Runs) -> None:
    child = run(HARMLESS)
    assert "all done" in child.output, child.output


def test_files_of_the_submission_shadow_nothing(run: Runs) -> None:
    names = ("elib", "os", "runpy", "sitecustomize", "usercustomize", "pickle", "conftest")
    child = run(
        "import elib, os; print(elib.__file__.endswith('elib/__init__.py'), os.sep)",
        **{name: f"print('shadowed {name}')" for name in names},
    )
    assert child.output == "True /\n"


@pytest.mark.long
def test_it_prints_as_much_as_it_likes_and_little_is_kept(run: Runs) -> None:
    child = run("line = 'x' * 100_000\nprint('begin')\nfor _ in range(2000): print(line)\nprint('end')")
    assert child.ended_with == 0
    assert child.output.startswith("begin")
    assert child.output.endswith("end\n")
    assert len(child.output) < 70_000


@pytest.mark.parametrize(
    ("source", "says"),
    [
        pytest.param("import re; re.match('(a+)+$', 'a' * 40 + 'b')", "computed", marks=pytest.mark.long),
        ("s = []\nwhile True: s.append(bytearray(10_000_000))", "memory"),
    ],
)
def test_what_takes_too_much_is_ended_and_says_so(run: Runs, source: str, says: str) -> None:
    child = run(source, limits=Limits(cpu=2, memory=300 << 20))
    assert says in child.exceeded
    assert child.ended_with == -9


def test_threads_and_files_have_an_end(run: Runs) -> None:
    child = run(
        """
import threading
park = threading.Event()
try:
    for count in range(1000): threading.Thread(target=park.wait, daemon=True).start()
except RuntimeError: print(count < 100)
try:
    for number in range(1000):
        with open(f"{number}", "wb") as file: file.write(bytes(1 << 20))
except OSError as error: print(number < 70, error.strerror)
try: kept = [open("0", "rb") for _ in range(1000)]
except OSError as error: print(error.strerror)
"""
    )
    assert child.output == "True\nTrue No space left on device\nToo many open files\n"


@pytest.mark.skipif(platform.machine() not in ("x86_64", "aarch64"), reason="no filter for this processor")
def test_memory_that_no_limit_counts_is_refused(run: Runs) -> None:
    child = run("import os\ntry: os.memfd_create('x')\nexcept OSError as error: print(error.strerror)")
    assert child.output == "Operation not permitted\n"


def test_the_environment_and_the_command_lines_tell_nothing(run: Runs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SECRET_OF_THE_TEACHER", "42")
    child = run("import os, sys; print(dict(os.environ), sys.argv, sys.stdin.read())")
    assert "SECRET" not in child.output
    assert str(Path.home()) not in child.output.replace(sys.base_prefix, "")


@pytest.mark.usefixtures("walls")
def test_a_program_that_is_killed_leaves_nothing() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ours.sendall(GREETING)
        source = b"import threading\nprint('on', flush=True)\nthreading.Event().wait()"
        child = start({"main.py": source}, "main.py", theirs)
        wait_until(lambda: "on" in child.output)
        family = list(sandbox.family(child._process.pid))
        assert len(family) >= 2
        child.kill()
    wait_until(lambda: not any(map(runs, family)))


def test_without_bubblewrap_it_refuses_and_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(Unsupported, match=r"apt install bubblewrap.*--unsafe"):
        sandbox.check_walls()


def test_where_the_kernel_refuses_it_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: name)
    monkeypatch.setattr(
        sandbox, "_walls", lambda *_: ["sh", "-c", "echo bwrap: No permissions to create a namespace >&2; exit 1"]
    )
    with pytest.raises(Unsupported, match="No permissions to create a namespace"):
        sandbox.check_walls()
