"""A submission in a process of its own, which sees nothing but Python, elib and its own files.

The walls are the namespaces of bubblewrap: no network, no other processes, a read-only system, and a home in memory
that is gone with the process. Limits bound what it uses. docs/guides/labs.md says what that does and does not prevent.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from elib.base.errors import Unsupported
from elib.base.files import LABS, PACKAGE
from elib.lab.syscalls import call_filter

CONFINED = Path(__file__).with_name("confined.py")
"""What is run; this process cannot import it on Windows."""
READY = b"ready\n"
"""What it prints first, when all walls and limits hold."""
HOME = "/home/student"
FIRST_USER, USERS = 61184, 4336
"""Numbers that systemd sets aside for users who exist for as long as one process (DynamicUser)."""
KEPT_START, KEPT_END = 60_000, 4_000
"""Characters kept of what a program prints: the beginning, and the end with its traceback."""
WATCH_EVERY = 0.1
"""s between two looks at how much memory and processor time all processes of a submission use together."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What a submission may use in one variant."""

    cpu: int = 10  # processor time of all its processes together, s
    memory: int = 1 << 30  # memory of all its processes together, bytes
    address_space: int = 4 << 30  # address space of each process, bytes; libraries reserve far more than they use
    disk: int = 64 << 20  # size of the files in its folder together, and of those in /tmp, bytes
    file: int = 32 << 20  # size of one file, bytes
    open_files: int = 128  # files that a process has open
    processes: int = 64  # processes and threads


LIMITS = Limits()
"""What a submission may use unless the marker says otherwise."""


_STARTED = count()


class Child:
    """A submission that runs."""

    def __init__(self, process: subprocess.Popen[bytes], task: bytes, limits: Limits, folder: Path | None) -> None:
        self.exceeded = ""  # which limit it exceeded, in words, or an empty string
        self._process = process
        self._limits = limits
        self._folder = folder
        self._start, self._end = bytearray(), bytearray()
        self._is_over = threading.Event()
        self._reader = threading.Thread(target=self._read, args=(task,), daemon=True)
        self._watcher = threading.Thread(target=self._watch, daemon=True)
        self._reader.start()
        self._watcher.start()

    @property
    def output(self) -> str:
        """What it printed so far; the middle of very much is left out."""
        gap = b"\n[...]\n" if len(self._end) == KEPT_END else b""
        return (bytes(self._start).removeprefix(READY) + gap + bytes(self._end)).decode(errors="replace")

    @property
    def began(self) -> bool:
        """Whether it got as far as the submission's program; read it after the end."""
        return self._start.startswith(READY)

    def wait(self, seconds: float) -> None:
        """Wait for its end, so long at most."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)

    def poll(self) -> int | None:
        """Return the exit code, None while it runs, or -N if signal N ended it."""
        code = self._process.poll()
        # bubblewrap returns 128 + N for a signal, as a shell does.
        return code if code is None or code <= 128 else 128 - code

    def kill(self) -> None:
        """End it and all that it started."""
        if not (self.exceeded or self._is_over.is_set()) and self.poll() in (-signal.SIGKILL, -signal.SIGXCPU):
            # The kernel was faster than the watcher.
            self.exceeded = f"computed for more than {self._limits.cpu} s"
        self._end_all()
        self._process.wait()
        self._is_over.set()
        self._reader.join(5)
        self._watcher.join(5)
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)

    def _read(self, task: bytes) -> None:
        """Hand over the task, then read what is printed to its end."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with contextlib.suppress(OSError), self._process.stdin as stdin:
            stdin.write(task)
        with self._process.stdout as stdout:
            while chunk := os.read(stdout.fileno(), 1 << 16):
                room = KEPT_START - len(self._start)
                self._start += chunk[:room]
                self._end = (self._end + chunk[max(room, 0) :])[-KEPT_END:]

    def _watch(self) -> None:
        while not self._is_over.wait(WATCH_EVERY) and self._process.poll() is None:
            cpu, memory = usage(self._process.pid)
            if memory > self._limits.memory:
                self.exceeded = f"used more than {self._limits.memory >> 20} MB of memory"
            elif cpu > self._limits.cpu:
                self.exceeded = f"computed for more than {self._limits.cpu} s"
            else:
                continue
            self._end_all()
            return

    def _end_all(self) -> None:
        """End its processes; bubblewrap takes all others in its namespace with it."""
        for number in [] if self._process.returncode is not None else list(family(self._process.pid)):
            with contextlib.suppress(OSError):
                os.kill(number, signal.SIGKILL)


