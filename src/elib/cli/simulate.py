"""``elib simulate``: virtual robots on serial ports, TCP ports and Wi-Fi, for any program."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import os
import re
import sys
import threading
from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.extras import check_web
from elib.base.files import write_file
from elib.base.rules import Number, Whole, rule_of
from elib.cli.arguments import View, option
from elib.cli.terminal import say
from elib.link.protocol.profiles import EPUCK2_WIFI, FIRMWARES
from elib.robot.running import ending, run_coroutine
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.faultscript import gallery as scripts
from elib.simulator.emulator.loopback import EVERYWHERE, LOOPBACK
from elib.simulator.emulator.registry import registered
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import DEFAULT_WORLD, SimulationSettings
from elib.simulator.physics.body import QUALITIES
from elib.simulator.worlds.files import gallery

ANY_FREE = ""
"""The value of ``--pty`` without one: a port with the name that the system gives. That of ``--wifi`` without one: free
ports. That of ``--view`` and ``--control`` without one: the first free port from the usual one on."""

MAX_STUDENTS = 64
"""Twenty robots that are driven, with twenty open pages, use a sixth of a processor core and 75 MB."""

USUAL = SimulationSettings()


def _number(name: str, metavar: str, about: str) -> Cli:
    rule = rule_of(SimulationSettings, name)
    assert isinstance(rule, Number)
    usual = getattr(USUAL, name)
    default = "as the world says" if usual is None else f"{usual:g}"
    return option(f"--{name} {metavar}", f"{about}, {rule.range} (default: {default}).")


Pty = Annotated[
    str | None, option("--pty [LINK]", "Offer a pty each; LINK names the first one's symbolic link, the next count up.")
]
Tcp = Annotated[
    str | None,
    option("--tcp HOST:PORT", "Offer a TCP port each, counting up; 0 takes free ones (default for HOST: 127.0.0.1)."),
]
ControlAt = Annotated[
    str | None,
    option(
        "--control [HOST:PORT]", "Let programs move things and switch faults; without a value, from 127.0.0.1:8650 on."
    ),
]
UntilEof = Annotated[bool, Cli(name="--until-eof", show=False)]
"""End at the end of the standard input too: a program that starts a simulation for itself keeps it open."""


@dataclasses.dataclass(frozen=True)
class SimulationOptions:
    """The options that are keys of a simulation's URL too, as they were typed."""

    robots: Annotated[str | None, _number("robots", "N", "How many robots")] = None
    firmware: Annotated[str | None, option("--firmware F", f"{', '.join(FIRMWARES)} (default: {USUAL.firmware}).")] = (
        None
    )
    seed: Annotated[str | None, _number("seed", "N", "Seed of the noise: same seed, same noise")] = None
    speed: Annotated[
        str | None, option("--speed real|K", "How fast time runs: as the clock's, or K times (default: real).")
    ] = None
    latency: Annotated[str | None, _number("latency", "S", "Delay of the link each way")] = None
    jitter: Annotated[str | None, _number("jitter", "S", "Standard deviation of that delay")] = None
    baud: Annotated[str | None, _number("baud", "BIT/S", "Speed of the serial line, 0 for unpaced")] = None
    loss: Annotated[str | None, _number("loss", "P", "Probability that a whole answer is lost")] = None
    hardware: Annotated[
        str | None, option("--hardware FILE", "Constant readings from a JSON file instead of a world.")
    ] = None
    fault: Annotated[
        str | None, option("--fault FILE", f"Timed faults from a .toml file, or one of {', '.join(scripts())}.")
    ] = None
    profile: Annotated[
        str | None, option("--profile FILE", "A robot profile, as elib fit writes it: all robots are like that one.")
    ] = None
    quality: Annotated[
        str | None,
        option("--quality Q", f"How good the robots are: {', '.join(QUALITIES)} (default: as the world says)."),
    ] = None


@dataclasses.dataclass(frozen=True)
class ClassOptions:
    """The options of a class."""

    students: Annotated[
        int | None,
        Whole(1, MAX_STUDENTS),
        option(
            "--class N",
            f"A world with a robot, and a page to watch it, for each of N students, {MAX_STUDENTS} at most.",
        ),
    ] = None
    host: Annotated[
        str | None,
        option("--host [ADDRESS]", "Let other computers reach the class: at one address of this computer, or at all."),
    ] = None
    shared: Annotated[bool, option("--shared", "One world with all robots of the class.")] = False
    sheet: Annotated[
        str | None, option("--sheet FILE.html", "Write what each student needs, to print and cut out.")
    ] = None


