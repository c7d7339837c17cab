"""The page of world files, from the description of their keys that reads them."""

from __future__ import annotations

import re

from elib.base.rules import Flag, Number, rule_of
from elib.base.tables import MAX_FILE, Key, Table
from elib.simulator.physics.geometry import MAX_POINTS
from elib.simulator.physics.scene import MAX_THINGS
from elib.simulator.physics.world import World
from elib.simulator.worlds import files as worldfile
from elib.simulator.worlds.tables import PAINT, TABLES, THINGS, TOP
from generator.markdown import block, bullets, inline, joined, section, table

INTRODUCTION = """# World files

A world file says what stands in a world, what lies on its floor, and where robots start. It is a TOML file; `sim://`
[URLs](urls.md#sim), `elib simulate`, `elib world` and `World.load` take its path, or the name of a world that comes
with elib. [Worlds](../guides/worlds.md) shows how they are used.

Lengths are metres and angles degrees. x runs along the width and y along the depth, from the corner (0, 0); an angle
of 0 points along x, and grows to the left.
"""
HEAD = ("Key", "What it sets", "Value", "If left out")


def page() -> str:
    """Return the page."""
    parts = [INTRODUCTION, example(), f"## Top of the file\n\n{keys(TOP)}", *(entry(each) for each in TABLES)]
    return joined([*parts, rules(), gallery()])


def foraging() -> str:
    """Return the picture of the guide to worlds."""
    return World.load("foraging").draw(beams=False, size=700) or ""


def example() -> str:
    """Return the example that the reader's own documentation gives."""
    shown = block(worldfile.__doc__).replace(
        "what the robots are like: the fields of EpuckModel", "what the robots are like"
    )
    return f"## The file\n\n```toml\n{shown}\n```"


def entry(described: Table) -> str:
    """Return a table of the file with its keys."""
    brackets = f"[[{described.name}]]" if described.is_array else f"[{described.name}]"
    about = described.meaning
    if described.is_array and described.most < MAX_THINGS:
        about += f" At most {described.most} of them."
    return f"## {brackets}\n\n{about}\n\n{keys(described)}"


def keys(described: Table) -> str:
    """Return the keys of one table."""
    return table(HEAD, (row(described, key) for key in described.keys))


def row(described: Table, key: Key) -> tuple[str, ...]:
    """Return a key's line."""
    if key.is_needed:
        default = "it must be there"
    elif key.rule.otherwise or key.default == "none":
        default = key.default.replace("[[", "`[[").replace("]]", "]]`")
    else:
        default = f"`{key.default}`" + (f" {key.rule.unit}" if isinstance(key.rule, Number) and key.rule.unit else "")
    value = "`true` or `false`" if isinstance(key.rule, Flag) else str(key.rule).replace("**", "\\*\\*")
    return f"`{key.name}`", meaning(described, key), value, default


def meaning(described: Table, key: Key) -> str:
    """Return what a key sets: its own text, or that of the argument it fills; unit and range have their own column."""
    if key.meaning:
        return key.meaning
    documentation = described.makes.__doc__
    text = inline((section(documentation, "Attributes") | section(documentation, "Args"))[key.fills[0]])
    rule = rule_of(described.makes, key.fills[0])
    if isinstance(rule, Number):
        text = re.sub(rf", {rule.low:g}\.\.{rule.high:g}|, {rule.unit or 'no unit'}\b", "", text)
    # What programs alone may give.
    text = re.sub(r", a name in `\w+`|[.;] (?:None|Empty) .*", "", text)
    return text if text[1].isupper() else text[0].lower() + text[1:].removesuffix(".")


def rules() -> str:
    """Return what holds for the whole file."""
    painted = ", then ".join(f"`{name}`" for name in PAINT)
    named = ", ".join(f"`{name}`" for name in THINGS)
    facts = (
        f"On the floor lie, the lowest first, {painted}; of one kind, later ones cover earlier ones.",
        "Boxes and cylinders stand inside the arena, their centres at least. They may stand in each other and in "
        "walls: fixed ones are one shape, those that can be pushed come apart. Only robots need room: they start where "
        "nothing stands. The same holds for what a program moves while the world runs.",
        f"Of {named}, no two share a name.",
        f"A file has at most {MAX_FILE // 1_000_000} MB, {MAX_THINGS} things of a kind, and a stripe or"
        f" polygon {MAX_POINTS} points. The sides of polygons count as walls.",
        "What breaks a rule is refused before anything runs, with the file, the line, the key and what to try: "
        "`mine.toml:12: box[1].size is [0.1, 0]; it must be two numbers, each from 0.001 to 1000 m`. `box[1]` is the "
        "second one: they count from 0.",
    )
    return "## Rules\n\n" + bullets(facts)


def gallery() -> str:
    """Return the worlds that come with elib."""
    return f"## Worlds that come with elib\n\n{listed()}"


def listed() -> str:
    """Return the table of worlds for the guide and for this page."""
    rows = []
    for name in worldfile.gallery():
        file = worldfile.load_file(name)
        size = f"{file.scene.width:.3g} x {file.scene.depth:.3g} m"
        rows.append((f"`{name}`", size, str(len(file.scene.starts)), file.about))
    return table(("World", "Size", "Robots", "What it is for"), rows)
