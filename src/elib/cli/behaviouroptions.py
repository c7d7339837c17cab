"""The options of a behaviour as options of a command line: of one that comes with elib, or of one in a file."""

from __future__ import annotations

from dataclasses import make_dataclass
from typing import Annotated, Any

from cyclopts import Parameter as Cli

from elib.base.rules import number_from
from elib.behaviours import Behaviour
from elib.behaviours._run.context import DEFAULT_SEED
from elib.cli.arguments import option
from elib.cli.terminal import typed
from elib.link.protocol.profiles import rule

Seed = Annotated[int, option("--seed N", "Seed of the behaviour's random numbers: same seed, same run.")]


def options_of(behaviour: Behaviour) -> type[Any]:
    """Return a class whose fields are the options of a behaviour, and its seed unless it has an option of that name."""
    fields: dict[str, tuple[object, object]] = {"seed": (Seed, DEFAULT_SEED)}
    for each in behaviour.options:
        about = ": ".join(filter(None, (behaviour.meanings.get(each.name), rule(each.quantity))))
        annotation = Annotated[str, Cli(name=f"--{each.name}", metavar=each.name[:1].upper(), help=f"{about}.")]
        fields[each.name] = annotation, typed(each.default)
    made = [(name, annotation, default) for name, (annotation, default) in fields.items()]
    kind = make_dataclass("Options", made, frozen=True)
    kind.__module__ = __name__  # cyclopts does not look into a class of Python's own modules
    return kind


def given_in(options: Any, behaviour: Behaviour) -> dict[str, Any]:
    """Return what :func:`elib.play` takes: the ``options`` of a behaviour and its ``seed``."""
    values = {each.name: number_from(getattr(options, each.name)) for each in behaviour.options}
    return {"options": values} if "seed" in values else {"options": values, "seed": options.seed}