def simulate(
    world: Annotated[
        str | None, Cli(help=f"{', '.join(gallery())}, or the path of a .toml file (default: {DEFAULT_WORLD}).")
    ] = None,
    /,
    *,
    named: Annotated[str | None, option("--world NAME", "Another way to name WORLD.")] = None,
    pty: Pty = None,
    tcp: Tcp = None,
    wifi: Annotated[
        str | None,
        option(
            "--wifi [HOST:PORT]",
            f"Offer e-puck2s over Wi-Fi, a port each, counting up; without a value, free ones of 127.0.0.1. "
            f"Implies --firmware {EPUCK2_WIFI.name}.",
        ),
    ] = None,
    options: Annotated[SimulationOptions, Cli(name="*")] = SimulationOptions(),
    view: View = None,
    control: ControlAt = None,
    verbose: Annotated[bool, option("--verbose, -v", "Show all bytes on stderr, as elib decode does.")] = False,
    classes: Annotated[ClassOptions, Cli(name="*")] = ClassOptions(),
    until_eof: UntilEof = False,
) -> None:
    """Offer virtual robots on serial ports, TCP ports or Wi-Fi, until Ctrl-C.

    One line a robot when it is ready: its name and the URL that opens it. A client may leave and another come; the
    robot stays as it is. Without --pty and --tcp every robot gets a pty, one with Wi-Fi a port of its own.

    With --class every student gets a robot in a world of his own and a page to watch it, and the teacher a page of all;
    --tcp names the port of the first robot, 4001 by default, --view that of the pages, 8600, and --host lets other
    computers in.

    For example:
        elib simulate
        elib simulate maze --tcp 4000 --view
        elib simulate --robots 3 --firmware epuck2
        elib simulate arena --class 20 --host
    """
    keys = {key: value for key, value in dataclasses.asdict(options).items() if value is not None}
    if world is not None and named is not None and world != named:
        raise ArgumentError(f"two worlds are named, {world} and {named}", hint=f"write elib simulate {named}")
    if wifi is not None:
        keys.setdefault("firmware", EPUCK2_WIFI.name)
    settings = SimulationSettings.from_text(world or named or DEFAULT_WORLD, keys)
    if settings.speed == "max":
        raise ArgumentError(
            "--speed is 'max', but programs that open a port run in real time",
            hint="use --speed 10 for ten times; sim://?speed=max is for a robot inside your own program",
        )
    if classes != ClassOptions():
        others = {"--pty": pty, "--wifi": wifi, "--control": control, "--verbose": verbose or None}
        _teach(settings, classes, tcp, view, [name for name, value in others.items() if value is not None])
        return

    async def main() -> None:
        stop = asyncio.Event()
        log = None
        if verbose:
            from elib.records.decoding.traffic import TrafficLog  # without it a simulation starts faster

            log = TrafficLog(settings.firmware, say)
        controls: list[Control] = []
        async with contextlib.AsyncExitStack() as stack:
            robots = await stack.enter_async_context(
                serve(
                    settings,
                    pty=None if pty is None else True,
                    link=pty or None,
                    tcp=tcp,
                    wifi="0" if wifi == ANY_FREE else wifi,
                    traffic=None if log is None else log.note,
                    control=None if view is None and control is None else controls.append,
                    warn=say,
                )
            )
            opened: list[tuple[str, str]] = []
            if view is not None:
                check_web()
                from elib.panel.panel import WORLD, Panel  # without a view a simulation starts faster
                from elib.panel.server.http import own_address, served

                reachable = [(robot.name, robot.url) for robot in robots]
                panel = Panel(can=WORLD, worlds={"": controls[0]}, reachable=reachable)
                server = await stack.enter_async_context(served(panel, own_address(view)))
                opened.append(("view", server.url))
            if control is not None:
                from elib.simulator.emulator.control_server import serve_control

                opened.append(("control", await stack.enter_async_context(serve_control(controls[0], control))))
            stack.enter_context(registered([(robot.name, robot.url) for robot in robots], settings))
            stack.enter_context(ending(stop))
            if until_eof:
                end = partial(asyncio.get_running_loop().call_soon_threadsafe, stop.set)
                threading.Thread(target=_read_all, args=(end,), name="elib waits for EOF", daemon=True).start()
            for robot in robots:
                print(robot.name, robot.url, flush=True)
            for name, url in opened:  # not on stdout, where a script takes every line for a robot
                print(name, url, file=sys.stderr, flush=True)
            await stop.wait()
        if log is not None:
            log.flush()

    with contextlib.suppress(KeyboardInterrupt):
        run_coroutine(main, settings.speed)


