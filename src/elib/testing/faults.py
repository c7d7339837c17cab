"""Virtual robots whose links and batteries fail by a fault script, for tests."""

from __future__ import annotations

import os
from pathlib import Path

from elib.base.errors import ArgumentError
from elib.link.transport.url import Url, parse_url
from elib.simulator.emulator.faultplayer import FaultPlayer
from elib.simulator.emulator.faultscript import gallery, load
from elib.testing.inside import AnyEpuck, transport_of


def fault_scripts() -> list[str]:
    """Return the names of the fault scripts that come with elib, in alphabetical order."""
    return gallery()


def with_faults(script: str | os.PathLike[str], url: str = "sim://?speed=max") -> str:
    """Return the URL of a virtual robot under a fault script.

    ::

        async with elib.open(with_faults("flaky-bluetooth")) as robot: ...
        with elib.connect(with_faults("storm.toml", "sim://square?speed=max&seed=3")) as robot: ...

    Args:
        script: Name of a script that comes with elib (:func:`fault_scripts`), or the path of a TOML file.
        url: The simulation; its seed, if it has one, replaces the script's.

    Raises:
        ArgumentError: There is no such script, or the URL does not name a simulation, or has a script already.
        SimulationError: The script breaks a rule; the message names the file, the key and a cure.
    """
    name = os.fspath(script)
    if isinstance(script, Path) and "/" not in name and os.sep not in name:
        name = os.path.join(os.curdir, name)  # a path is a path, even where a script has the same name
    load(name)
    parsed = parse_url(url)
    if parsed.scheme != "sim":
        raise ArgumentError(f"{url} is not a simulation: it cannot have a fault script", hint="write sim://?speed=max")
    if "fault" in parsed.keys:
        raise ArgumentError(f"{url} has a fault script already", hint="leave fault= out of the URL")
    return str(Url("sim", parsed.target, (*parsed.query, ("fault", name))))


def faults_of(robot: AnyEpuck) -> FaultPlayer:
    """Return the fault script that runs on *robot*; its ``counts`` say what it has done so far.

    Args:
        robot: Opened with ``sim://?fault=``. Look at a blocking one only while no call runs.

    Raises:
        ArgumentError: The robot is not simulated in this process, or has no fault script.
        LinkClosed: The robot is not open yet.
    """
    player = transport_of(robot).robot.player
    if player is None:
        raise ArgumentError(f"{robot.url} has no fault script", hint="open with_faults('flaky-bluetooth')")
    return player
