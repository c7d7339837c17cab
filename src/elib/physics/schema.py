"""Tables of a file: which keys each may have, and how a mistake is named with its file, its line and a cure.

:mod:`elib.physics.worldschema` describes the tables of a world; the reader here, its messages and the reference page
all follow from that description.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from elib.errors import ArgumentError, SimulationError
from elib.physics.keys import Key, Mistake, shown
from elib.physics.scene import MOST_THINGS
from elib.physics.tomltext import Path, line_of


@dataclass(frozen=True)
class Section:
    """One table of the file, or several of a kind.

    Attributes:
        name: What the file calls it.
        meaning: What it is, in a sentence.
        keys: What it may say.
        makes: Called with the keys' arguments. An argument without a default value is a key that must be there.
        is_array: There may be many, written ``[[name]]``.
        is_required: There must be one.
        most: How many there may be, of an array.
    """

    name: str
    meaning: str
    keys: tuple[Key, ...]
    makes: Callable[..., object]
    is_array: bool = True
    is_required: bool = False
    most: int = MOST_THINGS

    @cached_property
    def defaults(self) -> Mapping[str, object]:
        """The values of those arguments that may be left out."""
        parameters = inspect.signature(self.makes).parameters.values()
        return {each.name: each.default for each in parameters if each.default is not each.empty}

    @cached_property
    def by_name(self) -> Mapping[str, Key]:
        """The keys."""
        return {key.name: key for key in self.keys}

    def is_needed(self, key: Key) -> bool:
        """Whether *key* must be there."""
        return key.arguments[0] not in self.defaults

    def default(self, key: Key) -> str:
        """Return what holds where *key* is left out, as the file would write it."""
        values = [self.defaults[argument] for argument in key.arguments]
        return key.otherwise or ", ".join(key.written(value) for value in values)

    def read(self, table: Mapping[str, object]) -> object:
        """Return what *table* describes.

        Raises:
            Mistake: A key is missing, unknown or wrong.
            ArgumentError: What it makes refuses the whole.
        """
        given: dict[str, object] = {}
        for name, value in table.items():
            key = self.by_name.get(name)
            if key is None:
                raise unknown(name, list(self.by_name))
            given.update(zip(key.arguments, key.read(value), strict=True))
        for key in self.keys:
            if key.name not in table and self.is_needed(key):
                raise Mistake(
                    f"is missing; it must be {key.rule}", path=(key.name,), hint=f"write {key.name} = {key.example}"
                )
        return self.makes(**given)


@dataclass(frozen=True, slots=True)
class Source:
    """Where a document came from: what messages need.

    Attributes:
        filename: As the person gave it.
        text: The whole file.
    """

    filename: str
    text: str

    def read(self, section: Section, value: object) -> list[object]:
        """Return what the tables under the section's name describe, in their order; [] for None.

        Raises:
            SimulationError: A rule is broken; the message names the file, the line and the key.
        """
        if value is None:
            if section.is_required:
                cure = f"write [{section.name}], and below it {section.keys[0].name} = {section.keys[0].example}"
                raise self.mistake((section.name,), "is missing", cure)
            return []
        if not section.is_array:
            if not isinstance(value, dict):
                raise self.mistake((section.name,), f"is {shown(value)}; it must be a table", f"write [{section.name}]")
            return [self._one(section, (section.name,), value)]
        if not isinstance(value, list) or not all(isinstance(table, dict) for table in value):
            raise self.mistake(
                (section.name,),
                "must be an array of tables",
                f"write [[{section.name}]], in two brackets, above each of them",
            )
        if len(value) > section.most:
            raise self.mistake(
                (section.name, section.most), f"is one too many; at most {section.most} are possible", "leave some out"
            )
        return [self._one(section, (section.name, index), table) for index, table in enumerate(value)]

    def _one(self, section: Section, path: Path, table: Mapping[str, object]) -> object:
        try:
            return section.read(table)
        except ArgumentError as error:
            raise self.wrong(path, error) from error

    def wrong(self, path: Path, error: ArgumentError) -> SimulationError:
        """Return *error*, met while reading what is at *path*, with its place in the file."""
        inner = error.path if isinstance(error, Mistake) else ()
        colon = "" if inner or not path else ":"
        return self.mistake(path + inner, error.message, error.hint, colon)

    def mistake(self, path: Path, what: str, cure: str, colon: str = "") -> SimulationError:
        """Return an error that names the file, the line, the key, what is wrong and the cure."""
        line = line_of(self.text, path)
        where = f"{self.filename}:{line}" if line else self.filename
        return SimulationError(f"{where}: {_dotted(path)}{colon} {what}".replace(":  ", ": "), hint=cure)


def unknown(name: str, known: Sequence[str]) -> Mistake:
    """Return the mistake of a key nobody knows: a misspelt one would otherwise be ignored in silence."""
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]}?" if near else f"the keys here are {', '.join(known)}"
    return Mistake("is not a key of a world", path=(name,), hint=hint)


def _dotted(path: Path) -> str:
    """Return *path* as people write it: ``box[1].size``."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            plain = part if part.isprintable() and len(part) <= 60 else shown(part)
            text += f".{plain}" if text else plain
    return text
