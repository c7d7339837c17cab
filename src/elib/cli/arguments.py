"""Options that several commands share, and the checks of their values."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.rules import DURATION

FAST_SIMULATION = "sim://?speed=max"
"""The robot if none is given and no person has to watch: a virtual one, as fast as the processor allows."""


def option(shown: str, about: str, **how: Any) -> Cli:
    """Return an option as help pages show it: ``--plot FILE`` or ``--output, -o OUT``, and what it is for."""
    words = shown.replace(", ", " ").split(" ")
    names = [word for word in words if word.startswith("-")]
    return Cli(name=names, metavar=next(iter(words[len(names) :]), None), help=about, **how)


def _check_alone(_: object, url: str | None) -> None:
    if url is not None and len(url.split("://")) > 2 and " " in url:
        raise ValueError("This command drives one robot: name it by --robot URL.")


RobotUrl = Annotated[
    str,
    Cli(
        name="--robot",
        metavar="URL",
        env_var="ELIB_ROBOT",  # elib.robot.substitute.VARIABLE, which is not imported for a list of commands
        show_env_var=False,
        validator=_check_alone,
        help="sim://, serial:///dev/rfcomm0, tcp://HOST:PORT, ...; ELIB_ROBOT can name it too.",
    ),
]
NamedUrl = Annotated[str | None, Cli(help="serial:///dev/rfcomm0, COM3, rfcomm://..., tcp://HOST:PORT, ...")]
SameUrl = Annotated[str | None, option("--robot URL", "Another way to name the robot.")]
AsJson = Annotated[bool, option("--json", "Print one line of JSON.")]
Workers = Annotated[int | None, option("--workers N", "Worker processes of this computer.")]
Cluster = Annotated[str | None, option("--cluster URL", "A Dask cluster's scheduler: tcp://HOST:8786.")]
View = Annotated[
    str | None, option("--view [HOST:PORT]", "Show it live in the browser; without a value, from 127.0.0.1:8600 on.")
]
Seconds = Annotated[float | None, DURATION, option("--for S", "Robot time to run for, seconds.")]


def one_of(url: str | None, robot: str | None) -> str | None:
    """Return the robot that was named, as an argument or by --robot."""
    if url is not None and robot is not None:
        raise ArgumentError(f"two robots were named: {url} and {robot}", hint="name one of them")
    return url or robot
