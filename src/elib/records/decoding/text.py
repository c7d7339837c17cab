"""Text answers: which of the requests that wait a line answers."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from elib.base.errors import CommandRejected, RemoteProtocolError
from elib.link.protocol import shapes
from elib.link.protocol.context import Context, Parsed, Reply
from elib.link.protocol.replies import NOT_FOUND, LineReply, LinesReply
from elib.records.decoding.lines import Kind
from elib.records.decoding.requests import ExpectedAnswer

TEXT = frozenset(b"\a\t\n\f\r") | frozenset(range(0x20, 0x7F))
"""Bytes that text answers are made of."""
MAX_ANSWER = 2048
"""Bytes. The longest answer of several lines, the help text, has 1112 (wire-protocol.md, 2.8)."""


def _unasked(name: str, reply: Reply[object]) -> ExpectedAnswer:
    return ExpectedAnswer(name, ((name, reply),), False, "", may_lack=True)


STARTED = _unasked(
    "the robot has started", replace(shapes.BANNER, letter="", first=rf"(?:\x0c\x07)?{shapes.GREETING.decode()}")
)
SELECTOR = _unasked(
    "selector at start", LineReply("", r"selector pos (\d+)", "", lambda groups, context: int(groups[0]))
)
"""The line that asercom-1.2.2 sends before it greets (wire-protocol.md, 1.2)."""
UNASKED = (STARTED, SELECTOR)
"""What a robot sends without a request, when it starts."""


@dataclass(frozen=True, slots=True)
class Found:
    """An answer in some bytes from the robot."""

    answer: ExpectedAnswer  # the expected answer that it is
    # ANSWER, GREETING, MALFORMED, HALF if something else interrupts it; None while more of its lines may follow
    kind: Kind | None
    start: int  # where it begins; noise is before it
    end: int  # where it ends
    value: object = None
    problem: str = ""  # what is wrong with it


def find(waiting: Sequence[ExpectedAnswer], window: bytes, line: int, context: Context) -> Found | None:
    """Find the answer that stands at the end of *window*.

    Args:
        waiting: The expected text answers, the most likely first. Greetings are found, too.
        window: Bytes up to the end of a line.
        line: Where the last line of *window* begins; above 0 only in an answer of several lines.
        context: What is known of the robot.
    """
    begun: ExpectedAnswer | None = None
    refused: Found | None = None
    malformed: Found | None = None
    for each in (*waiting, *UNASKED):
        is_unasked = each in UNASKED
        try:
            outcome = each.reply.parse(window, 0, context)
        except CommandRejected as error:
            if not is_unasked:
                refused = refused or Found(each, Kind.ANSWER, 0, len(window), None, error.message)
        except RemoteProtocolError as error:
            malformed = malformed or Found(each, Kind.MALFORMED, 0, len(window), None, error.message)
        except OverflowError:
            problem = "the answer holds a number that no robot sends"
            malformed = malformed or Found(each, Kind.MALFORMED, 0, len(window), None, problem)
        else:
            if isinstance(outcome, Parsed):
                return Found(each, Kind.GREETING if is_unasked else Kind.ANSWER, 0, outcome.end, outcome.value)
            if outcome is None:
                begun = begun or each
    if begun is not None:
        if line and _interrupts([each for each in waiting if each is not begun], begun, window, line, context):
            return Found(begun, Kind.HALF, 0, line, None, "the rest of the answer is missing")
        return Found(begun, None, 0, len(window))
    return refused or _behind_noise(waiting, window, line, context) or (malformed if is_text(window) else None)


def begins(waiting: Sequence[ExpectedAnswer], window: bytes | bytearray, start: int) -> int | None:
    """Return where, from *start* on, the last line of *window* begins if it is one of the answers; else None."""
    found = _ending(tuple(_first_line(each.reply) for each in (*waiting, *UNASKED))).search(window, start)
    if found is None:
        return None
    at = found.start()
    # "d" and a line end may be the end of a word; behind a byte that is not text they are an acknowledgement.
    return at if at == start or len(window) - at >= len(b"c,3\r\n") or window[at - 1] not in TEXT else None


def is_text(data: bytes | bytearray) -> bool:
    """Return whether these bytes can be text of a robot."""
    return TEXT.issuperset(data)


def _behind_noise(waiting: Sequence[ExpectedAnswer], window: bytes, line: int, context: Context) -> Found | None:
    at = begins(waiting, window, line)
    found = find(waiting, window[at:], 0, context) if at else None
    return found and replace(found, start=(at or 0) + found.start, end=(at or 0) + found.end)


def _interrupts(
    others: Sequence[ExpectedAnswer], begun: ExpectedAnswer, window: bytes, line: int, context: Context
) -> bool:
    """Return whether the last line does not belong to the unfinished answer before it."""
    found = find(others, window[line:], 0, context)
    if found is None or found.start or found.kind is Kind.MALFORMED:
        return len(window) > MAX_ANSWER
    if found.answer is STARTED:
        return begun.reply is not shapes.BANNER
    return found.kind is not None


def _first_line(reply: Reply[object]) -> str:
    """Return the regular expression of a text answer's first line."""
    if isinstance(reply, LineReply):
        return reply.pattern
    return rf"(?:{reply.first})[^\r\n]*" if isinstance(reply, LinesReply) else r"(?!)"


@functools.lru_cache(maxsize=256)
def _ending(patterns: tuple[str, ...]) -> re.Pattern[bytes]:
    """Return the regular expression of a line at the end of some bytes that fits one of *patterns*, or a refusal."""
    lines = "|".join(f"(?:{each})" for each in (*patterns, NOT_FOUND))
    return re.compile(rf"(?:{lines})\r?\n\Z".encode(), re.IGNORECASE)
