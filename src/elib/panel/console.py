"""The console: a line that a person types becomes a command of the table, and its answer is told in words."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING, NamedTuple

from elib.base.errors import ArgumentError, ElibError
from elib.base.plaintext import counted
from elib.base.rules import number_from
from elib.link.protocol.context import Profile
from elib.link.protocol.profiles import FIRMWARES
from elib.link.protocol.quantities import Quantity
from elib.link.protocol.words import to_text
from elib.robot.actions import CatalogueEntry, catalogue

if TYPE_CHECKING:
    from elib.panel.slot import Slot

MAX_COMMAND = 200
"""Characters of a line."""
MAX_SHOWN = 4000
"""Characters of an answer."""
COLUMNS = 100
"""Characters of a line of an answer."""
MAX_COMPLETIONS = 60
HELP = "help"
_CALL = re.compile(r"\s*([A-Za-z_]\w*)\s*(.*?)\s*", re.DOTALL)
_ARGUMENT = re.compile(r"""\s*(?:"([^"]*)"|'([^']*)'|([^\s,"']+))\s*(,?)""")


class Call(NamedTuple):
    """A command to send, with its arguments in order."""

    name: str
    arguments: tuple[object, ...] = ()


@dataclass(frozen=True, slots=True)
class ConsoleAnswer:
    """What the console says to a line, in lines of plain text, and whether it went wrong or the robot refused."""

    text: str
    is_bad: bool = False


def parse(line: str) -> Call:
    """Return what was typed as a command: ``set_speed 0.1 0.2``, ``set_speed(0.1, 0.2)``, ``text D,100,-100``.

    An ArgumentError says why it is none. Ranges are not checked here but before it is sent, because they depend on the
    firmware.
    """
    if len(line) > MAX_COMMAND or not line.strip().isprintable():
        raise ArgumentError(f"a command is one line of at most {MAX_COMMAND} characters")
    found = _CALL.fullmatch(line)
    if found is None:
        raise ArgumentError(f"{line.strip()!r} is not a command", hint="like set_speed 0.1 0.2; help lists them all")
    name, rest = found[1], found[2]
    entry = _entry(name)
    if rest.startswith("(") and rest.endswith(")"):
        rest = rest[1:-1].strip()
    arguments = [rest] if entry.name == "text" and rest else _split(rest)
    least = sum(default is inspect.Parameter.empty for _, _, default in entry.parameters)
    if not least <= len(arguments) <= len(entry.parameters):
        raise ArgumentError(
            f"{entry.usage} was given {counted(len(arguments), 'argument')}", hint=help_line(entry.name)
        )
    if entry.name == "text":
        return Call("text", (_unquoted(rest),))
    return Call(entry.name, tuple(map(number_from, arguments)))


def complete(line: str, firmware: str = "") -> list[str]:
    """Return whole lines that begin with *line*: names of a firmware's commands, then words that an argument may be."""
    if len(line) > MAX_COMMAND:
        return []
    profile = FIRMWARES.get(firmware)
    typed = line.lstrip()
    there = [name for name in (*catalogue(), HELP) if profile is None or name not in profile.absent]
    name = re.match(r"\w*", typed)
    head = "" if name is None else name[0]
    if head == typed:
        fitting = [each for each in there if each.startswith(typed.lower())]
        return sorted(fitting or [each for each in there if typed.lower() in each])[:MAX_COMPLETIONS]
    if head.lower() == HELP:
        last = typed[len(head) :].lstrip()
        return [f"{HELP} {each}" for each in sorted(there) if each.startswith(last.lower())][:MAX_COMPLETIONS]
    if head.lower() not in there:
        return []
    last = re.split(r"[\s(,]", typed)[-1]
    before = len(_pieces(typed[len(head) : len(typed) - len(last)]))
    parameters = catalogue()[head.lower()].parameters
    quantity = parameters[before][1] if before < len(parameters) else None
    if quantity is None or quantity.names is None:
        return []
    stem = line[: len(line) - len(last)]
    return [f"{stem}{each.name}" for each in quantity.names if each.name.startswith(last.upper())]