def _teach(
    settings: SimulationSettings, options: ClassOptions, tcp: str | None, view: str | None, others: Sequence[str]
) -> None:
    """Serve a class until Ctrl-C."""
    if options.students is None:
        raise ArgumentError(
            "--host, --shared and --sheet belong to a class", hint="add --class 20, or use --tcp HOST:PORT"
        )
    if others:
        raise ArgumentError(
            f"--class does not go with {' and '.join(others)}", hint="start another elib simulate for that"
        )
    check_web()
    # A simulation alone starts faster.
    from elib.panel.server.classroom import FIRST_ROBOT, PAGE, Classroom, listed, sheet

    classroom = Classroom(
        options.students,
        LOOPBACK if options.host is None else options.host or EVERYWHERE[0],
        options.shared,
        _port("--tcp", tcp, FIRST_ROBOT, "the port of the first student"),
        _port("--view", view, PAGE, "the port of the pages"),
    )

    async def main() -> None:
        stop = asyncio.Event()
        async with contextlib.AsyncExitStack() as stack:
            students = await stack.enter_async_context(classroom.open(settings))
            robots = [(f"student-{each.number}", robot.url) for each in students for robot in each.robots]
            stack.enter_context(registered(robots, settings))
            stack.enter_context(ending(stop))
            if options.sheet is not None:
                write_file(options.sheet, sheet(students, f"elib simulate {settings.world}").encode())
            print(listed(students), end="", flush=True)
            if any(each.token for each in students):
                say("Every computer in this network can drive these robots; only the teacher's page asks for a token.")
                say("Nothing is encrypted: use this in a network you trust. Ctrl-C ends it.")
            await stop.wait()

    with contextlib.suppress(KeyboardInterrupt):
        run_coroutine(main, settings.speed)


def _port(option: str, text: str | None, default: int, meaning: str) -> int:
    """Return a port of a class."""
    if text is None or text == ANY_FREE:
        return default
    if not (text.isascii() and text.isdecimal() and int(text) <= 65535):
        raise ArgumentError(
            f"{option} is {text!r}; with --class it is {meaning}",
            hint="--host ADDRESS names the host",
        )
    return int(text)


def _read_all(end: Callable[[], object]) -> None:
    with contextlib.suppress(OSError):
        while os.read(0, 4096):  # not sys.stdin, whose lock could not be had when Python ends
            pass
    with contextlib.suppress(RuntimeError):  # the loop has ended
        end()


def with_optional_link(tokens: Sequence[str]) -> list[str]:
    """Return the command line with the options joined to their values that are optional.

    The word after ``--pty`` is a link, unless it is an option or names a world; the word after ``--wifi``, ``--view``
    or ``--control`` is an address if it ends in a number, and the one after ``--host`` if it has a point or a colon.
    """
    arranged: list[str] = []
    rest = list(tokens)
    while rest:
        token = rest.pop(0)
        if token == "--pty":
            is_link = bool(rest) and not (rest[0].startswith("-") or rest[0].endswith(".toml") or rest[0] in gallery())
            token = f"--pty={rest.pop(0) if is_link else ANY_FREE}"
        elif token in ("--wifi", "--view", "--control"):
            is_place = bool(rest) and rest[0].rpartition(":")[2].isdecimal()
            token = f"{token}={rest.pop(0) if is_place else ANY_FREE}"
        elif token == "--host":
            is_host = bool(rest) and re.fullmatch(r"[\w.:-]*[.:][\w.:-]*|localhost", rest[0]) is not None
            token = f"--host={rest.pop(0) if is_host and not rest[0].endswith('.toml') else ANY_FREE}"
        arranged.append(token)
    return arranged
