"""Control functions are compiled in each process, and again when what they use changes; kernels are kept on disk.

The quick tests let several engines of one process take the places of several processes.
"""

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from elib.simulator.physics import engine
from shared import PATIENCE

PROGRAM = '''
import enum, math, shutil, sys
from collections import namedtuple
from numpy import exp, float64
import numba.core.event
import numpy as np
import settings
from elib.simulator.physics.engine import call, engine_named, kernel

compiled = []

class Listener(numba.core.event.Listener):
    def on_start(self, event):
        compiled.append(event.data["dispatcher"].py_func.__name__)

    def on_end(self, event):
        pass

numba.core.event.register("numba:compile", Listener())

@kernel
def apply(law, row):
    call(law, (row,))

def run(law, x=10.0):
    def put(row):
        row[0] = law(row[0])

    engine = engine_named("compiled")
    row = engine.table([[x]])[0]
    engine.ready(apply)(engine.argument(put, lambda: (row,)), row)
    return row[0]

def laws_with(n):
    """Return laws that differ only in what they use: all have the name ``law``."""
    global NUMBER, ARRAY, TUPLE, OFFSET
    NUMBER, ARRAY, OFFSET = n, np.full(2000, 1.0 * n), n
    TUPLE = namedtuple("Pair", "name rows")("a", (np.arange(2000.0), ARRAY))
    settings.NUMBER, settings.LEVEL.value = n, n
    Mode = enum.IntEnum("Mode", {"FAST": n})

    def by_closure(x):
        return x + n

    def by_default(x, k=n):
        return x + k

    def helper(x):
        return x + OFFSET

    def by_helper(x):
        return helper(x)

    def by_mode(x):
        return x + 1 * Mode.FAST

    def by_tuple(x):
        return x + rows[1000]

    rows = TUPLE.rows[1]
    laws = [by_number, by_array, by_module, by_level, by_closure, by_default, by_helper, by_mode, by_tuple]
    source = {}
    exec(f"def by_source(x): return x + {n}", source)
    return [*laws, source["by_source"]]

def by_number(x):
    return float64(x) + NUMBER * exp(0.0)

def by_array(x):
    return x + ARRAY[1000]

def by_module(x):
    return x + settings.NUMBER

def by_level(x):
    return math.floor(x) + settings.LEVEL.value

def main(words):
    """Run the laws with each of the numbers; return how many kernels were compiled."""
    for word in words:
        if word == "rmtree":
            shutil.rmtree(words[-1])
            continue
        if word.isdigit():
            found = {run(law) for law in laws_with(int(word))}
            assert found == {10 + int(word)}, found
    return compiled.count("apply")

if __name__ == "__main__":
    print(main(sys.argv[1:]))
'''

SETTINGS = "import level as LEVEL\nNUMBER = 0\n"


