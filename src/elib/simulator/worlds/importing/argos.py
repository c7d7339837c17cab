"""The experiments of ARGoS: XML; lengths are metres, and angles degrees about z, y and x."""

from __future__ import annotations

import math
from random import Random

from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.fittings import Light
from elib.simulator.physics.geometry import Box, Cylinder
from elib.simulator.worlds.importing.plan import HIGH, Plan, pushed
from elib.simulator.worlds.importing.xml import Element, read_xml

MAX_TRIALS = 100
"""After so many places that are taken there is no room left."""

NOWHERE = (0.0, 0.0, 0.0)


def read(plan: Plan, text: str) -> None:
    """Add what a file says to *plan*."""
    root = read_xml(plan, text, "argos-configuration")
    arena = next(iter(root.all("arena")), None)
    if arena is None:
        raise plan.error(root.line, "it has no <arena>")
    width, depth, _ = arena.numbers("size", *NOWHERE)
    x, y, _ = arena.numbers("center", *NOWHERE)
    left, low = x - width / 2, y - depth / 2
    plan.areas.append((left, low, left + width, low + depth))
    seeds = [each.number("random_seed") for part in root.all("framework") for each in part.all("experiment")]
    draw = Random(int(next(iter(seeds), 0)))
    for program in root.all("loop_functions"):
        plan.note(program.line, "what loop_functions do is left out: they are a program")
    for child in arena.children:
        if child.name == "floor" and child.given.get("source") == "image":
            plan.picture(child.line, child.given.get("path", ""), plan.areas[0])
        elif child.name == "floor":
            plan.note(child.line, "the floor is left out: a program paints it")
        elif child.name == "distribute":
            _distribute(plan, child, draw)
        else:
            body = next(iter(child.all("body")), child)
            _add(plan, child, body.numbers("position", *NOWHERE), body.numbers("orientation", *NOWHERE))


def _add(plan: Plan, thing: Element, place: tuple[float, ...], turns: tuple[float, ...]) -> None:
    """Add a thing at a place, turned about z, y and x."""
    name = thing.given.get("id", "")
    (x, y, z), angle = place, math.radians(turns[0])
    is_tilted = any(abs(math.remainder(turn, 360)) > 1 for turn in turns[1:])
    if thing.name == "light":
        lamp = {"x": x, "y": y, "height": z, "intensity": thing.number("intensity", 1.0)}
        plan.add(thing.line, "light", Light, lamp, name)
    elif is_tilted or z > HIGH:
        plan.note(thing.line, f'{thing.name} "{name}" is left out: it {"is tilted" if is_tilted else "is in the air"}')
    elif thing.name in ("box", "cylinder"):
        width, depth, height = thing.numbers("size", *NOWHERE)
        form: dict[str, object] = {
            "x": x,
            "y": y,
            **pushed(thing.number("mass", 1.0) * (thing.given.get("movable") == "true")),
        }
        if thing.name == "box":
            form |= {"width": width, "depth": depth, "angle": angle}
            plan.stand(thing.line, "box", Box, z, z + height, form, name)
        else:
            form["radius"] = thing.number("radius")
            plan.stand(thing.line, "cylinder", Cylinder, z, z + thing.number("height"), form, name)
    elif thing.all("controller"):
        plan.robot(thing.line, f'{thing.name} "{name}"', x, y, angle)
    else:
        plan.note(thing.line, f'{thing.name} "{name}" is left out')


def _distribute(plan: Plan, part: Element, draw: Random) -> None:
    """Add what is distributed at random where there is room, as ARGoS does, but with other random numbers."""
    places, turns = part.all("position"), part.all("orientation")
    for entity in part.all("entity"):
        for thing in entity.children:
            count = int(entity.number("quantity", 1))
            width, depth, _ = thing.numbers("size", *NOWHERE)
            room = max(math.hypot(width, depth) / 2, thing.number("radius"), RADIUS)
            methods = {each.given.get("method") for each in (*places, *turns)}
            if len(places) != 1 or len(turns) != 1 or not methods <= {"uniform", "gaussian", "constant"}:
                plan.note(thing.line, f"{count} x {thing.name} are left out: their distribution is not known")
                continue
            done, tries = 0, 0
            while done < count and tries < MAX_TRIALS:
                place = _drawn(places[0], draw)
                tries += 1
                if plan.is_free(thing.line, place[0], place[1], room):
                    _add(plan, thing, place, _drawn(turns[0], draw))
                    done, tries = done + 1, 0
            plan.note(thing.line, f"{done} of {count} x {thing.name} are placed at random, not where ARGoS places them")


def _drawn(part: Element, draw: Random) -> tuple[float, ...]:
    """Return three numbers that a method gives."""
    if part.given.get("method") == "constant":
        return part.numbers("values", *NOWHERE)
    if part.given.get("method") == "gaussian":
        means, spreads = part.numbers("mean", *NOWHERE), part.numbers("std_dev", *NOWHERE)
        return tuple(map(draw.gauss, means, spreads))
    return tuple(map(draw.uniform, part.numbers("min", *NOWHERE), part.numbers("max", *NOWHERE)))
