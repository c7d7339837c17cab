"""The table of the labs, and their pictures."""

from pathlib import Path

from elib.lab import Lab, load_lab
from elib.lab.labfile import shipped_labs
from elib.lab.picture import PICTURE, draw_lab
from generator.markdown import table


def listed() -> str:
    """Return the table of the labs, in their order."""
    rows = []
    for number, name in enumerate(shipped_labs(), start=1):
        lab = load_lab(name)
        rows.append((str(number), f"[`{name}`](#{anchor(lab)})", lab.summary, uses(lab)))
    return table(("", "Lab", "The task", "What the program calls"), rows)


def shown() -> str:
    """Return a section for each lab: its picture and its goals."""
    parts = []
    for name in shipped_labs():
        lab = load_lab(name)
        goals = "\n".join(f"- `{goal.name}`: {goal.sentence}" for goal in lab.goals)
        parts.append(f"### {lab.title}\n\n![{lab.summary}](../src/elib/lab/labs/{name}/{PICTURE})\n\n{goals}")
    return "\n\n".join(parts)


def pictures() -> dict[Path, str]:
    """Return the picture of each lab by its path."""
    labs = [load_lab(name) for name in shipped_labs()]
    return {lab.folder / PICTURE: draw_lab(lab) for lab in labs}


def anchor(lab: Lab) -> str:
    """Return the anchor of a lab's section."""
    return lab.title.lower().replace(" ", "-")


def uses(lab: Lab) -> str:
    """Return the robot's methods that the solution calls."""
    text = (lab.folder / "teacher/solution.py").read_text(encoding="utf-8")
    names = [name for name in METHODS if f".{name}(" in text]
    return ", ".join(f"`{name}`" for name in names)


METHODS = (
    "drive",
    "turn",
    "set_speed",
    "proximity",
    "distances",
    "pose",
    "set_pose",
    "go_to",
    "tags",
    "ground",
    "ambient_light",
    "image",
    "within",
    "reconnecting",
    "swarm",
)
