"""Real robots and virtual ones side by side, as ``elib compare --reality`` shows them."""

from __future__ import annotations

import math
import sys
import textwrap
from itertools import groupby

from elib.cli.terminal import BOLD, CYAN, DIM, GREEN, RED, columns, paint
from elib.studies.reality.figures import BOUNDS
from elib.studies.reality.parity import Beside, Condition, Realism

NUMBER, VERDICT, NAME = 7, 10, 15
"""Columns of a number, of the word behind the numbers, and, at least, of the name before them."""


def short(value: float) -> str:
    """Return a number in about three digits; ``-`` if there is none."""
    if math.isnan(value):
        return "-"
    digits = 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2 if abs(value) >= 1 else 3
    text = f"{value:.{digits}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


def cells(condition: Condition, *, has_own: bool) -> list[str]:
    """Return the three figures of the robots, three of the simulator, and that of a recorded robot."""
    simulator = condition.simulator or (math.nan, condition.compared, math.nan)
    shown = [*condition.robots[1:], *simulator, *([condition.own] if has_own else [])]
    return ["" if not condition.simulator and each in (3, 5) else short(value) for each, value in enumerate(shown)]


def verdict(each: Beside, condition: Condition, *, has_own: bool) -> tuple[str, str]:
    """Return where the simulator or the recorded robot is, in brackets if that does not count; and its colour."""
    word = condition.place_of(condition.own if has_own else condition.compared)
    colour = GREEN if word == "inside" else RED if each.counts else DIM
    return word if each.counts else f"({word})", colour


def to_text(found: Realism) -> str:
    """Return the table, as wide as the terminal or as its figures need, and the score below it."""
    width, has_own = columns(), bool(found.own)
    parts = [("real robots", 3), ("simulator", 3), *([("yours", 1)] if has_own else [])]
    name = max(width - NUMBER * sum(count for _, count in parts) - VERDICT, NAME)
    head = "".join(f"{what:>{NUMBER * count}}" for what, count in parts)
    percents = "".join(f"{each:>{NUMBER}}" for each in ("5 %", "50 %", "95 %") * 2)
    lines = [f"{'':<{name}}{head}", f"{'':<{name}}{percents}"]
    for sensor, group in groupby(found.shown, lambda each: each.quantity.sensor):
        lines += ["", paint(sensor.upper(), BOLD, sys.stdout)]
        for each in group:
            it = each.quantity
            about = f"{it.title}, {it.unit} ({it.robot}, {each.confidence})"
            lines += [paint(line, CYAN, sys.stdout) for line in textwrap.wrap(about, width)]
            for condition in each.conditions:
                numbers = "".join(f"{cell:>{NUMBER}}" for cell in cells(condition, has_own=has_own))
                word, colour = verdict(each, condition, has_own=has_own)
                lines.append(f"  {condition.robots.condition:<{name - 2}}{numbers}  {paint(word, colour, sys.stdout)}")
    return "\n".join([*lines, "", *_below(found, width)])


def _below(found: Realism, width: int) -> list[str]:
    texts = []
    if found.own:
        texts.append(
            f"The words at the right say where {found.own} is. What it does not hold is left out: it needs sounds, "
            "colours and distances that no person was asked for."
        )
    inside = sum(each.share == 1 for each in found.counted)
    low = len(found.quantities) - len(found.counted)
    texts += [
        f"score  {found.score:.2f}  {inside} of {len(found.counted)} quantities are inside in all their conditions",
        "The score is the mean, over the quantities, of the share of their conditions whose 50 % (or only) figure of "
        f"the simulator lies within the robots' 5 to 95 %. {low} quantities of low confidence, in brackets, do not "
        f"count. Simulator: {found.robots} {found.quality} robots, drawn from seed {found.seed} on.",
    ]
    lines = [line for text in texts for line in textwrap.wrap(text, width)]
    for why, keys in found.apart.items():
        lines += ["", *textwrap.wrap(f"apart: {why}:", width)]
        lines += textwrap.wrap(", ".join(keys), width, initial_indent="  ", subsequent_indent="  ")
    return lines


def to_json(found: Realism) -> dict[str, object]:
    """Return the comparison for JSON."""
    return {
        "quality": found.quality,
        "robots": found.robots,
        "seed": found.seed,
        "score": found.score,
        "recording": found.own or None,
        "quantities": [
            {
                "key": each.quantity.key,
                "title": each.quantity.title,
                "robot": each.quantity.robot,
                "unit": each.quantity.unit,
                "bounds": BOUNDS[each.quantity.bounds],
                "confidence": each.confidence,
                "counts": each.counts,
                "why": each.why if each.share < 1 else None,
                "conditions": [
                    {
                        "condition": condition.robots.condition,
                        "robots": [*condition.robots[1:]],
                        "simulator": [*condition.simulator],
                        "compared": condition.compared,
                        "own": condition.own,
                        "inside": condition.is_inside,
                    }
                    for condition in each.conditions
                ],
            }
            for each in found.quantities
        ],
    }
