"""Text answers: which request a line answers, by the requests that wait or by the form of the line alone."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from elib.base.errors import CommandRejected, RemoteProtocolError
from elib.link.protocol import shapes
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context, Parsed, Reply, UnexpectedReply
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.replies import LineReply, LinesReply
from elib.link.protocol.shapes import GREETING
from elib.link.protocol.values import Version
from elib.records.decoding.lines import Kind
from elib.records.decoding.requests import HELP, LINE_ENDS, REFUSED, SCANNED, UNGUARDED, ExpectedAnswer

SELECTOR: Reply[object] = LineReply(
    "s", r"selector pos (\d+)", "'Selector pos' and a number", lambda groups, context: int(groups[0] or 0)
)
"""The line that asercom-1.2.2 sends before it greets (wire-protocol.md, 1.2)."""
TEXT = frozenset(b"\a\t\n\f\r") | frozenset(range(0x20, 0x7F))
"""Bytes that text answers are made of."""
LONGEST_ANSWER = 2048
"""Bytes. The longest of several lines, the help text, has 1112 (wire-protocol.md, 2.8)."""

Known = Mapping[str, Sequence[tuple[str, Reply[object]]]]


@dataclass(frozen=True, slots=True)
class TextMatch:
    """The meaning of some bytes from the robot.

    Attributes:
        kind: ``ANSWER``, ``GREETING``, or ``HALF`` for the beginning of an answer that something else interrupts.
        end: Where it ends.
        names: The commands that it may answer; one name unless several have such an answer.
        expected: The request that it answers, or None.
        value: The value of the answer.
        problem: What is wrong with the answer.
        is_foreign: Whether only other firmwares have such an answer.
    """

    kind: Kind
    end: int
    names: tuple[str, ...] = ()
    expected: ExpectedAnswer | None = None
    value: object = None
    problem: str = ""
    is_foreign: bool = False


@dataclass(frozen=True, slots=True)
class Incomplete:
    """The bytes may still become an answer of several lines."""


def match(
    waiting: Iterable[ExpectedAnswer], window: bytes, start: int, line: int, context: Context
) -> TextMatch | Incomplete | None:
    """Find the request whose answer stands from *start* to the end of *window*.

    Args:
        waiting: The expected text answers, the most likely first.
        window: Bytes up to the end of a line.
        start: Where the answer begins.
        line: Where the last line of *window* begins: behind *start* in an answer of several lines.
        context: What is known of the robot.

    Returns:
        The match, :class:`Incomplete` if more lines may follow, None if no request has such an answer.
    """
    begun: ExpectedAnswer | None = None
    refused: TextMatch | None = None
    waiting = list(waiting)
    for expected in waiting:
        try:
            found = _parse(expected.reply, window, start, context)
        except CommandRejected as error:
            refused = refused or TextMatch(Kind.ANSWER, len(window), (expected.name,), expected, None, error.message)
        except RemoteProtocolError:
            continue
        else:
            if isinstance(found, Parsed):
                return TextMatch(Kind.ANSWER, found.end, (expected.name,), expected, found.value)
            if found is None:
                begun = begun or expected
    if begun is None:
        return refused
    others = [each.reply for each in waiting if each is not begun]
    if line > start and _is_elsewhere(begun.reply, others, window, start, line, context):
        return TextMatch(Kind.HALF, line, (begun.name,), begun, None, "the rest of the answer is missing")
    return Incomplete()


def malformed(expected: ExpectedAnswer, window: bytes, context: Context) -> str:
    """Return why a line that begins like the answer is not the answer; empty if it does not begin like it."""
    try:
        _parse(expected.reply, window, 0, context)
    except RemoteProtocolError as error:
        return error.message
    return ""


def guess(window: bytes, start: int, line: int, context: Context) -> TextMatch | Incomplete | None:
    """Return what the bytes from *start* to the end of *window* are, judged by their form alone.

    The arguments and the result are those of :func:`match`.
    """
    if GREETING in window[start:]:
        return _greeting(window, start, line, context)
    letter = chr(window[start:].lstrip(LINE_ENDS)[0]).lower()
    selector = _whole(SELECTOR, window, start, context) if letter == "s" else None
    if selector is not None:
        return TextMatch(Kind.GREETING, selector.end, ("selector at start",), None, selector.value)
    for firmware in (context.profile.name, ""):
        rows = known_text(firmware).get(letter, ())
        found = {name: whole for name, reply in rows if (whole := _whole(reply, window, start, context)) is not None}
        if found:
            end, value = next(iter(found.values()))
            return TextMatch(Kind.ANSWER, end, tuple(found), None, value, is_foreign=not firmware)
        for name, reply in rows:
            if _has_begun(reply, window, start, context):
                first = chr(window[line:].lstrip(LINE_ENDS)[0]).lower()
                others = [other for _, other in known_text("").get(first, ()) if pattern_of(other) != pattern_of(reply)]
                if line > start and _is_elsewhere(reply, others, window, start, line, context):
                    return TextMatch(Kind.HALF, line, (name,), None, None, "the rest of the answer is missing")
                return Incomplete()
    return None


def stands_out(waiting: Iterable[ExpectedAnswer], window: bytes, line: int) -> int | None:
    """Return where in the last line an answer begins that has other bytes before it, or None."""
    patterns = tuple(dict.fromkeys(pattern_of(each.reply) for each in waiting))
    found = _at_end(_ending(patterns), window, line) if patterns else None
    return _at_end(_known_ending(), window, line) if found is None else found


def ends_with(waiting: Iterable[ExpectedAnswer], window: bytes, start: int) -> int | None:
    """Return where the last line of *window* begins if it answers a request that waits, or is a greeting; else None."""
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
        "z": [("an unknown command", REFUSED)],
        **{str(digit): [("i2c_scan", SCANNED)] for digit in range(10)},
        '"': [("help_text", HELP)],
    }
    for spec in SPECS.values():
        if spec.text is not None and spec.name not in (*absent, *UNGUARDED, "reset"):
            found.setdefault(spec.letter.lower(), []).append((spec.name, spec.text.reply))
    return found


def pattern_of(reply: Reply[object]) -> str:
    """Return the regular expression of a text answer's first line."""
    if isinstance(reply, LineReply):
        return reply.pattern
    return rf"(?:{reply.first})[^\r\n]*" if isinstance(reply, LinesReply) else r"(?!)"


