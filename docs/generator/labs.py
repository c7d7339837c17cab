"""The page of labs, from the description of their keys that reads them."""

from __future__ import annotations

from elib.base.plaintext import summary
from elib.base.rules import fields_of
from elib.base.tables import Table
from elib.lab import labfile
from elib.lab.goal import Goal
from elib.lab.goals import KINDS
from elib.lab.labfile import ANY_GOAL, GOALS, KIND, TOP, VARIANTS, ZONES
from elib.lab.lockstep import MAX_MESSAGE
from elib.lab.marker import GRACE, MAX_KEPT, WALL
from elib.lab.running import MAX_OUTPUT
from elib.lab.tracer import AFTERWARDS
from generator.markdown import block, bullets, inline, joined, table
from generator.worlds import HEAD, entry, keys, row

INTRODUCTION = """# Labs

A lab is a folder with a task and its goals. `elib lab list` names the labs that come with elib, `elib lab new NAME`
copies one, and `elib lab check FILE.py` runs a program in the lab's worlds and says which goals hold.

| File | What it is |
| --- | --- |
| `README.md` | the instructions |
| `lab.toml` | variants and goals, described here |
| `start.py` | the program that a student begins with |
| `worlds/*.toml` | [worlds](worlds.md), if those of elib do not fit |
| `opponent.py` | in a game of two programs, the one to play against |
| `teacher/hidden.toml` | more `[[variant]]` and `[[zone]]` tables, which the student does not see |
| `teacher/solution.py` | a program that passes |
| `teacher/mistakes/*.py` | mistakes; each fails as its first line says, `# fails: GOAL: reason` |
| `world.svg` | the picture in `README.md`; `elib lab draw` draws it |

`elib lab new NAME --teacher` copies the folder `teacher` too: that is how a lab of your own begins.

Lengths are metres and angles degrees, as in world files. Times are seconds of robot time: they pass only while the
program waits for its robot, so a slow computer takes nothing away. What breaks a rule is refused with the file, the
line, the key and what to try.
"""


def page() -> str:
    """Return the page."""
    tables = [entry(each) for each in (ZONES, VARIANTS)]
    shown = block(labfile.__doc__)
    parts = [
        INTRODUCTION,
        f"## The file\n\n```toml\n{shown}\n```",
        f"## Top of the file\n\n{keys(TOP)}",
        *tables,
        goals(),
        judging(),
        limits(),
    ]
    return joined(parts)


def goals() -> str:
    """Return the kinds of goals and their keys."""
    common = [field.name for field in fields_of(Goal)]
    every = Table("goal", "", Goal, tuple(key for key in GOALS["survives"].keys if key.name in common))
    kind = ("`kind`", KIND.meaning, ", ".join(f"`{name}`" for name in KINDS), "it must be there")
    parts = [
        f"## [[goal]]\n\n{ANY_GOAL.meaning} Each kind has keys of its own; these all kinds have:",
        table(HEAD, [kind, *(row(every, key) for key in every.keys)]),
    ]
    for name, described in GOALS.items():
        own = Table("goal", "", described.makes, tuple(key for key in described.keys if key.name not in common))
        about = inline(summary(described.makes))
        rows = [row(own, key) for key in own.keys]
        parts.append(f"### {name}\n\n{about}" + (f"\n\n{table(HEAD, rows)}" if rows else ""))
    return "\n\n".join(parts)


def judging() -> str:
    """Return how points are given."""
    facts = (
        "A goal holds or fails in each variant by itself. Its points are given in parts: for half of the variants, "
        "half of the points. A program passes if all goals hold in all variants.",
        "A goal with `needs` holds only if the goals that it names hold in the same variant. Without it a robot that "
        "stands still would pass `no-contact`, `stands` or `survives`.",
        f"When the program has ended, in a game both programs, the world goes on for {AFTERWARDS:g} s: a last command "
        "arrives, and a robot that was left driving drives on. Then comes what is called the end.",
        "When the lab's time is over, the link is lost: the program gets a `LinkLost`, has "
        f"{GRACE:g} s by the clock on the wall to end, and the goals are judged as things are.",
        "A program that breaks the rules of the link passes no goal, and neither does one that is not done after "
        f"{WALL:g} s by the clock on the wall (`--wall`): how far it came would depend on the computer.",
        "The path is noted at every tick of the world. `no-contact`, `distance` and the others judge the true path, "
        "which the program cannot see.",
        "`requests` counts what is sent over the link, with what elib sends by itself: `version` when a robot is "
        "opened, `set_speed` and `encoders` during `drive` and `turn`, and repetitions after a fault. An e-puck2 on "
        "Wi-Fi streams its sensors, so they are not asked for there.",
    )
    return "## How goals are judged\n\n" + bullets(facts)


def limits() -> str:
    """Return the limits of the link."""
    rows = (
        ("bytes of a frame", f"{MAX_MESSAGE:,}"),
        ("bytes that may wait for one robot", f"{MAX_KEPT:,}"),
        ("bytes of its output that are kept", f"{MAX_OUTPUT:,}"),
        ("robot time of a run", f"{labfile.MAX_TIME} s"),
    )
    return (
        "## The link\n\nThe program runs in a process of its own and has a robot at `lockstep://FD`, whatever robot it "
        "names. The world is in the marker's process: [decision 0023](../decisions/"
        "0023-the-marker-owns-the-simulator.md) says how they talk. This needs Linux or macOS.\n\n"
        + table(("Limit", "Value"), rows)
    )
