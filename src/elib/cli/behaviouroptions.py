"""The options of a behaviour as options of a command line: of one that comes with elib, or of one in a file."""

from __future__ import annotations

import enum
import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any

from cyclopts import Parameter as Cli

from elib.base.rules import number_from
from elib.behaviours import Behaviour
from elib.behaviours._run.context import DEFAULT_SEED
from elib.link.protocol.profiles import rule
from elib.link.protocol.table import Parameter

Seed = Annotated[
    int, Cli(name="--seed", metavar="N", help="Seed of the behaviour's random numbers: same seed, same run.")
]


def with_options(
    behaviour: Behaviour, play: Callable[..., object], more: Mapping[str, tuple[object, object]] | None = None
) -> Callable[..., None]:
    """Return a function whose parameters are the options of a behaviour and its seed, as the parser needs it.

    Args:
        behaviour: The behaviour.
        play: Called with the behaviour and what was given: ``options`` as a mapping, ``seed``, and *more* by name.
        more: Further options by name: default and annotation. An option of the behaviour of the same name counts.
    """
    own = {option.name: (_default(option), _annotation(option)) for option in behaviour.options}
    parameters: dict[str, tuple[object, object]] = {**(more or {}), "seed": (DEFAULT_SEED, Seed), **own}

    def command(**given: Any) -> None:
        options = {name: number_from(given.pop(name)) for name in own if name in given}
        play(behaviour, options=options, **given)

    command.__annotations__ = {name: annotation for name, (_, annotation) in parameters.items()}
    signature = inspect.Signature(
        [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
            for name, (default, annotation) in parameters.items()
        ]
    )
    setattr(command, "__signature__", signature)  # noqa: B010  # functions declare no such attribute
    return command


def _annotation(option: Parameter) -> object:
    return Annotated[str, Cli(metavar=option.name[:1].upper(), help=rule(option.quantity))]


def _default(option: Parameter) -> str:
    return option.default.name.lower() if isinstance(option.default, enum.Enum) else str(option.default)
