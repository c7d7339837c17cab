"""Every command and method shows an example: in its help, on its page of the reference, and it does what it says."""

import asyncio
import contextlib
import doctest
import inspect
import io
import math
import pydoc
from pathlib import Path

import pytest
from pages import ROOT

import elib
from elib.link.protocol.commands import SPECS
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.table import example_of
from elib.robot.actions import Actions
from elib.robot.blocking import BlockingEpuck

ACTIONS = ("drive", "turn", "go_to", "set_velocity", "pose", "set_pose")
ACTIONS += ("sensors", "distances", "scan", "tags", "neighbours", "send_message", "text", "sleep")
COMMANDS = {name: inspect.getdoc(getattr(Actions, name)) or "" for name in (*SPECS, *ACTIONS)}
METHODS = {
    f"robot.{name}": inspect.getdoc(getattr(BlockingEpuck, name)) or ""
    for name in (
        "begin",
        "callback",
        "close",
        "events",
        "log",
        "plot",
        "record",
        "statistics",
        "trace",
        "watch",
        "within",
    )
}
FUNCTIONS = {
    f"elib.{name}": inspect.getdoc(getattr(elib, name)) or ""
    for name in ("behaviour", "connect", "play", "react", "reconnecting", "robot_url", "run", "swarm", "wait")
}
REFERENCE = {name: (ROOT / "docs/reference" / name).read_text(encoding="utf-8") for name in ("commands.md", "robot.md")}


def url_of(name: str) -> str:
    """The robot of an example, as the pages say."""
    if name in PROFILES["asercom-1.2.2"].absent:
        return "sim://?firmware=epuck2&speed=max"
    return "sim://?speed=max"


def test_every_action_is_here() -> None:
    assert {name for name in dir(Actions) if not name.startswith("_")} == set(COMMANDS)


@pytest.mark.parametrize("name", [*COMMANDS, *METHODS, *FUNCTIONS])
def test_the_example_does_what_it_says(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    example = example_of((COMMANDS | METHODS | FUNCTIONS)[name])
    assert example, "it has none"
    assert "\n\n" not in example, "the example is the last section"
    monkeypatch.chdir(tmp_path)
    said = io.StringIO()
    with elib.connect(url_of(name)) as robot:
        names = {"__name__": "__main__", "elib": elib, "math": math, "asyncio": asyncio, "robot": robot}
        test = doctest.DocTestParser().get_doctest(example, names, name, None, 0)
        with contextlib.closing(robot):
            doctest.DocTestRunner(verbose=False).run(test, out=said.write)
    assert said.getvalue() == ""


def test_help_and_reference_show_the_example() -> None:
    with elib.connect("sim://?speed=max") as robot:
        assert '>>> robot.set_led(0, "on")' in pydoc.plain(pydoc.render_doc(robot.set_led))
    for name, doc in COMMANDS.items():
        entry = REFERENCE["commands.md"].partition(f"\n## {name}\n")[2].partition("\n## ")[0]
        assert example_of(doc) in entry, name
    for name, doc in (METHODS | FUNCTIONS).items():
        assert example_of(doc).splitlines()[0] in REFERENCE["robot.md"], name