def start(
    files: Mapping[str, bytes],
    main: str,
    link: socket.socket,
    *,
    limits: Limits = LIMITS,
    hidden: Iterable[Path] = (),
    safe: bool = True,
) -> Child:
    """Start a submission.

    Args:
        files: The submission's files by their paths within its folder.
        main: The file that is run.
        link: The program's end of the link to the marker.
        limits: What it may use.
        hidden: Folders of the teacher. They are hidden even where they lie beside Python or elib.
        safe: Whether it runs behind walls; otherwise only the limits hold.
    """
    arguments, path, own = _python()
    folder = None if safe else Path(tempfile.mkdtemp(prefix="elib-mark-"))
    home = HOME if folder is None else str(folder / "student")
    is_root = os.geteuid() == 0
    task = {
        "files": dict(files),
        "main": main,
        "home": home,
        "path": path,
        "link": link.fileno(),
        "ready": READY,
        # The two programs of a game are two users, so that the processes of one do not count for the other.
        "user": FIRST_USER + (2 * os.getpid() + next(_STARTED) % 2) % USERS if safe and is_root else 0,
        "limits": {
            # The watcher is more exact, and says why: the kernel counts whole ticks here.
            "RLIMIT_CPU": 2 * limits.cpu,
            "RLIMIT_AS": limits.address_space,
            "RLIMIT_FSIZE": limits.file,
            "RLIMIT_NOFILE": limits.open_files,
            "RLIMIT_CORE": 0,
        }
        # Without a namespace it would count the processes of all programs of this user.
        | ({"RLIMIT_NPROC": limits.processes} if safe else {}),
    }
    opened = [link.fileno()]
    walls: list[str] = []
    if safe:
        walls = _walls(own, [place.resolve() for place in hidden], limits, is_root)
        if (refused := call_filter()) is not None:
            rules, given = os.pipe()
            os.write(given, refused)
            os.close(given)
            opened.append(rules)
            walls += ["--seccomp", str(rules)]
    try:
        process = subprocess.Popen(
            [*walls, *(["--"] if safe else []), *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            bufsize=0,
            pass_fds=opened,
            env=_environment(home),
            cwd="/",
            start_new_session=True,
        )
    finally:
        for descriptor in opened[1:]:
            os.close(descriptor)
    return Child(process, pickle.dumps(task), limits, folder)


def check_walls() -> None:
    """Check that submissions can run behind walls here."""
    unsafe = "with --unsafe they run with your rights: only for programs that you have read"
    if sys.platform != "linux":
        raise Unsupported("submissions can be isolated on Linux only", hint=f"use a virtual machine, or {unsafe}")
    if shutil.which("bwrap") is None:
        raise Unsupported(
            "submissions are programs of other people, and bubblewrap, which isolates them, is not installed",
            hint=f"sudo apt install bubblewrap (or dnf, pacman, zypper); {unsafe}",
        )
    ours, theirs = socket.socketpair()
    ours.close()  # it is enough that the program would begin
    with theirs:
        child = start({"probe.py": b""}, "probe.py", theirs)
        child.wait(20)
        child.kill()
    if not child.began:
        reason = child.output.strip().splitlines()[-1:] or ["it did not start"]
        raise Unsupported(
            f"bubblewrap cannot isolate programs here: {reason[0]}",
            hint="in a container, start it with the right to make namespaces (--privileged); where only AppArmor is in"
            f" the way: sudo sysctl kernel.apparmor_restrict_unprivileged_userns=0; {unsafe}",
        )


def usage(process: int) -> tuple[float, int]:
    """Return the processor time, s, and the memory, bytes, of a process and all that descend from it.

    Both are 0 on a system without /proc.
    """
    cpu, memory = 0.0, 0
    for number in family(process):
        folder = Path("/proc") / str(number)
        with contextlib.suppress(OSError, ValueError):  # it ended meanwhile
            times = (folder / "stat").read_text(errors="replace").rpartition(")")[2].split()[11:15]
            cpu += sum(map(int, times)) / os.sysconf("SC_CLK_TCK")
            for line in (folder / "status").read_text(errors="replace").splitlines():
                if line.startswith(("RssAnon:", "RssShmem:", "VmSwap:")):
                    memory += int(line.split()[1]) << 10
    return cpu, memory


def family(process: int) -> Iterator[int]:
    """Yield a process and all that descend from it, as the kernel lists them."""
    waiting = [process]
    while waiting:
        number = waiting.pop()
        yield number
        with contextlib.suppress(OSError):
            for thread in Path(f"/proc/{number}/task").iterdir():
                with contextlib.suppress(OSError):
                    waiting += map(int, (thread / "children").read_text().split())


def _python() -> tuple[list[str], list[str], list[str]]:
    """Return how Python is started, its path for imports, and the folders in which it and elib are.

    Its own start-up files (``.pth``, ``sitecustomize``) are passed over: the path is given, not found.
    """
    package = str(PACKAGE)
    installed = [entry for entry in sys.path if os.path.basename(entry) in ("site-packages", "dist-packages")]
    path = [
        entry
        for entry in sys.path
        if entry not in ("", os.path.dirname(sys.executable))
        and (entry in installed or any(_within(entry, root) for root in (sys.base_prefix, os.path.dirname(package))))
    ]
    program = os.path.realpath(getattr(sys, "_base_executable", sys.executable))
    folders = [os.path.realpath(sys.base_prefix), sys.base_prefix, *installed, package]
    return [program, "-S", "-P", str(CONFINED)], path, folders


def _walls(own: Sequence[str], hidden: Iterable[Path], limits: Limits, is_root: bool) -> list[str]:
    """Return the command line of bubblewrap up to the program that it starts."""
    walls = ["bwrap", "--unshare-ipc", "--unshare-pid", "--unshare-net", "--unshare-uts", "--unshare-cgroup-try"]
    if is_root:
        # Root keeps its own user namespace, in which the child becomes a user that owns nothing.
        walls += ["--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID"]
    else:
        # Without bubblewrap's own process inside, which has the same user and none of the limits.
        walls += ["--unshare-user", "--disable-userns", "--as-pid-1"]
    walls += ["--die-with-parent", "--new-session", "--hostname", "lab"]
    walls += ["--proc", "/proc", "--dev", "/dev", "--remount-ro", "/dev"]
    for folder in (HOME, "/tmp"):  # before what may lie in them, such as elib
        walls += ["--perms", "1777", "--size", str(limits.disk), "--tmpfs", folder]
    for folder in ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64"):
        if os.path.islink(folder):
            walls += ["--symlink", os.readlink(folder), folder]
        else:
            walls += ["--ro-bind-try", folder, folder]
    for file in ("ld.so.cache", "alternatives", "localtime", "fonts"):
        walls += ["--ro-bind-try", f"/etc/{file}", f"/etc/{file}"]
    for folder in dict.fromkeys(own):
        if not _within(folder, "/usr"):
            # Made by hand, its parent can be entered by every user.
            walls += ["--dir", os.path.dirname(folder), "--ro-bind", folder, folder]
    gone: list[str] = []
    for place in (str(PACKAGE / LABS), *map(str, hidden)):
        is_seen = any(_within(place, folder) for folder in ("/usr", *own))
        if os.path.isdir(place) and is_seen and not any(_within(place, folder) for folder in gone):
            gone.append(place)
            walls += ["--tmpfs", place, "--remount-ro", place]
    return [*walls, "--remount-ro", "/"]


def _within(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip("/") + "/")


def _environment(home: str) -> dict[str, str]:
    return {
        "HOME": home,
        "TMPDIR": "/tmp" if home == HOME else str(Path(home).with_name("tmp")),
        "PATH": "/usr/bin:/bin",
        "LANG": "C.UTF-8",
        "MPLBACKEND": "Agg",
        "PYTHONHASHSEED": "0",  # the same order of sets on every run
        "PYTHONUNBUFFERED": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
        # One thread each, or libraries reserve address space for every core of a large machine.
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
    }