@pytest.fixture
def files(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    (tmp_path / "settings.py").write_text(SETTINGS)
    (tmp_path / "level.py").write_text("value = 0\n")
    (tmp_path / "law.py").write_text("def law(x):\n    return x + 1\n")
    return tmp_path


@pytest.fixture
def here(files, monkeypatch, own_kernel):
    """Return the program as a module, whose functions are compiled by an engine that knows nothing yet."""
    monkeypatch.syspath_prepend(files)
    for name in ("program", "settings", "level"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    module = importlib.import_module("program")

    def begin(cache=files / "cache"):
        monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
        monkeypatch.setenv("LOCALAPPDATA", str(cache))
        another = engine.Compiled()
        monkeypatch.setattr(module, "engine_named", lambda name: another)
        return module

    yield begin
    for name in ("program", "settings", "level"):
        sys.modules.pop(name, None)
    engine._kernels.discard(module.apply)


@pytest.fixture
def program(files):
    """Return a function that runs the program in a process of its own and returns how many functions it compiled."""

    def start(*words, cache=files / "cache"):
        return subprocess.Popen(
            [sys.executable, files / "program.py", *words, cache],
            cwd=files,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "XDG_CACHE_HOME": str(cache), "LOCALAPPDATA": str(cache)},
        )

    def run(*words, **more):
        return result_of(start(*words, **more))

    run.start = start
    return run


def result_of(process):
    out, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    return int(out)


def law_of(names):
    """Return the law of the file, as one that was defined where *names* says."""
    exec(compile(Path("law.py").read_text(), "law.py", "exec"), names)
    return names["law"]


def test_a_control_function_is_compiled_again_when_anything_that_it_uses_changes_and_only_then(here):
    program = here()
    counts = []
    for word in ("1", "1", "2", "1"):  # It fails unless each of the ten functions does what its own numbers say.
        program.compiled.clear()
        program.main(word)
        counts.append(program.compiled.count("put"))
    assert counts == [10, 0, 10, 0]
    program.ARRAY[1000] = 7.0
    assert program.run(program.by_array) == 17


def test_a_kernel_is_compiled_by_the_first_engine_and_found_by_the_next_one(here):
    assert here().main("1") == 1
    program = here()
    program.compiled.clear()
    assert program.main("1") == 0


def test_without_a_folder_to_keep_it_in_a_kernel_is_compiled_again(here, files):
    (files / "file").write_text("")
    for _ in range(2):
        program = here(files / "file")
        program.compiled.clear()
        assert program.main("5") == 1
    assert not list(files.rglob("*.nb?"))


@pytest.mark.parametrize("names", [{}, {"__name__": "a_module_that_cannot_be_imported"}], ids=["nowhere", "gone"])
def test_a_control_function_of_no_module_is_compiled_too(here, files, monkeypatch, names):
    monkeypatch.chdir(files)
    assert here().run(law_of({**names})) == 11


def test_what_a_control_function_raises_ends_the_run(here):
    program = here()

    def picky(x):
        if x > 5:
            raise ValueError("too much")
        return x

    assert program.run(picky, 4.0) == 4.0
    with pytest.raises(ValueError, match="too much"):
        program.run(picky)


@pytest.mark.long
def test_kernels_are_compiled_once_for_all_processes(program):
    assert program("1") == 1
    assert program("2", "1") == 0


@pytest.mark.long
def test_two_processes_may_compile_at_once_and_the_folder_may_vanish_meanwhile(program, tmp_path):
    processes = [program.start("3") for _ in range(2)]
    assert max([result_of(process) for process in processes]) > 0  # on a busy computer one may come after the other
    assert program("3") == 0
    assert program("rmtree", "4") == 1
    assert list((tmp_path / "cache").rglob("*.nbc"))


def test_the_folder_of_compiled_code_covers_the_kernels_and_the_versions_of_numba_and_numpy(monkeypatch, tmp_path):
    digest = engine._source_digest.__wrapped__
    digests = {digest()}
    for changed in ("numba", "numpy"):
        monkeypatch.setattr("importlib.metadata.version", lambda name, changed=changed: f"{name == changed}")
        digests.add(digest())
    monkeypatch.undo()
    kernels = shutil.copytree(os.path.dirname(engine.__file__), tmp_path / "physics")
    monkeypatch.setattr(engine, "__file__", str(kernels / "engine.py"))
    assert digest() in digests
    (kernels / "sensors" / "new.py").write_text("")
    (kernels / "noise.py").write_text((kernels / "noise.py").read_text() + "\n")
    assert digest() not in digests
    assert len(digests) == 3


def test_the_folder_of_compiled_code_covers_the_measures_of_the_robot(monkeypatch, tmp_path):
    digest = engine._source_digest.__wrapped__
    before = digest()
    base = shutil.copytree(os.path.dirname(engine.body.__file__), tmp_path / "base")
    monkeypatch.setattr(engine.body, "__file__", str(base / "body.py"))
    assert digest() == before
    (base / "infrared.py").write_text((base / "infrared.py").read_text() + "\n")
    assert digest() != before
