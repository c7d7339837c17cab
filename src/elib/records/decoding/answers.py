"""The robot's half of a capture: which bytes are the answer to which request.

A line is matched with the requests that wait, the oldest first. If it answers a later request, the earlier ones do not
get an answer any more. Binary answers have no framing: the request tells their length. If a text question was sent
behind the request, its answer must stand right behind that length. Each decision needs only the bytes up to a certain
one and the requests sent before it, so it is the same however a capture is cut into pieces.

The session's own :class:`~elib.link.protocol.connection.HostConnection` cannot do this: it has one request under way
and drops bytes that do not answer it. Other programs send several at once, and here every byte comes out in a line.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from elib.link.protocol.context import Context
from elib.link.protocol.replies import MAX_LINE
from elib.link.protocol.values import Version
from elib.records.decoding.lengths import Measure, measure
from elib.records.decoding.lines import CaptureBuffer, Kind, Line
from elib.records.decoding.requests import LINE_ENDS, SCANNED, ExpectedAnswer
from elib.records.decoding.text import SELECTOR, STARTED, Found, begins, find, is_text

MAX_EXPECTED = 64
"""Requests kept without an answer; the receive ring of a robot holds no more."""
BEHIND = 128
"""Bytes behind a binary answer within which the next answer must end; the longest line has 100."""

_TEXT_BEHIND = re.compile(rb"[ -~]{3,}\r?\n\Z")
"""A line of text behind binary bytes."""


class AnswerReader:
    """Cuts the robot's bytes into answers.

    Args:
        context: What is known of the robot.
        restarted: Called when the robot greets.
        learned: Called with the answer to ``V``, or with an empty text at the line that only asercom-1.2.2 sends. It
            returns what is wrong with that.

    Attributes:
        hears_host: Whether the capture has bytes from the host.
        hears_robot: Whether the capture has bytes from the robot.
    """

    def __init__(self, context: Context, restarted: Callable[[], None], learned: Callable[[str], str]) -> None:
        self.expected: deque[ExpectedAnswer] = deque()  # the answers that should come, the oldest first
        self.hears_host = self.hears_robot = False
        self._context = context
        self._restarted = restarted
        self._learned = learned
        self._buffer = CaptureBuffer("to host")
        self._line = 0  # where the line begins that was not looked at: inside an answer of several lines, or binary
        self._unanswered: list[str] = []

    def expect(self, expected: ExpectedAnswer) -> None:
        """Expect one more answer."""
        self.expected.append(expected)
        if len(self.expected) > MAX_EXPECTED:
            self._give_up(self.expected[0])

    def feed(self, data: bytes, time: float | None) -> list[Line]:
        """Take bytes that came from the robot and return the lines that are complete."""
        self.hears_robot = True
        self._buffer.append(data, time)
        lines: list[Line] = []
        while self._buffer.bytes:
            is_binary = bool(self.expected) and self.expected[0].is_binary
            found = self._binary(self.expected[0]) if is_binary else self._text()
            if found is None:
                break
            lines += found
        return lines

    def close(self) -> list[Line]:
        """Return what is left if no answer is expected: the host speaks now, so the robot has finished."""
        return [] if self.expected else self.flush()

    def flush(self) -> list[Line]:
        """Return what is left; no more bytes come."""
        data = self._buffer.bytes
        if not data:
            return []
        if not self.expected or not self.expected[0].is_binary:
            return [self._rest()]
        head = self.expected.popleft()
        found, count = measure(head.parts, data, self._context), len(data)
        lines = self._parts(found, head.name)
        if data and found.is_whole:
            lines.append(self._rest())
        elif data:
            lines.append(self._cut(len(data), Kind.HALF, name=head.name, problem=found.lacks(count)))
        return lines

    # -- binary --

    def _binary(self, head: ExpectedAnswer) -> list[Line] | None:
        """Return the binary answer at the front, up to its length or to the text answer that stands before that."""
        data = self._buffer.bytes
        whole = measure(head.parts, data, self._context)
        follower = self.expected[1] if len(self.expected) > 1 and not whole.error else None
        if follower is not None and (follower.is_binary or follower.may_lack):
            follower = None  # nothing tells where it must stand
        while (end := data.find(b"\n", self._line) + 1) and (whole.length is None or end <= whole.length):
            at = begins(self._texts(), data[:end], max(0, end - MAX_LINE))
            if at is not None:
                # Measured without the bytes behind: in another cut they may not be here yet.
                return self._wrong_length(at, head, measure(head.parts, data[:end], self._context))
            self._line = end
        if whole.length is None or len(data) < whole.length:
            return None
        problem = ""
        if follower is not None:
            limit = whole.length + BEHIND
            if not end and len(data) < limit:
                return None
            window = data[: min(end or limit, limit)]
            at = begins([follower], window, max(0, len(window) - MAX_LINE))
            if at is None:
                problem = f"out of step: the answer to {follower.request} should stand right behind"
            elif at != whole.length:
                return self._wrong_length(at, head, whole)
        self.expected.popleft()
        return self._parts(whole, head.name, problem)

    def _wrong_length(self, length: int, head: ExpectedAnswer, found: Measure) -> list[Line]:
        self._line = 0
        if length == 0:
            self._give_up(head)
            return []
        self.expected.popleft()
        return [self._cut(length, Kind.MALFORMED, name=head.name, problem=found.lacks(length))]

    def _parts(self, found: Measure, name: str, problem: str = "") -> list[Line]:
        lines: list[Line] = []
        at = 0
        for part in found.parts:
            kind, what = Kind.MALFORMED if problem else Kind.ANSWER, problem or part.problem
            lines.append(self._cut(part.end - at, kind, name=part.name, value=part.value, problem=what))
            at = part.end
        if found.error and found.length is not None:
            lines.append(self._cut(found.length - at, Kind.MALFORMED, name=name, problem=found.error))
        return lines

    # -- text --

    def _text(self) -> list[Line] | None:
        data = self._buffer.bytes
        limit = self._line + MAX_LINE
        end = self._line_end()
        if self._turns_binary(data[: end or limit]):
            return []
        if not end or end > limit:
            return [self._unexplained(limit)] if len(data) > limit else None
        found = find(self._texts(), bytes(data[:end]), self._line, self._context)
        if found is None:
            return [self._unexplained(end)]
        if found.kind is None:
            self._line = found.end
            return [self._unexplained(found.start)] if found.start else []
        return self._settle(found, found.kind)

    def _texts(self) -> list[ExpectedAnswer]:
        """Return the expected text answers, first those asked for since the robot started."""
        texts = [each for each in self.expected if not each.is_binary]
        return sorted(texts, key=lambda each: each.is_outdated)

    def _line_end(self) -> int:
        """Return the end of the next line that is not blank; 0 if it is still missing."""
        data, start = self._buffer.bytes, self._line
        end = data.find(b"\n", start) + 1
        while end and not data[start:end].strip(LINE_ENDS):
            end = data.find(b"\n", end) + 1
        return end

    def _turns_binary(self, data: bytearray) -> bool:
        """Give up text answers if the bytes are not text, so that a later, binary answer came instead."""
        place = next((at for at, each in enumerate(self.expected) if each.is_binary), 0)
        if not place or is_text(data):
            return False
        for _ in range(place):
            self._give_up(self.expected[0])
        self._line = 0
        return True

    def _settle(self, found: Found, kind: Kind) -> list[Line]:
        """Return the lines of an answer that has ended, and of the noise before it."""
        answer, value = found.answer, found.value
        if answer in self.expected:
            while self.expected[0] is not answer:
                self._give_up(self.expected[0])
            if answer.reply is not SCANNED:
                self.expected.popleft()
        lines = [self._unexplained(found.start)] if found.start else []
        problem = found.problem or self._learn(found)
        if not problem:
            answer.confirm(self._context)
        if isinstance(value, Version):
            value = replace(value, firmware=self._context.profile.name)
        lines.append(self._cut(found.end - found.start, kind, name=answer.name, value=value, problem=problem))
        if answer is STARTED or (answer.name == "reset" and kind is Kind.ANSWER):
            self._restart()
        return lines

    def _learn(self, found: Found) -> str:
        """Learn the firmware if the answer tells it; return what is wrong with that."""
        if isinstance(found.value, Version):
            is_epuck = found.value.text.startswith("Version")
            return self._learned(found.value.text) if is_epuck else "not a version of e-puck firmware"
        return self._learned("") if found.answer is SELECTOR else ""

    # -- what nothing explains --

    def _unexplained(self, count: int) -> Line:
        """Return a line for the first *count* bytes, which no request explains."""
        data = self._buffer.bytes[:count]
        if not data.strip(LINE_ENDS):
            return self._cut(count, Kind.FILLER, name="line end")
        if not self.hears_host:
            tail = None if is_text(data) else _TEXT_BEHIND.search(data)
            return self._cut(tail.start() if tail else count, Kind.BYTES)
        if is_text(data) and data.endswith(b"\n"):
            return self._cut(count, Kind.SURPLUS, problem="no request that waits gets this answer")
        return self._cut(count, Kind.UNKNOWN, problem="no request that waits gets these bytes")

    def _rest(self) -> Line:
        """Return a line for all that is left."""
        data = self._buffer.bytes
        if not is_text(data) or not data.strip(LINE_ENDS):
            return self._unexplained(len(data))
        if data.strip(LINE_ENDS) == b"r":
            return self._cut(len(data), Kind.ANSWER, name="reset")
        return self._cut(len(data), Kind.HALF, problem="the end of the answer is missing")

    def _cut(self, count: int, kind: Kind, **about: Any) -> Line:
        self._line = max(0, self._line - count)
        unanswered, self._unanswered = tuple(self._unanswered), []
        return self._buffer.cut(count, kind, **about, unanswered=unanswered)

    # -- expected answers --

    def _restart(self) -> None:
        """Forget what the robot forgets when it restarts."""
        for each in [each for each in self.expected if each.is_binary]:
            self._give_up(each)
        for each in self.expected:
            each.is_outdated = True
        self._context.forget()
        self._restarted()

    def _give_up(self, expected: ExpectedAnswer) -> None:
        self.expected.remove(expected)
        if self.hears_robot and not expected.may_lack:
            self._unanswered.append(expected.request)
