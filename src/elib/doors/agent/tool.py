"""What a tool of an agent is: its name, its parameters with units and bounds, and its result."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from elib.base.errors import ArgumentError
from elib.base.rules import Number, is_number, nearest

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"

LEDS = 8
"""LEDs of the ring."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a tool.

    Attributes:
        about: What it means, with its unit.
        kind: ``number``, ``boolean``, ``string``, ``object`` of numbers and words, or ``array`` of booleans.
        low: Smallest number; None for another kind.
        high: Largest number.
        default: What stands for it where it is left out.
        choices: The only texts allowed; empty if any text is.
        is_required: Whether it must not be left out.
    """

    about: str
    kind: str = "number"
    low: float | None = None
    high: float | None = None
    default: object = None
    choices: tuple[str, ...] = ()
    is_required: bool = False

    def schema(self) -> dict[str, object]:
        """Return it as JSON Schema."""
        found: dict[str, object] = {"type": self.kind, "description": self.about}
        if self.low is not None and self.high is not None:
            found |= {"minimum": self.low, "maximum": self.high}
        if self.choices:
            found["enum"] = list(self.choices)
        if self.kind == "array":
            found |= {"items": {"type": "boolean"}, "minItems": LEDS, "maxItems": LEDS}
        if self.kind == "object":
            found["additionalProperties"] = {"type": ["number", "string", "boolean"]}
        if self.default is not None:
            found["default"] = self.default
        return found

    def check(self, name: str, value: object) -> object:
        """Return *value* as it is used.

        Raises:
            ArgumentError: It has the wrong type, or is out of range.
        """
        match self.kind:
            case "number" if is_number(value):
                assert self.low is not None
                assert self.high is not None
                return Number(self.low, self.high).require(value, name)
            case "boolean" if isinstance(value, bool):
                return value
            case "string" if isinstance(value, str):
                if not self.choices or value in self.choices:
                    return value
                hint = nearest(value[:80], self.choices) or f"choose one of {', '.join(self.choices)}"
                raise ArgumentError(f"{name} is {value[:80]!r}, which does not exist", hint=hint)
            case "array" if isinstance(value, list) and len(value) == LEDS and all(isinstance(x, bool) for x in value):
                return value
            case "object" if isinstance(value, dict):
                return value
        wanted = f"a list of {LEDS} booleans" if self.kind == "array" else f"of the type {self.kind}"
        raise ArgumentError(f"{name} must be {wanted}, not {type(value).__name__}")


@dataclass(frozen=True, slots=True)
class Result:
    """What a tool answers.

    Attributes:
        data: The structured result.
        text: The same for a reader.
        picture: A picture as PNG, in base64; empty for none.
        is_error: Whether the caller has to do something about it.
    """

    data: dict[str, Json]
    text: str
    picture: str = ""
    is_error: bool = False


@dataclass(frozen=True, slots=True)
class Tool:
    """One tool.

    Attributes:
        name: Its name.
        title: Its title for people.
        about: What it does, for the model that calls it.
        parameters: Its parameters by name.
        call: Carries it out with its checked arguments.
        is_reading: Whether it changes nothing.
        is_free: Whether its calls are not counted.
    """

    name: str
    title: str
    about: str
    call: Callable[..., Awaitable[Result]] = field(repr=False)
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    is_reading: bool = False
    is_free: bool = False

    def schema(self) -> dict[str, object]:
        """Return the JSON Schema of its arguments."""
        return {
            "type": "object",
            "properties": {name: each.schema() for name, each in self.parameters.items()},
            "required": [name for name, each in self.parameters.items() if each.is_required],
            "additionalProperties": False,
        }

    def check(self, arguments: Mapping[str, object]) -> dict[str, object]:
        """Return the arguments of a call, with defaults.

        Raises:
            ArgumentError: One is unknown, missing, of the wrong type or out of range.
        """
        for name in arguments:
            if name not in self.parameters:
                known = ", ".join(self.parameters) or "none"
                raise ArgumentError(f"{self.name} has no parameter {str(name)[:80]!r}", hint=f"it has: {known}")
        found: dict[str, object] = {}
        for name, each in self.parameters.items():
            if name in arguments:
                found[name] = each.check(name, arguments[name])
            elif each.is_required:
                raise ArgumentError(f"{self.name} needs {name}: {each.about}")
            else:
                found[name] = each.default
        return found
