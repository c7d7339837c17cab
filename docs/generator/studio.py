"""What the studio's page knows before Python is loaded: elib's names for completion, firmwares, faults and examples.

``python -m generator.studio`` in the folder ``docs`` prints it as JSON.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
import sys
from pathlib import Path
from typing import Any

import elib
from elib.link.protocol.commands import SPECS
from elib.link.protocol.profiles import PROFILES, rule
from elib.robot.blocking import BlockingEpuck
from elib.simulator.emulator import faultscript
from generator.commands import shown
from generator.markdown import inline

ROOT = Path(__file__).parents[2]

Entry = dict[str, object]
NEEDY = ("04_camera", "17_record", "18_replay", "19_learn")
"""Examples that need packages which the studio does not have."""


def known() -> Entry:
    """Return the tables: a name has a signature, a sentence, arguments with units and ranges, maybe an example."""
    public = re.findall(r" as (\w+)", (ROOT / "src/elib/__init__.pyi").read_text(encoding="utf-8"))
    return {
        "robot": [_of_robot(name) for name in dir(BlockingEpuck) if not name.startswith("_")],
        "elib": [_entry(name, getattr(elib, name)) for name in public],
        "firmwares": list(PROFILES),
        "faults": [[name, faultscript.load(name).description] for name in faultscript.gallery()],
        "machine": (ROOT / "src/elib/behaviours/samples/states.py").read_text(encoding="utf-8"),
        "samples": [_sample(path) for path in sorted((ROOT / "examples").glob("[0-9]*.py")) if path.stem not in NEEDY],
    }


def _of_robot(name: str) -> Entry:
    entry = _entry(name, inspect.getattr_static(BlockingEpuck, name))
    if spec := SPECS.get(name):
        entry |= {
            "signature": f"{name}{_signature(spec)}",
            "about": _first(spec.doc),
            "arguments": [[each.name, rule(each.quantity)] for each in spec.parameters],
            "example": spec.example,
        }
    return entry


def _entry(name: str, kind: Any) -> Entry:
    return {
        "name": name,
        "signature": f"{name}{_signature(kind)}",
        "about": _first(inspect.getdoc(kind)),
        "arguments": [],
        "example": "",
    }


def _signature(kind: Any) -> str:
    """Return the arguments and what comes back; nothing for errors, whose arguments no one writes, and for no call."""
    if isinstance(kind, type) and issubclass(kind, Exception):
        return ""
    found = getattr(kind, "signature", None) or getattr(kind, "__signature__", None)
    if found is None:
        try:
            found = inspect.signature(kind)
        except TypeError:
            return ""
    given = [each for each in found.parameters.values() if each.name not in ("self", "time", "origin")]
    returned = str(found.return_annotation).strip("'").removeprefix("v.")
    end = "" if isinstance(kind, type) or returned in ("None", "<class 'inspect._empty'>") else f" -> {returned}"
    return shown(found.replace(parameters=given)) + end


def _sample(path: Path) -> Entry:
    text = path.read_text(encoding="utf-8")
    return {"name": path.name, "about": _first(ast.get_docstring(ast.parse(text))), "text": text}


def _first(doc: str | None) -> str:
    """Return the first line of a docstring as plain text."""
    return re.sub(r"`|: see .*", "", inline((doc or "").partition("\n")[0]))


if __name__ == "__main__":
    json.dump(known(), sys.stdout)