_GREETING = rf"(?:\x0c\x07)?{GREETING.decode()}[^\r\n]*"


@functools.lru_cache(maxsize=256)
def _ending(patterns: tuple[str, ...]) -> re.Pattern[bytes]:
    """Return the regular expression of a line at the end of some bytes that fits one of *patterns*."""
    return re.compile("|".join(f"(?:{each})" for each in patterns).join(("(?:", r")\r?\n\Z")).encode(), re.IGNORECASE)


@functools.cache
def _known_ending() -> re.Pattern[bytes]:
    replies = [reply for letter, rows in known_text("").items() if letter.isalpha() for _, reply in rows]
    return _ending((_GREETING, *dict.fromkeys(map(pattern_of, [*replies, SELECTOR]))))


def _at_end(pattern: re.Pattern[bytes], window: bytes, start: int) -> int | None:
    """Return where the last line begins if it fits *pattern* and can be told from what is before it, else None."""
    found = pattern.search(window, start)
    if found is None:
        return None
    at = found.start()
    # "d" and a line end may be the end of a word; behind a byte that is not text they are an acknowledgement.
    is_sure = at == start or len(window) - at >= len(b"c,3\r\n") or window[at - 1] not in TEXT
    return at if is_sure else None


def _parse(
    reply: Reply[object], window: bytes, start: int, context: Context
) -> Parsed[object] | UnexpectedReply | None:
    """Return the outcome of the shape; noise may hold numbers of hundreds of digits."""
    try:
        return reply.parse(window, start, context)
    except OverflowError:
        raise RemoteProtocolError("the answer holds a number that no robot sends") from None


def _whole(reply: Reply[object], window: bytes, start: int, context: Context) -> Parsed[object] | None:
    try:
        found = _parse(reply, window, start, context)
    except RemoteProtocolError:
        return None
    if not isinstance(found, Parsed) or (
        isinstance(found.value, Version) and not found.value.text.startswith("Version")
    ):
        return None  # if a version was asked for, any text behind "v," is one; a guess needs more evidence
    return found


def _has_begun(reply: Reply[object], window: bytes, start: int, context: Context) -> bool:
    try:
        return _parse(reply, window, start, context) is None
    except RemoteProtocolError:
        return False


def _is_elsewhere(
    reply: Reply[object], others: Iterable[Reply[object]], window: bytes, start: int, line: int, context: Context
) -> bool:
    """Return whether the last line does not belong to the unfinished answer before it."""
    if GREETING in window[line:]:
        return pattern_of(reply) != pattern_of(shapes.BANNER)
    return len(window) - start > LONGEST_ANSWER or any(
        _whole(other, window, line, context) is not None for other in others
    )


def _greeting(window: bytes, start: int, line: int, context: Context) -> TextMatch | Incomplete | None:
    if line > start and GREETING not in window[start:line]:
        return TextMatch(Kind.HALF, line, (), None, None, "the rest of the answer is missing")
    before = window[start : window.index(GREETING, start)].removesuffix(b"\x0c\x07").strip(LINE_ENDS)
    if before not in (b"", b"r"):
        return None
    whole = _whole(shapes.BANNER, window, start, context)
    if whole is not None:
        return TextMatch(Kind.GREETING, whole.end, ("the robot has started",))
    if line == start and _has_begun(shapes.BANNER, window, start, context):
        return Incomplete()
    if line == start:
        return None
    return TextMatch(
        Kind.GREETING, line, ("the robot has started",), None, None, "the second line of its greeting is missing"
    )
