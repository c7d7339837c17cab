"""Tasks by name: those that come with elib, and those in a file of yours."""

from __future__ import annotations

import importlib
import pkgutil
import sys
import traceback
from functools import cache
from pathlib import Path
from types import ModuleType

import elib.learn.tasks as shipped
from elib.base.errors import ArgumentError, ElibError
from elib.base.rules import nearest
from elib.simulator.physics.task import Task

TEAMS = "aggregation", "box_pushing", "dispersion", "foraging", "soccer"
"""Tasks of several robots, by their files: an environment of Gymnasium has one."""


@cache
def all_tasks() -> dict[str, Task]:
    """Return the tasks that come with elib, by name."""
    found = {}
    for module in pkgutil.iter_modules(shipped.__path__):
        task = importlib.import_module(f"{shipped.__name__}.{module.name}").TASK
        found[task.name] = task
    return found


def register() -> None:
    """Register with Gymnasium an environment for each task of one robot that comes with elib: ``elib/Avoid-v0``.

    Safe to repeat. The tasks themselves are not imported before they are used.
    """
    import gymnasium

    for module in pkgutil.iter_modules(shipped.__path__):
        if module.name in TEAMS:
            continue
        name = f"elib/{module.name.title().replace('_', '')}-v0"
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="elib.learn.envs:TaskEnv",
                vector_entry_point="elib.learn.envs:TaskVectorEnv",
                kwargs={"task": module.name.replace("_", "-")},
            )


def find_task(name: str) -> Task:
    """Return a task.

    Args:
        name: One that comes with elib, such as ``avoid``, or ``FILE.py:NAME``: a variable of a file of yours.

    Raises:
        ArgumentError: There is no such task.
    """
    file, _, variable = name.rpartition(":")
    if file.endswith(".py"):
        found = variable_of(Path(file), variable)
        if not isinstance(found, Task):
            raise ArgumentError(f"{variable} in {file} is {found!r}, not a Task")
        return found
    known = all_tasks()
    if name.endswith(".py"):
        raise ArgumentError(f"{name} is a file: which task of it?", hint=f"{name}:TASK, if it has TASK = Task(...)")
    if name not in known:
        raise ArgumentError(f"there is no task {name!r}", hint=nearest(name, known))
    return known[name]


def variable_of(file: Path, variable: str) -> object:
    """Return a variable of a Python file, which is run."""
    module = _module_of(file.resolve())
    if not hasattr(module, variable):
        public = [each for each in vars(module) if not each.startswith("_")]
        raise ArgumentError(f"{file} has no {variable!r}", hint=nearest(variable, public))
    return getattr(module, variable)


@cache
def _module_of(file: Path) -> ModuleType:
    if not file.is_file():
        raise ArgumentError(f"there is no file {file}", hint="give the path of a Python file, FILE.py:NAME")
    return run_file(ModuleType(f"elib.given.{file.stem}"), file, file.read_bytes())


def run_file(module: ModuleType, file: Path, source: str | bytes) -> ModuleType:
    """Run a Python file of the user as a module, and return it; the file can import what lies beside it."""
    module.__file__ = str(file)
    before = sys.modules.get(module.__name__)
    sys.modules[module.__name__] = module  # while it runs: its data classes look there for the types of their fields
    sys.path.insert(0, str(file.parent))
    try:
        exec(compile(source, str(file), "exec", dont_inherit=True), vars(module))
        return module
    except ElibError:
        raise
    except SyntaxError as error:
        hint = f"mend this line: {error.text.strip()}" if error.text else "run it with Python to see where"
        raise ArgumentError(
            f"{error.filename or file}:{error.lineno or 1} is not Python: {error.msg}", hint=hint
        ) from error
    except (Exception, SystemExit) as error:
        lines = [each.lineno for each in traceback.extract_tb(error.__traceback__) if each.filename == str(file)]
        place = f"{file}:{lines[-1]}" if lines else str(file)
        raise ArgumentError(f"{place} fails: {error!r}", hint="run it with Python to see where") from error
    finally:
        sys.path.remove(str(file.parent))
        if before is None:
            sys.modules.pop(module.__name__, None)  # other processes do not have it, and get its functions by value
