"""The reference pages are those of this code, and complete."""

import ast
import inspect
import re
import subprocess
import sys

from pages import ROOT, prose

import elib
from elib.base import errors
from elib.base.files import guide
from elib.cli.program import COMMANDS
from elib.link.protocol.commands import SPECS
from elib.link.session import Session
from elib.link.session.core import STOPPING_TIME
from elib.link.transport import open_transport
from elib.link.transport.rfcomm import open_rfcomm
from elib.link.transport.serial import open_serial
from elib.link.transport.tcp import open_tcp
from elib.link.transport.url import scheme_names
from elib.link.transport.wifi import open_wifi
from elib.robot.actions import Actions
from elib.robot.events import RobotEvent
from elib.simulator.emulator.faultkinds import KINDS
from elib.simulator.emulator.faultscript import gallery
from elib.simulator.emulator.sim_transport import open_sim
from elib.simulator.worlds.tables import TABLES
from shared import PATIENCE

REFERENCE = {page.name: page.read_text() for page in (ROOT / "docs/reference").glob("*.md")}
for by_hand in ("from-elib.md", "from-unifr.md", "from-webots.md", "e-puck.md", "wire-protocol.md"):
    del REFERENCE[by_hand]


def test_the_generated_pages_are_up_to_date() -> None:
    script = str(ROOT / "docs/generate_reference.py")
    found = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, timeout=PATIENCE)
    assert found.returncode == 0, found.stdout + found.stderr


def test_every_public_name_is_in_the_reference() -> None:
    text = "\n".join(REFERENCE.values())
    assert [name for name in elib.__all__ if not re.search(rf"\b{name}\b", text)] == []


def test_every_command_has_its_entry() -> None:
    entries = set(re.findall(r"^## (\w+)$", REFERENCE["commands.md"], re.MULTILINE))
    assert set(SPECS) | {"sensors", "text", "sleep", "set_obstacle_avoidance"} <= entries
    assert all(hasattr(Actions, name) for name in entries if name.islower())


def test_every_error_has_its_line_in_the_tree_and_its_entry_with_a_cure() -> None:
    for name, kind in vars(errors).items():
        if isinstance(kind, type) and issubclass(kind, errors.ElibError):
            assert re.search(rf"^[│├└─ ]*{name}\b", REFERENCE["errors.md"], re.MULTILINE), name
            entry = REFERENCE["errors.md"].partition(f"\n## {name}\n")[2].partition("\n## ")[0]
            assert "**What to do.**" in entry, name


def test_every_command_of_the_shell_has_its_entry() -> None:
    for name in COMMANDS:
        assert f"\n## elib {name}\n\n```text\nUsage: elib {name}" in REFERENCE["cli.md"]


def test_every_kind_of_fault_has_its_entry_with_all_its_keys() -> None:
    for name, kind in KINDS.items():
        entry = REFERENCE["faults.md"].partition(f"\n### {name}\n")[2].partition("\n##")[0]
        assert (kind.__doc__ or "").partition("\n")[0] in entry
        assert re.findall(r"^\| `(\w+)` \|", entry, re.MULTILINE) == [key.name for key in (*kind.names, *kind.keys)]


def test_every_fault_script_that_comes_with_elib_is_shown() -> None:
    assert set(gallery()) <= set(re.findall(r"^### (.*)$", REFERENCE["faults.md"], re.MULTILINE))


def test_every_table_of_a_world_has_its_entry_with_all_its_keys() -> None:
    for section in TABLES:
        brackets = f"[[{section.name}]]" if section.is_array else f"[{section.name}]"
        entry = REFERENCE["worlds.md"].partition(f"\n## {brackets}\n")[2].partition("\n## ")[0]
        assert section.meaning in entry
        assert re.findall(r"^\| `(\w+)` \|", entry, re.MULTILINE) == [key.name for key in section.keys]


def test_every_event_has_its_entry_and_its_line_in_the_guide() -> None:
    guide = (ROOT / "docs/guides/telemetry.md").read_text()
    for kind in (kind for kind in RobotEvent.__subclasses__() if kind.__module__ == "elib.robot.events"):
        assert f"\n### elib.{kind.__name__}\n" in REFERENCE["telemetry.md"]
        assert f"| `{kind.__name__}` |" in guide


def test_the_guide_names_every_error_of_opening() -> None:
    openers = (open_transport, open_serial, open_rfcomm, open_tcp, open_wifi, open_sim, Session.open, elib.connect)
    documented = "\n".join(inspect.getdoc(opener) or "" for opener in openers)
    raised = set(re.findall(r"^\s+(\w+): ", documented.replace("Args:", ""), re.MULTILINE)) & set(elib.__all__)
    assert {"RobotSilent", "NotAnEpuck", "LinkBusy", "LinkDenied", "Unsupported"} <= raised
    rows = set(re.findall(r"^\| `(\w+)` \|", prose(ROOT / "docs/guides/connect-a-robot.md"), re.MULTILINE))
    assert raised <= rows


def test_every_scheme_is_on_the_page_of_urls() -> None:
    rows = dict(re.findall(r"^\| `(\w+)://[^|]*\| (.*?) \|", REFERENCE["urls.md"], re.MULTILINE))
    assert set(rows) == set(scheme_names())


def test_numbers_are_written_with_all_their_digits() -> None:
    assert [name for name, text in REFERENCE.items() if re.search(r"\de[+-]\d", text)] == []


def test_a_row_of_the_page_of_errors_says_something() -> None:
    rows = re.findall(r"^\| (.*) \| (.*) \|$", REFERENCE["errors.md"], re.MULTILINE)
    empty = [
        message
        for message, hint in rows
        if not hint.strip() and not re.search("[a-z]", re.sub(r"\*.*?\*", "", message))
    ]
    assert len(rows) > 50
    assert empty == []


def test_how_long_leaving_waits_is_what_the_page_about_the_link_says() -> None:
    page = (ROOT / "docs/concepts/link.md").read_text()
    assert f"The robot has {STOPPING_TIME:g} s to confirm it" in " ".join(page.split())


def test_the_generated_pages_say_so_in_their_first_line() -> None:
    assert len(REFERENCE) == 18
    for text in REFERENCE.values():
        assert text.startswith("<!-- Generated from the code; do not edit.")


def test_a_command_names_no_page_that_an_installed_elib_lacks() -> None:
    source = ROOT / "src/elib"
    named: set[str] = set()
    for path in source.rglob("*.py"):
        written = path.read_text(encoding="utf-8")
        if "docs/" not in written and "guide(" not in written:
            continue
        tree = ast.parse(written)
        shown = {
            id(node.value)
            for node in ast.walk(tree)
            if isinstance(node, ast.Expr) and "cli" not in path.relative_to(source).parts
        }  # docstrings, which only commands show
        for node in ast.walk(tree):
            match node:
                case ast.Constant(value=str(text)) if id(node) not in shown and path.name != "files.py":
                    assert "docs/" not in text, path
                case ast.Call(func=ast.Name(id="guide"), args=[ast.Constant(value=str(name))]):
                    named.add(name)
    assert {"agent", "flash"} <= named
    assert all(guide(name).is_file() for name in named)
    assert not [path for path in source.rglob("*.js") if "docs/guides" in path.read_text(encoding="utf-8")]
