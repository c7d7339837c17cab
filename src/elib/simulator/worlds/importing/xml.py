"""XML as elements that know their line; entities are refused, for they can make gigabytes of a few lines."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NoReturn
from xml.parsers import expat

from elib.base.rules import MAX_TEXT
from elib.simulator.worlds.importing.plan import Plan


@dataclass
class Element:
    """One element of a file: its tag, attributes, line, the elements in it, and its text."""

    plan: Plan
    name: str
    given: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def numbers(self, name: str, *default: float) -> tuple[float, ...]:
        """Return as many numbers of an attribute as the default has, which is for an attribute that is not there."""
        if name not in self.given:
            return default
        found = tuple(self.plan.number(self.line, part) for part in self.given[name].split(","))
        if len(found) != len(default):
            raise self.plan.error(self.line, f"{name} of {self.name} has {len(found)} numbers, and not {len(default)}")
        return found

    def number(self, name: str, default: float = 0.0) -> float:
        """Return the number of an attribute."""
        return self.numbers(name, default)[0]

    def all(self, name: str) -> list[Element]:
        """Return the elements of one name in it."""
        return [child for child in self.children if child.name == name]


def read_xml(plan: Plan, text: str, root: str) -> Element:
    """Return the outermost element of a file, which must be called *root*.

    Raises:
        SimulationError: It is not XML, or another kind of XML, or too large.
    """
    top = Element(plan, "", {}, 1)
    above = [top]
    parser = expat.ParserCreate()

    def begin(name: str, given: dict[str, str]) -> None:
        plan.count(parser.CurrentLineNumber, len(above))
        above[-1].children.append(Element(plan, name, given, parser.CurrentLineNumber))
        above.append(above[-1].children[-1])

    def end(_: str) -> None:
        above.pop()

    def said(text: str) -> None:
        if len(above[-1].text) < MAX_TEXT:
            above[-1].text += text

    def refuse(*_: object) -> NoReturn:
        raise plan.error(parser.CurrentLineNumber, "it declares entities, which elib does not read", "write them out")

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = begin, end, said
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise plan.error(error.lineno, f"this is not XML: {expat.ErrorString(error.code)}") from error
    except ValueError as error:  # a lone surrogate
        raise plan.error(0, f"this is not XML: {error}") from error
    if top.children[0].name != root:
        raise plan.error(top.children[0].line, f"it begins with <{top.children[0].name}>; it must be <{root}>")
    return top.children[0]
