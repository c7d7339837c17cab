"""The page of what was measured on real robots, with the simulator beside it, and its pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from itertools import groupby

from elib.cli.reality import short
from elib.studies.reality.figures import BOUNDS, KINDS, Fact, Reference, reference
from elib.studies.reality.parity import Beside, Condition, Realism, realism
from generator.drawings import AXIS, QUIET, RIM, SOUND, Picture, Point
from generator.markdown import table

INTRODUCTION = """# Measured robots

What was measured on real e-pucks, and the same quantities measured on virtual ones. The figures are taken from public
repositories; elib ships figures only, no recordings. [How real is it?](../concepts/how-real-is-it.md) says in
words what follows from them, and how to add your robot. Constants of the simulator cite this page by the names of the
facts: `(measured-robots: {example})`.

**{score:.2f}** is the score: the mean, over the quantities, of the share of their conditions in which the simulator's
50 % figure (or only figure) lies within the robots' 5 to 95 %. Quantities of low confidence are shown and do not count.
{inside} of {counted} quantities are inside in all their conditions. The simulator's figures are those of
{robots} robots of quality `{quality}`, drawn from seed {seed} on; `elib compare --reality` measures them again.
"""
LEGEND = """In the pictures, the band is what robots have, 5 to 95 %, each row on its own scale, and the line in it
their 50 %. The dot is the simulator's 50 % (or only) figure, its line reaches from 5 to 95 %. Red is outside; a dot at
the picture's edge lies beyond it. The numbers are the robots' limits and the simulator's figure."""

WRONG = "#b3261e"
BAND = "#cfe0f5"
LEFT, RIGHT, FULL = 330.0, 800.0, 840
"""Pixels: where the plot begins and ends, and the width of the picture."""
BEYOND = 1.0
"""How far the plot reaches beyond the band on both sides, as a share of the band."""
ROW, HEAD = 20, 30


@cache
def measured() -> Realism:
    """Return both sides, measured once for page and pictures."""
    return realism()


def robots() -> str:
    """Return the page."""
    found, known = measured(), reference()
    inside = sum(each.share == 1 for each in found.counted)
    parts = [
        INTRODUCTION.strip().format(
            example=next(iter(known.facts)),
            score=found.score,
            inside=inside,
            counted=len(found.counted),
            robots=found.robots,
            quality=found.quality,
            seed=found.seed,
        ),
        LEGEND,
        "## What is apart",
        table(
            ("Why", "Quantities"), ((why, ", ".join(f"`{key}`" for key in keys)) for why, keys in found.apart.items())
        ),
    ]
    for sensor, facts in groupby(known.facts.values(), lambda fact: fact.key.partition(".")[0]):
        words = sensor.replace("_", " ")
        parts.append(f"## {words[0].upper()}{words[1:]}")
        if sensor in sensors():
            parts.append(f"![Robots and simulator: {words}](../images/{file_of(sensor)})")
        for fact in facts:
            parts += described(fact, [each for each in found.quantities if each.quantity.fact == fact.key], known)
    rows = ((f"`{each.key}`", each.where, each.date, each.robot, str(each.robots)) for each in known.sources.values())
    parts += ["## Sources", table(("Key", "Where", "Date", "Robots", "At least"), rows)]
    return "\n\n".join(parts)


def summary() -> str:
    """Return the table of what is measured: for each sensor, on how many robots, and what the simulator matches."""
    known, rows = reference(), []
    for sensor, quantities in sensors().items():
        keys = {key for each in quantities for key in known.facts[each.quantity.fact].sources}
        counted = [each for each in quantities if each.counts]
        inside = sum(each.share == 1 for each in counted)
        robots = sum(known.sources[key].robots for key in keys)
        titles = "; ".join(each.quantity.title for each in quantities if not each.quantity.title.startswith("the same"))
        rows.append((sensor.replace("_", " "), str(robots), f"{inside} of {len(counted)}", titles))
    return table(("Sensor", "Robots, at least", "Inside", "What was measured"), rows)