def help_line(name: str, firmware: str = "") -> str:
    """Return how a command is called and what its arguments may be, on one line; *name* may be a line begun with it.

    The ranges are those of the firmware, or the widest ones if that is empty. An ArgumentError says that there is no
    such command.
    """
    found = _CALL.fullmatch(name)
    entry = _entry(found[1] if found else name)
    profile = FIRMWARES.get(firmware)
    if profile is not None and entry.name in profile.absent:
        return f"{entry.usage}: not on {profile.name}: {profile.absent[entry.name]}"
    rules = [f"{argument} {_rule(quantity, profile)}" for argument, quantity, _ in entry.parameters]
    first = entry.doc.partition("\n")[0]
    return ". ".join(part.rstrip(".") for part in (f"{entry.usage}: {first}", "; ".join(rules)) if part)


def overview(firmware: str = "") -> str:
    """Return every command of a firmware with the first line of its help."""
    profile = FIRMWARES.get(firmware)
    lines = [
        f"{entry.usage:<46} {entry.doc.partition(chr(10))[0]}"
        for entry in catalogue().values()
        if profile is None or entry.name not in profile.absent
    ]
    return "\n".join(lines)


async def answer(slot: Slot, line: str, page: str = "") -> ConsoleAnswer:
    """Send what was typed to the robot and return the answer; an error is an answer, too.

    After a command that moves the robot, *page* drives it, and has to ``drive.beat``.
    """
    typed = line.strip()[:MAX_COMMAND]
    try:
        head, _, rest = typed.partition(" ")
        if head.lower() in (HELP, "?"):
            return ConsoleAnswer(help_line(rest, slot.firmware) if rest.strip() else overview(slot.firmware))
        call = parse(line)
        value = await slot.command(call.name, *call.arguments, page=page)
    except ElibError as error:
        return ConsoleAnswer(str(error)[:MAX_SHOWN], is_bad=True)
    return ConsoleAnswer(result_text(value))


def result_text(value: object) -> str:
    """Return the answer of a command in words, as ``elib send`` prints it; ``done`` if it says nothing else."""
    return to_text(value, COLUMNS).strip()[:MAX_SHOWN] or "done"


def _entry(name: str) -> CatalogueEntry:
    entry = catalogue().get(name.strip().lower())
    if entry is None:
        near = get_close_matches(name.lower(), catalogue(), 1)
        hint = f"did you mean {near[0]}?" if near else "help lists them all"
        raise ArgumentError(f"there is no command {name.strip()[:MAX_COMMAND]!r}", hint=hint)
    return entry


def _split(text: str) -> list[str]:
    """Return the arguments: words, numbers or quoted texts between spaces or commas."""
    found, at, is_open = [], 0, False
    while at < len(text):
        part = _ARGUMENT.match(text, at)
        if part is None:
            raise ArgumentError(f"{text[at:]!r} cannot be read as arguments", hint="like 0.1 0.2 or (0.1, 0.2)")
        found.append(next(group for group in part.groups() if group is not None))
        at, is_open = part.end(), bool(part[4])
    if is_open:
        raise ArgumentError(f"{text!r} ends in a comma", hint="one more argument, or none")
    return found


def _pieces(text: str) -> list[str]:
    """Return the arguments that were typed so far, however badly."""
    return [piece for piece in re.split(r"[\s(,]+", text) if piece]


def _unquoted(text: str) -> str:
    is_quoted = len(text) > 1 and text[0] == text[-1] and text[0] in "\"'"
    return text[1:-1] if is_quoted else text


def _rule(quantity: Quantity | None, profile: Profile | None) -> str:
    if quantity is None:
        return "as the robot reads it, like D,100,-100"
    return (quantity if profile is None else profile.limited(quantity)).rule
