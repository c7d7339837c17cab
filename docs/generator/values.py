"""The page of values: what commands return, and the enumerations that they take."""

from __future__ import annotations

import enum
import inspect
from collections.abc import Sequence

import elib
from elib.link.protocol import image, quantities, values
from elib.link.session.statistics import LinkStats
from generator.markdown import description, docstring, field_table, inline, joined, section, table

INTRODUCTION = """# Values

{module}

```python
import elib

with elib.connect("sim://?speed=max") as robot:
    near = robot.proximity()
    assert near[0] == near.front_right
    front_right, diagonal_right, *others = near
    assert len(near) == 8 and near.origin == "simulator" and near.time <= robot.time
    switch = robot.selector()
    assert switch == switch.position == 3 and switch < 4
```

A reading of several numbers is used like a tuple of them; a reading of one value is used like that value.
"""
ENUMERATIONS = (quantities.LedAction, quantities.CameraMode, quantities.ProximityRate, image.Mounting)


def page() -> str:
    """Return the page."""
    module = inline(inspect.cleandoc(values.__doc__ or "").partition("\n\n")[2])
    kinds = [value for name in elib.__all__ if is_value(value := getattr(elib, name))]
    parts = [
        INTRODUCTION.format(module=module),
        *(entry(kind) for kind in [*kinds, elib.Pose, image.Image, LinkStats]),
    ]
    parts.append("## Enumerations\n\nA command takes the member, its name in upper or lower case, or its number.")
    parts += [enumeration(kind) for kind in ENUMERATIONS]
    return joined(parts)


def is_value(kind: object) -> bool:
    """Return whether *kind* is a class of readings."""
    return isinstance(kind, type) and issubclass(kind, values.Reading)


def entry(kind: type) -> str:
    """Return the entry of one class."""
    told = section(kind.__doc__, "Attributes")
    parts = [f"## {kind.__name__}", docstring(description(kind.__doc__))]
    if not is_value(kind):
        parts.append(field_table(told))
    else:
        infos = values.describe(kind, values.Role.NUMBER, values.Role.CONVERTED)
        if others := [info for info in infos if info.name not in told]:
            parts.append(fields_of(others))
        if told:
            units = {info.name: info.unit for info in values.describe(kind)}
            rows = ((f"`{name}`", units[name], inline(text)) for name, text in told.items())
            parts.append(table(("Field", "Unit", "What it is"), rows))
    methods = []
    for base in reversed(kind.__mro__[:-1]):
        for name, member in vars(base).items():
            if isinstance(member, property) and not name.startswith("_") and name != "numbers":
                methods.append(f"- `.{name}`: {inline(description(member.__doc__))}")
            elif inspect.isfunction(member) and not name.startswith("_") and base.__module__.startswith("elib"):
                methods.append(f"- `.{name}()`: {inline(description(member.__doc__))}")
    return "\n\n".join([*parts, *(["\n".join(methods)] if methods else [])])


def fields_of(infos: Sequence[values.FieldInfo]) -> str:
    """Return the fields of a reading in a sentence, with the names and units of their numbers."""
    units = {info.unit for info in infos}
    shared = f"; unit: {infos[0].unit}" if len(units) == 1 and infos[0].unit else ""
    fields = []
    for info in infos:
        said = [values.in_words(name) for name in info.names] + ([] if shared or not info.unit else [info.unit])
        fields.append(f"`{info.name}`" + (f" ({', '.join(said)})" if said else ""))
    return f"Fields, in order: {', '.join(fields)}{shared}."


def enumeration(kind: type[enum.Enum]) -> str:
    """Return the entry of one enumeration."""
    members = ", ".join(f"`{name}` ({member.value})" for name, member in kind.__members__.items())
    return f"### {kind.__name__}\n\n{docstring(description(kind.__doc__))}\n\nMembers: {members}."
