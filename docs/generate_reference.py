"""Write the pages of docs/reference, the marked tables, the drawings and the types of the page, from the code.

Run ``.venv/bin/python docs/generate_reference.py`` after a change that users see; ``--check`` writes nothing, names the
pages that are out of date and exits with 1. The pages on measured robots need ``--measure`` too; ``make docs`` has it.

A module of ``generator`` that has a function ``page`` makes the page of its name. In any other page, what stands
between ``<!-- generated: MODULE.FUNCTION -->`` and ``<!-- end -->`` is what that function returns.
"""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import sys
from collections.abc import Collection
from pathlib import Path

import generator
from generator import course, diagram, drawings, pagetypes, reality, worlds
from generator.markdown import markers, replace_marked

DOCS = Path(__file__).parent
COMMAND = ".venv/bin/python docs/generate_reference.py"
NOTICE = f"<!-- Generated from the code; do not edit. Renew it with: {COMMAND} -->\n\n"

DRAWINGS = {
    "architecture.svg": diagram.parts,
    "e-puck-infrared.svg": drawings.infrared,
    "e-puck-overview.svg": drawings.overview,
    "e-puck-leds.svg": drawings.leds,
    "e-puck-response.svg": drawings.responses,
    "e-puck-sensors.svg": drawings.sensors,
    "world-foraging.svg": worlds.foraging,
}


def pages(names: Collection[str] = ()) -> dict[Path, str]:
    """Return the pages of docs/reference by their paths, or only those of some names."""
    found = {}
    for each in pkgutil.iter_modules(generator.__path__):
        name = f"{each.name.replace('_', '-')}.md"
        make = getattr(importlib.import_module(f"generator.{each.name}"), "page", None)
        if make and (not names or name in names):
            found[DOCS / "reference" / name] = NOTICE + make()
    return found


def marked(*, is_measured: bool) -> dict[Path, str]:
    """Return the pages that are written by hand, with their generated parts: those that are measured, or the others."""
    found = {}
    for path in sorted(DOCS.rglob("*.md")):
        text = path.read_text(encoding="utf-8")
        for marker in markers(text):
            module, _, function = marker.partition(".")
            if (module == "reality") is is_measured:
                make = getattr(importlib.import_module(f"generator.{module}"), function)
                found[path] = replace_marked(found.get(path, text), marker, make())
    return found


def measured() -> dict[Path, str]:
    """Return what is measured again, which takes a quarter of a minute: about real robots and virtual ones."""
    found = {DOCS / "images" / name: text for name, text in reality.pictures().items()}
    found[DOCS / "reference/measured-robots.md"] = NOTICE.replace(COMMAND, f"{COMMAND} --measure") + reality.robots()
    return found | marked(is_measured=True)


def wanted() -> dict[Path, str]:
    """Return what every other generated page and drawing should hold, by its path."""
    found = pages() | marked(is_measured=False)
    found |= {DOCS / "images" / name: draw() for name, draw in DRAWINGS.items()}
    found |= course.pictures()
    found[DOCS.parent / "page/src/messages.ts"] = pagetypes.module()
    found[DOCS.parent / "page/src/studio/messages.ts"] = pagetypes.studio()
    return found


def main() -> int:
    """Write or check the pages; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing, name what is out of date")
    parser.add_argument(
        "--measure", action="store_true", help="also measure virtual robots again, for the pages on them"
    )
    options = parser.parse_args()
    check, texts = options.check, wanted() | (measured() if options.measure else {})
    stale = [
        path
        for path, text in texts.items()
        if not path.exists() or path.read_text(encoding="utf-8").rstrip() != text.rstrip()
    ]
    for path in stale:
        print(f"{path.relative_to(DOCS.parent)} is out of date" if check else f"wrote {path.relative_to(DOCS.parent)}")
    if check:
        if stale:
            print(f"renew with: {COMMAND}")
        return 1 if stale else 0
    for path in stale:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(texts[path].rstrip() + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
