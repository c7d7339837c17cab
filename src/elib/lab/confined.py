"""The first code in a submission's process: it gives up root, sets the limits, unpacks the files, and runs the program.

It runs as a script and reads its task from its standard input, so no file or variable tells the program about it.
Until the limits hold, it imports nothing but modules of Python.
"""

from __future__ import annotations

import os
import pickle
import resource
import runpy
import sys
from pathlib import Path
from typing import Any


def prepare(task: dict[str, Any]) -> None:
    """Give up root, set the limits for good, and write the submission's files."""
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)
    if task["user"]:
        os.setgroups([])
        os.setresgid(*[task["user"]] * 3)
        os.setresuid(*[task["user"]] * 3)
    for name, most in task["limits"].items():
        limit = getattr(resource, name)
        allowed = resource.getrlimit(limit)[1]
        most = most if allowed == resource.RLIM_INFINITY else min(most, allowed)
        resource.setrlimit(limit, (most, most))
    home = Path(task["home"])
    for folder in (home, Path(os.environ["TMPDIR"])):
        folder.mkdir(exist_ok=True)
    for name, content in task["files"].items():
        path = home / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    os.chdir(home)


def main() -> None:
    """Carry out the task on the standard input."""
    task = pickle.load(sys.stdin.buffer)
    prepare(task)
    os.write(1, task["ready"])
    # elib is imported from here, before the submission's folder is on the path: an elib.py there is never imported.
    sys.path[:] = task["path"]
    program = str(Path(task["home"]) / task["main"])
    sys.argv = ["elib.lab.program", str(task["link"]), program]
    sys.path.insert(0, os.devnull)  # elib.lab.program puts the submission's folder here
    runpy.run_module("elib.lab.program", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