def described(fact: Fact, quantities: Sequence[Beside], known: Reference) -> list[str]:
    """Return a fact in words, and the tables of its quantities."""
    sources = ", ".join(f"`{each}`" for each in fact.sources)
    words = [
        f"### {fact.key}",
        f"{fact.says[0].upper()}{fact.says[1:]}." if fact.says else "",
        f"{fact.n[0].upper()}{fact.n[1:]}. {fact.conditions[0].upper()}{fact.conditions[1:]}. "
        f"*{fact.kind[0].upper()}{fact.kind[1:]}* ({KINDS[fact.kind]}), from {sources}. "
        f"Confidence {fact.confidence}: {fact.reason}.",
    ]
    for each in quantities:
        it = each.quantity
        low = f"; confidence {each.confidence}" if each.confidence != fact.confidence else ""
        words.append(f"**`{it.key}`**: {it.title}, {it.unit} ({it.robot}; limits: {BOUNDS[it.bounds]}{low}).")
        words.append(table(HEADINGS, (row(each, condition) for condition in each.conditions)))
    return [text for text in words if text]


HEADINGS = ("Condition", "Robots 5 %", "50 %", "95 %", "Simulator 5 %", "50 %", "95 %", "")


def row(each: Beside, condition: Condition) -> list[str]:
    """Return the row of a condition."""
    place = condition.place_of(condition.compared)
    simulator = condition.simulator or (math.nan, condition.compared, math.nan)
    numbers = [
        short(value).replace("-", "−") if not math.isnan(value) else "" for value in (*condition.robots[1:], *simulator)
    ]
    return [condition.robots.condition, *numbers, place if each.counts else f"({place})"]


def sensors() -> dict[str, list[Beside]]:
    """Return the quantities of each sensor, in their order."""
    found: dict[str, list[Beside]] = {}
    for each in measured().quantities:
        found.setdefault(each.quantity.key.partition(".")[0], []).append(each)
    return found


def file_of(sensor: str) -> str:
    """Return the name of a sensor's picture."""
    return f"measured-{sensor.replace('_', '-')}.svg"


def pictures() -> dict[str, str]:
    """Return the pictures of all sensors by their names."""
    return {file_of(sensor): picture(sensor, quantities) for sensor, quantities in sensors().items()}


def picture(sensor: str, quantities: Sequence[Beside]) -> str:
    """Return one row for each condition: the robots' band, and the simulator's dot."""
    rows = sum(len(each.conditions) for each in quantities)
    made = Picture(FULL, HEAD * (len(quantities) + 1) + ROW * rows, f"Robots and simulator: {sensor.replace('_', ' ')}")
    y = 8.0
    for each in quantities:
        y += HEAD
        about = f"{each.quantity.title}, {each.quantity.unit}"
        made.text(Point(16, y - 8), about if each.counts else f"({about})", size=13, is_bold=True)
        for condition in each.conditions:
            draw(made, condition, y + ROW / 2)
            y += ROW
    return made.svg()


def draw(made: Picture, condition: Condition, y: float) -> None:
    """Draw one condition."""
    _, low, middle, high = condition.robots
    span = max(high - low, 1e-9)

    def at(value: float) -> float:
        share = min(max((value - low) / span, -BEYOND), 1 + BEYOND)
        return LEFT + (RIGHT - LEFT) * (share + BEYOND) / (1 + 2 * BEYOND)

    def bar(begin: float, end: float, half: float) -> list[Point]:
        return [Point(begin, y - half), Point(end, y - half), Point(end, y + half), Point(begin, y + half)]

    shown = short(condition.compared)
    made.text(Point(32, y + 4), condition.robots.condition, size=12, colour=QUIET)
    made.text(Point(LEFT - 14, y + 4), f"{short(low)} to {short(high)}; {shown}", size=11, colour=QUIET, anchor="end")
    made.line([Point(LEFT, y), Point(RIGHT, y)], RIM, 1)
    made.area(bar(at(low), at(high), 6), BAND)
    made.line([Point(at(middle), y - 6), Point(at(middle), y + 6)], AXIS, 2)
    if math.isnan(condition.compared):
        return
    colour = SOUND if condition.is_inside else WRONG
    if condition.simulator:
        made.line([Point(at(condition.simulator[0]), y), Point(at(condition.simulator[-1]), y)], colour, 2)
    made.disc(Point(at(condition.compared), y), 4, colour)
