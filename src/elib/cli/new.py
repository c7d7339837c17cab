"""``elib new``: copy a sample to start from."""

from __future__ import annotations

import ast
import inspect
from importlib.resources import files
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.files import create_file
from elib.base.rules import nearest
from elib.behaviours import behaviours
from elib.cli.arguments import option
from elib.cli.terminal import quoted, table

Sample = Annotated[str | None, Cli(help="Name of the sample; --list shows them.")]
Target = Annotated[Path | None, Cli(help="The file to write (default: NAME.py).")]
Listed = Annotated[bool, option("--list", "List the samples.")]


def new(sample: Sample = None, file: Target = None, /, *, listed: Listed = False) -> None:
    """Copy a sample, to start your own program from. It never replaces a file.

    The samples are a few short programs, and the behaviours that `elib run --list` lists. `elib run my_robot.py` runs
    the copy as it is; `python my_robot.py` runs the copy of a program.

    For example:
        elib new --list
        elib new avoid my_avoid.py
    """
    there = samples()
    if sample is None:
        if not listed:
            raise ArgumentError("elib new needs the name of a sample", hint="elib new --list lists them")
        about = {name: ast.get_docstring(ast.parse(text)) or "" for name, text in there.items()}
        print(table([(name, text.partition("\n")[0]) for name, text in about.items()], indent=0))
        return
    name = sample.lower().replace("_", "-")
    if name not in there:
        raise ArgumentError(f"there is no sample {sample!r}", hint=nearest(name, tuple(there)))
    path = Path(f"{name.replace('-', '_')}.py") if file is None else file
    if path.suffix != ".py":
        raise ArgumentError(
            f"the file is {str(path)!r}; it must end in .py", hint=f"elib new {sample} {quoted(f'{path}.py')}"
        )
    create_file(path, there[name].encode())
    print(f"wrote {path}; try: elib run {quoted(path)}")


def samples() -> dict[str, str]:
    """Return the text of each sample by its name: the programs first, then the behaviours, each in alphabetical order.

    A behaviour whose name a program has is left out: the program is its shorter form.
    """
    programs = [
        each for each in files("elib.behaviours.samples").iterdir() if each.name.endswith(".py") and each.name[0] != "_"
    ]
    texts = {
        each.name.removesuffix(".py"): each.read_text("utf-8") for each in sorted(programs, key=lambda each: each.name)
    }
    for name, behaviour in behaviours().items():
        texts.setdefault(name, Path(inspect.getfile(behaviour.function)).read_text("utf-8"))
    return texts
