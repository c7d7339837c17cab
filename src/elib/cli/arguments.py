"""Options that several commands share, and the checks of their values."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.rules import DURATION

FAST_SIMULATION = "sim://?speed=max"
"""The robot if none is given and no person has to watch: a virtual one, as fast as the processor allows."""


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
SameUrl = Annotated[str | None, Cli(name="--robot", metavar="URL", help="Another way to name the robot.")]
AsJson = Annotated[bool, Cli(name="--json", help="Print one line of JSON.")]
Workers = Annotated[int | None, Cli(name="--workers", metavar="N", help="Worker processes of this computer.")]
Cluster = Annotated[
    str | None, Cli(name="--cluster", metavar="URL", help="A Dask cluster's scheduler: tcp://HOST:8786.")
]
Seconds = Annotated[float | None, DURATION, Cli(name="--for", metavar="S", help="Robot time to run for, seconds.")]


def one_of(url: str | None, robot: str | None) -> str | None:
    """Return the robot that was named, as an argument or by --robot.

    Raises:
        ArgumentError: Two were named.
    """
    if url is not None and robot is not None:
        raise ArgumentError(f"two robots were named: {url} and {robot}", hint="name one of them")
    return url or robot
