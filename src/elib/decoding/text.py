"""Text answers: whose a line is, by the requests that wait or by its looks alone."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from elib.decoding.lines import Kind
from elib.decoding.requests import LINE_ENDS, NOT_FOUND, SCANNED, Awaited
from elib.errors import CommandRejected, RemoteProtocolError
from elib.protocol import shapes
from elib.protocol.commands import SPECS
from elib.protocol.connection import GREETING
from elib.protocol.context import Context, Reply, Stray
from elib.protocol.profiles import PROFILES
from elib.protocol.replies import Line as LineShape
from elib.protocol.replies import Lines
from elib.protocol.values import Version

SELECTOR: Reply[object] = LineShape(
    "s", r"selector pos (\d+)", "'Selector pos' and a number", lambda groups, context: int(groups[0] or 0)
)
"""What asercom-1.2.2 says before it greets (protocol.md, 1.2)."""
BANNER: Reply[object] = shapes.banner("R")
TEXT = frozenset(b"\a\t\n\f\r") | frozenset(range(0x20, 0x7F))
"""Bytes that text answers are made of."""
LONGEST_ANSWER = 2048
"""Bytes. The longest of several lines, the help text, has 1112 (protocol.md, 2.8)."""

Known = Mapping[str, Sequence[tuple[str, Reply[object]]]]


@dataclass(frozen=True, slots=True)
class Stand:
    """What stands at a place.

    Attributes:
        kind: ``ANSWER``, ``GREETING``, or ``HALF``: it began, and something else follows.
        end: Where it ends.
        names: What it may be the answer to; one name unless its looks fit several.
        awaited: The request it answers, or None.
        value: Its value.
        problem: What is wrong with it.
        is_foreign: Only other firmwares have such an answer.
    """

    kind: Kind
    end: int
    names: tuple[str, ...] = ()
    awaited: Awaited | None = None
    value: object = None
    problem: str = ""
    is_foreign: bool = False


class Wait(Exception):
    """The bytes may still become an answer of several lines."""


def match(waiting: Iterable[Awaited], window: bytes, start: int, line: int, context: Context) -> Stand | None:
    """Return which of those who wait is answered from *start* to the end of *window*.

    Args:
        waiting: Whose answers are text, the likeliest first.
        window: Bytes up to the end of a line.
        start: Where the answer begins.
        line: Where the last line of *window* begins; behind *start* where it goes on.
        context: What is known of the robot.

    Raises:
        Wait: More lines may follow.
    """
    begun: Awaited | None = None
    refused: Stand | None = None
    waiting = list(waiting)
    for awaited in waiting:
        try:
            taken = _take(awaited.reply, window, start, context)
        except CommandRejected as error:
            refused = refused or Stand(Kind.ANSWER, len(window), (awaited.name,), awaited, None, error.message)
        except (Stray, RemoteProtocolError):
            continue
        else:
            if taken is not None:
                return Stand(Kind.ANSWER, taken[0], (awaited.name,), awaited, taken[1])
            begun = begun or awaited
    if begun is None:
        return refused
    others = [each.reply for each in waiting if each is not begun]
    if line > start and _is_elsewhere(begun.reply, others, window, start, line, context):
        return Stand(Kind.HALF, line, (begun.name,), begun, None, "the rest of the answer is missing")
    raise Wait


def malformed(awaited: Awaited, window: bytes, context: Context) -> str:
    """Return why a line that begins like the answer is none; empty if it does not even begin so."""
    try:
        _take(awaited.reply, window, 0, context)
    except Stray:
        return ""
    except RemoteProtocolError as error:
        return error.message
    return ""


def guess(window: bytes, start: int, line: int, context: Context) -> Stand | None:
    """Return what stands from *start* to the end of *window* by its looks alone; arguments as of :func:`match`.

    Raises:
        Wait: More lines may follow.
    """
    if GREETING in window[start:]:
        return _greeting(window, start, line, context)
    letter = chr(window[start:].lstrip(LINE_ENDS)[0]).lower()
    selector = _whole(SELECTOR, window, start, context) if letter == "s" else None
    if selector is not None:
        return Stand(Kind.GREETING, selector[0], ("selector at start",), None, selector[1])
    for firmware in (context.profile.name, ""):
        rows = known_text(firmware).get(letter, ())
        found = {name: taken for name, reply in rows if (taken := _whole(reply, window, start, context)) is not None}
        if found:
            end, value = next(iter(found.values()))
            return Stand(Kind.ANSWER, end, tuple(found), None, value, is_foreign=not firmware)
        for name, reply in rows:
            if _has_begun(reply, window, start, context):
                first = chr(window[line:].lstrip(LINE_ENDS)[0]).lower()
                others = [other for _, other in known_text("").get(first, ()) if pattern_of(other) != pattern_of(reply)]
                if line > start and _is_elsewhere(reply, others, window, start, line, context):
                    return Stand(Kind.HALF, line, (name,), None, None, "the rest of the answer is missing")
                raise Wait
    return None


def stands_out(waiting: Iterable[Awaited], window: bytes, line: int) -> int | None:
    """Return where, within the last line, an answer begins that has something else before it; None if none does."""
    patterns = tuple(dict.fromkeys(pattern_of(each.reply) for each in waiting))
    found = _at_end(_ending(patterns), window, line) if patterns else None
    return _at_end(_known_ending(), window, line) if found is None else found


def ends_with(waiting: Iterable[Awaited], window: bytes, start: int) -> int | None:
    """Return where the line begins that *window* ends with, if it answers one of those who wait or is a greeting."""
    patterns = tuple(dict.fromkeys([*(pattern_of(each.reply) for each in waiting), _GREETING]))
    return _at_end(_ending(patterns), window, start)


def is_text(data: bytes | bytearray) -> bool:
    """Return whether these bytes can be text of a robot."""
    return TEXT.issuperset(data)


@functools.cache
def known_text(firmware: str) -> Known:
    """Return the text answers of a firmware by their first letter; of all firmwares if *firmware* is empty."""
    absent = PROFILES[firmware].absent if firmware else {}
    found: dict[str, list[tuple[str, Reply[object]]]] = {
        "z": [("an unknown command", NOT_FOUND)],
        **{str(digit): [("i2c_scan", SCANNED)] for digit in range(10)},
    }
    for spec in SPECS.values():
        if spec.text is not None and spec.name not in (*absent, "i2c_scan", "reset"):
            first = '"' if spec.name == "help_text" else spec.letter.lower()
            found.setdefault(first, []).append((spec.name, spec.text.reply))
    return found


def pattern_of(reply: Reply[object]) -> str:
    """Return the regular expression of a text answer's first line."""
    if isinstance(reply, LineShape):
        return reply.pattern
    return rf"(?:{reply.first})[^\r\n]*" if isinstance(reply, Lines) else r"(?!)"


