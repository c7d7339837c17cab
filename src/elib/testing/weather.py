"""Bad weather for tests: virtual robots whose links and batteries fail by a script."""

from __future__ import annotations

import os
from pathlib import Path

from elib.emulator.player import Counts, FaultPlayer
from elib.emulator.sim import SimTransport
from elib.emulator.weather import FaultScript
from elib.emulator.weatherfile import gallery, load
from elib.errors import ArgumentError
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck
from elib.transport.url import Url, parse_url

__all__ = ["Counts", "FaultPlayer", "FaultScript", "faults_of", "scripts", "weather"]


def scripts() -> list[str]:
    """Return the names of the fault scripts that come with elib, in alphabetical order."""
    return gallery()


def weather(script: str | os.PathLike[str], url: str = "sim://?speed=max") -> str:
    """Return the URL of a virtual robot in bad weather.

    ::

        async with elib.open(weather("flaky-bluetooth")) as robot: ...
        with elib.connect(weather("storm.toml", "sim://square?speed=max&seed=3")) as robot: ...

    Args:
        script: Name of a script that comes with elib (:func:`scripts`), or the path of a TOML file.
        url: The simulation; its seed, if it has one, replaces the script's.

    Raises:
        ArgumentError: There is no such script, or the URL is none of a simulation, or has a script already.
        SimulationError: The script breaks a rule; the message names the file, the key and a cure.
    """
    name = os.fspath(script)
    if isinstance(script, Path) and "/" not in name and os.sep not in name:
        name = os.path.join(os.curdir, name)  # a path is a path, even where a script has the same name
    load(name)
    parsed = parse_url(url)
    if parsed.scheme != "sim":
        raise ArgumentError(f"{url} is no simulation: its weather cannot be chosen", hint="write sim://?speed=max")
    if "fault" in parsed.keys:
        raise ArgumentError(f"{url} has a fault script already", hint="leave fault= out of the URL")
    return str(Url("sim", parsed.target, (*parsed.query, ("fault", name))))


def faults_of(robot: Epuck | BlockingEpuck) -> FaultPlayer:
    """Return the fault script at work on *robot*; its ``counts`` say what it has done so far.

    Args:
        robot: Opened with ``sim://?fault=``; with a blocking one look while no call is under way.

    Raises:
        ArgumentError: It has no fault script.
        LinkClosed: The robot is not open yet.
    """
    if isinstance(robot, BlockingEpuck):
        robot = robot._robot  # noqa: SLF001  # what a test looks at is behind the blocking style
    transport = robot.session.transport
    if not isinstance(transport, SimTransport) or transport.robot.player is None:
        raise ArgumentError(f"{robot.url} has no fault script", hint="open weather('flaky-bluetooth')")
    return transport.robot.player
