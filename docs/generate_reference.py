"""Write the pages of docs/reference, the marked tables, the drawings and the types of the page, from the code.

Run ``.venv/bin/python docs/generate_reference.py`` after a change that users see; ``--check`` writes nothing, names the
pages that are out of date and exits with 1. The pages on measured robots need ``--measure`` too; ``make docs`` has it.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from generator import (
    cli,
    commands,
    cookbook,
    course,
    diagram,
    drawings,
    drive,
    epuck,
    epuck2,
    errors,
    faults,
    labs,
    layers,
    learning,
    licences,
    link,
    pagetypes,
    profiles,
    reality,
    recording,
    robot,
    serve,
    simulator,
    tasks,
    telemetry,
    urls,
    values,
    worlds,
)
from generator.markdown import replace_marked

DOCS = Path(__file__).parent
COMMAND = ".venv/bin/python docs/generate_reference.py"
NOTICE = f"<!-- Generated from the code; do not edit. Renew it with: {COMMAND} -->\n\n"

PAGES = {
    "commands.md": commands.page,
    "robot.md": robot.page,
    "telemetry.md": telemetry.page,
    "values.md": values.page,
    "errors.md": errors.page,
    "urls.md": urls.page,
    "worlds.md": worlds.page,
    "labs.md": labs.page,
    "simulator.md": simulator.page,
    "tasks.md": tasks.page,
    "learning.md": learning.page,
    "faults.md": faults.page,
    "profiles.md": profiles.page,
    "cli.md": cli.page,
    "serve-protocol.md": serve.page,
    "licences.md": licences.page,
}
MARKED = {
    "architecture.md": {"layers": layers.layers, "rules": layers.rules},
    "cookbook/README.md": {"programs": cookbook.programs},
    "concepts/link.md": {"transitions": link.transitions},
    "guides/connect-a-robot.md": {"selector": link.selector},
    "guides/joystick.md": {"drive": drive.states},
    "guides/epuck2.md": {"devices": epuck2.devices, "missing": epuck2.missing},
    "guides/link-faults.md": {"faults": faults.summary, "scripts": faults.gallery},
    "guides/records.md": {"topics": recording.topics, "about": recording.about},
    "guides/worlds.md": {"worlds": worlds.listed},
    "labs.md": {"labs": course.listed, "pictures": course.shown},
    "reference/e-puck.md": {
        "speeds": epuck.speeds,
        "infrared": epuck.infrared,
        "responses": epuck.responses,
        "devices": epuck.devices,
        "leds": epuck.leds,
        "sounds": epuck.sounds,
        "distances": epuck.distances,
    },
}
"""Pages written by hand that hold generated tables between markers."""

DRAWINGS = {
    "architecture.svg": diagram.parts,
    "e-puck-infrared.svg": drawings.infrared,
    "e-puck-overview.svg": drawings.overview,
    "e-puck-leds.svg": drawings.leds,
    "e-puck-response.svg": drawings.responses,
    "e-puck-sensors.svg": drawings.sensors,
}


MEASURED = DOCS / "concepts/how-real-is-it.md"
"""The page that holds a table of what is measured again, which takes a quarter of a minute."""


def measured() -> dict[Path, str]:
    """Return what the pages and pictures about real robots and virtual ones should hold, by their paths."""
    found = {DOCS / "images" / name: text for name, text in reality.pictures().items()}
    found[DOCS / "reference/measured-robots.md"] = NOTICE.replace(COMMAND, f"{COMMAND} --measure") + reality.page()
    found[MEASURED] = replace_marked(MEASURED.read_text(encoding="utf-8"), "measured", reality.summary())
    return found


def wanted() -> dict[Path, str]:
    """Return what every other generated page and drawing should hold, by its path."""
    found = {DOCS / "reference" / name: NOTICE + page() for name, page in PAGES.items()}
    for name, tables in MARKED.items():
        text = (DOCS / name).read_text(encoding="utf-8")
        for marker, make in tables.items():
            text = replace_marked(text, marker, make())
        found[DOCS / name] = text
    found |= {DOCS / "images" / name: draw() for name, draw in DRAWINGS.items()}
    found |= course.pictures()
    found[DOCS.parent / "page/src/messages.ts"] = pagetypes.page()
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
