"""A scene as the text of a world file: what ``files.py`` reads opens as the same scene again.

Angles are degrees in such a file, so they may differ in the last bit; all other numbers are equal.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence

from elib.base.rules import Degrees, Rule
from elib.base.tables import Key, Table
from elib.simulator.physics.fittings import Checkers, Patch, Print, Stripe
from elib.simulator.physics.geometry import Colour
from elib.simulator.physics.profiles import Profile
from elib.simulator.physics.scene import Scene
from elib.simulator.worlds.tables import TABLES, TOP

ROUND = 9
"""Decimals of an angle, degrees, beyond which it is written in full."""


def written_scene(scene: Scene, about: str = "") -> str:
    """Return the text of a world file for *scene*.

    Args:
        scene: The world. Sensors with a response of their own, which only a robot profile can give, are left out.
        about: What the world is for, in a sentence.
    """
    parts = _parts(scene)
    texts = [_table(TOP, {"about": about})]
    for table in TABLES:
        head = f"[[{table.name}]]\n" if table.is_array else f"[{table.name}]\n"
        for values in parts[table.name]:
            body = _table(table, values)
            if body or table.is_array or table.is_required:
                texts.append(head + body)
    return "\n".join(text for text in texts if text)


def _parts(scene: Scene) -> dict[str, list[Mapping[str, object]]]:
    """Return what the tables of each name say, by the fields that their keys fill."""
    firmware = scene.firmware + ("",) * len(scene.starts)
    energies, pens = (given + (None,) * len(scene.starts) for given in (scene.energies, scene.pens))
    model = _fields(scene.model)
    if isinstance(scene.model.profile, Profile):
        del model["profile"]
    return {
        "arena": [{"width": scene.width, "depth": scene.depth}],
        "simulation": [{"step": scene.step, "seed": scene.seed}],
        "epuck": [model],
        "wall": _all(scene.walls),
        "box": _all(scene.boxes),
        "cylinder": _all(scene.cylinders),
        "polygon": _all(scene.polygons),
        "light": _all(scene.lights),
        "sound": _all(scene.sounds),
        "zone": _all(scene.zones),
        "energy": _all([scene.energy] if scene.energy else []),
        "floor": [{"floor": scene.floor}],
        "checkers": _all(each for each in scene.paint if isinstance(each, Checkers)),
        "picture": _all(each for each in scene.paint if isinstance(each, Print)),
        "patch": [_fields(each) | {"hole": each.colour is None} for each in scene.paint if isinstance(each, Patch)],
        "stripe": _all(each for each in scene.paint if isinstance(each, Stripe)),
        "robot": [
            {"x": pose.x, "y": pose.y, "heading": pose.heading, "firmware": name, "energy": energy, "pen": pen}
            for pose, name, energy, pen in zip(scene.starts, firmware, energies, pens, strict=False)
        ],
    }


def _all(things: Iterable[object]) -> list[Mapping[str, object]]:
    return [_fields(thing) for thing in things]


def _fields(thing: object) -> dict[str, object]:
    return {name: getattr(thing, name) for name in getattr(type(thing), "__dataclass_fields__", {})}


def _table(table: Table, values: Mapping[str, object]) -> str:
    """Return the lines of one table; a key that has its default value is left out."""
    return "".join(_line(key, [values.get(name) for name in key.fills]) for key in table.keys)


def _line(key: Key, values: Sequence[object]) -> str:
    if all(value is None for value in values) or tuple(values) == key.defaults:
        return ""
    text = ", ".join(_text(value, key.rule) for value in values)
    return f"{key.name} = [{text}]\n" if len(values) > 1 else f"{key.name} = {text}\n"


def _text(value: object, rule: Rule) -> str:
    """Return a value as TOML has it."""
    match value:
        case bool():
            return "true" if value else "false"
        case Colour() | str():
            return json.dumps(str(value), ensure_ascii=False)
        case tuple():
            return f"[{', '.join(_text(each, rule) for each in value)}]"
        case int():
            return str(value)
        case _ if isinstance(rule, Degrees):
            return repr(_degrees(float(value)))  # type: ignore[arg-type]
        case _:
            return repr(float(value))  # type: ignore[arg-type]


def _degrees(angle: float) -> float:
    exact = math.degrees(angle)
    if abs(exact) > 360:
        exact = math.degrees(math.remainder(angle, math.tau))
    short = round(exact, ROUND)
    return short if math.isclose(math.radians(short), angle, rel_tol=1e-15, abs_tol=0.0) else exact


__all__ = ["written_scene"]