_GREETING = rf"(?:\x0c\x07)?{GREETING.decode()}[^\r\n]*"


@functools.lru_cache(maxsize=256)
def _ending(patterns: tuple[str, ...]) -> re.Pattern[bytes]:
    """Return what finds a line that one of *patterns* is at the end of some bytes."""
    return re.compile("|".join(f"(?:{each})" for each in patterns).join(("(?:", r")\r?\n\Z")).encode(), re.IGNORECASE)


@functools.cache
def _known_ending() -> re.Pattern[bytes]:
    replies = [reply for letter, rows in known_text("").items() if letter.isalpha() for _, reply in rows]
    return _ending((_GREETING, *dict.fromkeys(map(pattern_of, [*replies, SELECTOR]))))


def _at_end(pattern: re.Pattern[bytes], window: bytes, start: int) -> int | None:
    """Return where the last line begins, if it is one of these and stands out from what is before it."""
    found = pattern.search(window, start)
    if found is None:
        return None
    at = found.start()
    # "d" and a line end may be the end of a word; behind a byte that is no text they are an acknowledgement.
    is_sure = at == start or len(window) - at >= len(b"c,3\r\n") or window[at - 1] not in TEXT
    return at if is_sure else None


def _take(reply: Reply[object], window: bytes, start: int, context: Context) -> tuple[int, object] | None:
    """Return what the shape takes; noise may hold numbers of hundreds of digits."""
    try:
        return reply.take(window, start, context)
    except OverflowError:
        raise RemoteProtocolError("the answer holds a number that no robot sends") from None


def _whole(reply: Reply[object], window: bytes, start: int, context: Context) -> tuple[int, object] | None:
    try:
        taken = _take(reply, window, start, context)
    except (Stray, RemoteProtocolError):
        return None
    if taken is not None and isinstance(taken[1], Version) and not taken[1].text.startswith("Version"):
        return None  # "v," and anything is a version to who asked for one, not to who guesses
    return taken


def _has_begun(reply: Reply[object], window: bytes, start: int, context: Context) -> bool:
    try:
        return _take(reply, window, start, context) is None
    except (Stray, RemoteProtocolError):
        return False


def _is_elsewhere(
    reply: Reply[object], others: Iterable[Reply[object]], window: bytes, start: int, line: int, context: Context
) -> bool:
    """Return whether the last line belongs to something else than the answer that still goes on before it."""
    if GREETING in window[line:]:
        return pattern_of(reply) != pattern_of(BANNER)
    return len(window) - start > LONGEST_ANSWER or any(
        _whole(other, window, line, context) is not None for other in others
    )


def _greeting(window: bytes, start: int, line: int, context: Context) -> Stand | None:
    if line > start and GREETING not in window[start:line]:
        return Stand(Kind.HALF, line, (), None, None, "the rest of the answer is missing")
    before = window[start : window.index(GREETING, start)].removesuffix(b"\x0c\x07").strip(LINE_ENDS)
    if before not in (b"", b"r"):
        return None
    whole = _whole(BANNER, window, start, context)
    if whole is not None:
        return Stand(Kind.GREETING, whole[0], ("the robot has started",))
    if line == start and _has_begun(BANNER, window, start, context):
        raise Wait
    if line == start:
        return None
    return Stand(
        Kind.GREETING, line, ("the robot has started",), None, None, "the second line of its greeting is missing"
    )
