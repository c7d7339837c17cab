"""The page of URLs."""

from __future__ import annotations

import dataclasses

from elib.base.rules import Number, fields_of
from elib.link.protocol.profiles import FIRMWARES
from elib.link.transport.url import scheme_named
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.worlds.files import gallery
from generator.markdown import inline, joined, section, table

INTRODUCTION = """# URLs

A URL says which robot is meant. `elib.connect`, `elib.open`, `elib.run` and the option `--robot` of every command take
the same ones. What is wrong with a URL is said before anything is opened, as an `ArgumentError`.
"""
WHICH = """## Which robot a program drives

The first of these that there is:

1. what `elib run FILE.py --robot URL` puts in the place of the robot. It takes the place of every URL in the program
2. the URL that the program names: the argument of `elib.connect(URL)` and of the other functions, or for `elib.run`,
   `elib.robot_url` and `elib.robot_urls` the command line of the program
3. the environment variable `ELIB_ROBOT`
4. the default of the program, such as `elib.robot_url("sim://maze")`
5. `sim://`

`elib run` and `ELIB_ROBOT` can name several robots: `ELIB_ROBOT="serial:///dev/rfcomm0 serial:///dev/rfcomm1"`. The
first robot that the program opens gets the first URL, the next one the second. A robot that the program opens again
gets its URL again, and `elib.swarm` gets all. A program that opens more robots than there are ends with an error.

The commands of elib, such as `elib send`, drive the robot of `--robot URL`, or else that of `ELIB_ROBOT`.
"""
TARGETS = {
    "sim": ("`sim://[WORLD]`", "a virtual robot inside your program"),
    "serial": (
        "`serial:///dev/rfcomm0`, `serial://COM3`",
        "a serial port: a bound Bluetooth port, a cable, a pty. The bare name of a port means the same: `COM3`, "
        "`rfcomm0`, `/dev/ttyUSB0`",
    ),
    "rfcomm": (
        "`rfcomm://10:00:E8:AA:BB:CC`",
        "Bluetooth by address, where the system and the Python have Bluetooth sockets. Never run on a radio yet. "
        "`channel` is 1 to 30; if it is left out, it is 2, an e-puck2's, or 1, an e-puck1's, where the robot refuses 2",
    ),
    "tcp": ("`tcp://HOST:PORT`", "the bytes of a serial port over TCP: a bridge, or `elib simulate --tcp`"),
    "wifi": (
        "`wifi://HOST`, `wifi://HOST:PORT`",
        "an [e-puck2 on Wi-Fi](../guides/connect-a-robot.md) by its name or address; the port is 1000 if left out",
    ),
    "replay": (
        "`replay://FILE`",
        "a [recording](../guides/replay.md), which answers as the robot did; with `fork`, a simulation that goes on "
        "from one of its moments",
    ),
    "webserial": (
        "`webserial://`",
        "a real robot in the [studio](../guides/studio.md): the serial port that a person has chosen on its page",
    ),
    "lockstep": (
        "`lockstep://FD`",
        "a robot in a world that another process owns, over a socket with this file descriptor. Only the "
        "[marker of a lab](../decisions/0023-the-marker-owns-the-simulator.md) gives such URLs",
    ),
}


def page() -> str:
    """Return the page."""
    return joined([INTRODUCTION, schemes(), simulation(), WHICH])


def schemes() -> str:
    """Return the table of schemes."""
    rows = []
    for name, (target, about) in TARGETS.items():
        scheme = scheme_named(name)
        assert scheme is not None
        told = "see below" if name == "sim" else ", ".join(f"`{key}`" for key in scheme.keys) or "-"
        rows.append((target, about, told))
    return "## Schemes\n\n" + table(("URL", "Opens", "Keys"), rows)


def simulation() -> str:
    """Return the section about ``sim://``."""
    told = section(SimulationSettings.__doc__, "Attributes")
    rules = {field.name: field.rule for field in fields_of(SimulationSettings)}
    rows = []
    for field in dataclasses.fields(SimulationSettings):
        if field.name == "world":
            continue
        default = "-" if field.default is None else f"`{field.default}`"
        rule = rules.get(field.name)
        text = inline(told[field.name])
        if field.name == "fault":
            text = f"[{text.partition(':')[0]}](faults.md):{text.partition(':')[2]}"
        if field.name == "profile":
            text = text.replace("robot profile", "[robot profile](profiles.md)")
        limits = rule.range.removeprefix("from ") if isinstance(rule, Number) else "-"
        if field.name == "firmware":
            limits = ", ".join(f"`{name}`" for name in FIRMWARES)
        rows.append((f"`{field.name}`", text, default, limits))
    worlds = ", ".join(f"`{name}`" for name in gallery())
    return (
        "## sim://\n\n"
        f"`sim://WORLD?KEY=VALUE&KEY=VALUE`. The world is one of {worlds}, or the path of a TOML file; `arena` if left "
        "out. `connect` and `open` drive the first robot of a world of their own, where the others stand still, or the "
        "one that `robot` names. What is opened with `robot` on one event loop [shares a "
        "world](../guides/swarms.md#one-world-several-openings): by `open`, not by `connect`, which has an event loop "
        "of its own each time. `elib.swarm` drives all. The robot is booted already. The same keys but `robot` are "
        "options of `elib simulate`, where `speed=max` is refused, because other programs live in real time.\n\n"
        + table(("Key", "What it sets", "Default", "Range"), rows)
    )
