"""The robot's half of a capture: which bytes are the answer to which request.

A line is matched with the requests that wait, the oldest first. If it answers a later request, the earlier ones do not
get an answer any more. Binary answers have no framing: the request tells their length. If a text question was sent
behind the request, its answer must stand right behind that length. Each decision needs only the bytes up to a certain
one and the requests sent before it, so it is the same however a capture is cut into pieces.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Unpack

from elib.link.protocol.context import Context
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.replies import LONGEST_LINE
from elib.link.protocol.shapes import PICTURE_HEADER
from elib.link.protocol.values import Version
from elib.records.decoding.lengths import Measure, candidates, measure
from elib.records.decoding.lines import CaptureBuffer, Kind, Line, Meaning
from elib.records.decoding.requests import LINE_ENDS, SCANNED, ExpectedAnswer
from elib.records.decoding.text import Incomplete, TextMatch, ends_with, guess, is_text, malformed, match, stands_out

MOST_EXPECTED = 64
"""Requests kept without an answer; the receive ring of a robot holds no more."""
MOST_LOST = 8192
"""Bytes in one line of those that nothing explains; twice the longest answer."""
BEHIND = 128
"""Bytes behind a binary answer within which the next answer must end; the longest line has 100."""


class AnswerReader:
    """Cuts the robot's bytes into answers.

    Args:
        context: What is known of the robot.
        restarted: Called when the robot greets.
        learned: Called with the answer to ``V``, or with an empty text at the line that only asercom-1.2.2 sends. It
            returns what is wrong with that.

    Attributes:
        expected: The answers that should come, the oldest first.
        hears_host: Whether the capture has bytes from the host.
        hears_robot: Whether the capture has bytes from the robot.
        is_certain: Whether the firmware is known, not assumed.
    """

    def __init__(self, context: Context, restarted: Callable[[], None], learned: Callable[[str], str]) -> None:
        self.expected: deque[ExpectedAnswer] = deque()
        self.hears_host = False
        self.is_certain = False
        self.hears_robot = False
        self._context = context
        self._restarted = restarted
        self._learned = learned
        self._buffer = CaptureBuffer("to host")
        self._lost = 0  # bytes at the front that nothing explains yet
        self._seen = 0  # bytes at the front whose lines have been looked at
        self._unanswered: list[str] = []
        self._is_in_leftovers = False

    def expect(self, expected: ExpectedAnswer) -> None:
        """Expect one more answer."""
        self.expected.append(expected)
        if len(self.expected) > MOST_EXPECTED:
            self._give_up(self.expected[0])

    def feed(self, data: bytes, time: float | None) -> list[Line]:
        """Take bytes that came from the robot and return the lines that are complete."""
        self.hears_robot = self.hears_robot or bool(data)
        self._buffer.append(data, time)
        lines: list[Line] = []
        while self._buffer.bytes:
            head = self.expected[0] if self.expected else None
            found = self._binary(head) if head is not None and head.is_binary and not self._lost else self._text()
            if found is None:
                break
            lines += found
        return lines

    def close(self) -> list[Line]:
        """Return what is left if no answer is expected: the host speaks now, so the robot has finished."""
        lines = [] if self.expected else self.flush()
        self._is_in_leftovers = False
        return lines

    def flush(self) -> list[Line]:
        """Return what is left; no more bytes come."""
        head = self.expected[0] if self.expected else None
        if not self._buffer.bytes:
            return []
        if head is None or not head.is_binary or self._lost:
            return self._explain(len(self._buffer.bytes), ())
        self.expected.popleft()
        found = measure(head.parts, self._buffer.bytes, self._context)
        lines = self._parts(found)
        left = len(self._buffer.bytes)
        if left and found.length is not None and found.parts and found.parts[-1].end == found.length:
            return lines + self._explain(left, ())
        if left:
            problem = found.lacks(sum(len(line.data) for line in lines) + left)
            lines.append(self._cut(left, Kind.HALF, name=head.name, problem=problem))
        return lines

    # -- binary --

    def _binary(self, head: ExpectedAnswer) -> list[Line] | None:
        data = self._buffer.bytes
        found = measure(head.parts, data, self._context)
        at = self._cut_short(found)
        if at is not None:
            # Measure without the bytes behind the line that tells: in another cut they may not be here yet.
            return self._wrong_length(at, head, measure(head.parts, data[: self._seen], self._context))
        if found.length is None or len(data) < found.length:
            return None
        if found.error:
            self.expected.popleft()
            return [*self._parts(found), self._cut(PICTURE_HEADER, Kind.MALFORMED, name=head.name, problem=found.error)]
        follower = self.expected[1] if len(self.expected) > 1 else None
        problem = ""
        if follower is not None and not follower.is_binary and not follower.may_lack:
            # A blank line counts here: it may be the end of an answer that began too early.
            end, limit = data.find(b"\n", found.length) + 1, found.length + BEHIND
            if not 0 < end <= limit and len(data) < limit:
                return None
            window = bytes(data[: end if 0 < end <= limit else limit])
            at = ends_with([follower], window, max(0, len(window) - LONGEST_LINE))
            if at is not None and at != found.length:
                return self._wrong_length(at, head, found)
            if at is None and match([follower], window, found.length, found.length, self._context) is None:
                problem = f"out of step: the answer to {follower.request} should stand right behind"
        self.expected.popleft()
        return self._parts(found, problem)

    def _cut_short(self, found: Measure) -> int | None:
        """Return where an answer to a later request, or a greeting, interrupts a binary answer, or None."""
        data = self._buffer.bytes
        limit = len(data) if found.length is None else min(len(data), found.length)
        while (newline := data.find(b"\n", self._seen, limit)) >= 0:
            self._seen = newline + 1
            start = max(0, newline - LONGEST_LINE)
            at = ends_with(self._texts(), bytes(data[start : newline + 1]), 0)
            if at is not None:
                return start + at
        return None

    def _wrong_length(self, length: int, head: ExpectedAnswer, found: Measure) -> list[Line]:
        self._seen = 0
        if length == 0:
            self._give_up(head)
            return []
        self.expected.popleft()
        return [self._cut(length, Kind.MALFORMED, name=head.name, problem=found.lacks(length))]

    def _parts(self, found: Measure, problem: str = "") -> list[Line]:
        lines: list[Line] = []
        at = 0
        for part in found.parts:
            kind = Kind.MALFORMED if problem else Kind.ANSWER
            what = problem or part.problem
            lines.append(self._cut(part.end - at, kind, name=part.name, value=part.value, problem=what))
            at = part.end
        return lines

    # -- text --

    def _text(self) -> list[Line] | None:
        data = self._buffer.bytes
        start, line = self._lost, max(self._lost, self._seen)
        end = self._line_end(line)
        if end is None or end > line + LONGEST_LINE:
            end = None
        if not start and self._turns_binary(line + LONGEST_LINE if end is None else end):
            return []
        if end is None:
            return self._lose(line + LONGEST_LINE) if len(data) > line + LONGEST_LINE else None
        window = bytes(data[:end])
        if self._is_in_leftovers and not self.expected:
            return self._explain(end, ())
        found = match(self._texts(), window, start, line, self._context)
        found = found or guess(window, start, line, self._context)
        if isinstance(found, Incomplete):
            self._seen = end
            return []
        if found is not None:
            return self._settle(found, start)
        at = stands_out(self._texts(), window, line)
        if at is not None and at > start:
            self._lost, self._seen = at, 0
            return []
        return self._unknown(window, start)

    def _unknown(self, window: bytes, start: int) -> list[Line]:
        if start or not is_text(window):
            return self._lose(len(window))
        head = self.expected[0] if self.expected and not self.expected[0].is_binary else None
        problem = malformed(head, window, self._context) if head is not None else ""
        if problem and head is not None:
            self.expected.popleft()
            return [self._cut(len(window), Kind.MALFORMED, name=head.name, problem=problem)]
        return self._explain(len(window), ())

    def _texts(self) -> list[ExpectedAnswer]:
        """Return the expected text answers, first those asked for since the robot started."""
        texts = [each for each in self.expected if not each.is_binary]
        return sorted(texts, key=lambda each: each.is_outdated)

    def _line_end(self, start: int) -> int | None:
        """Return the end of the first line from *start* on that is not blank; None if it is still missing."""
        data = self._buffer.bytes
        end = data.find(b"\n", start) + 1
        while end and not data[start:end].strip(LINE_ENDS):
            end = data.find(b"\n", end) + 1
        return end or None

    def _turns_binary(self, end: int) -> bool:
        """Give up text answers if the bytes are not text, so that a later, binary answer came instead."""
        place = next((at for at, each in enumerate(self.expected) if each.is_binary), None)
        if not place or is_text(self._buffer.bytes[:end]):
            return False
        for _ in range(place):
            self._give_up(self.expected[0])
        self._seen = 0
        return True

    def _settle(self, found: TextMatch, start: int) -> list[Line]:
        """Return the lines of an answer and of the unexplained bytes before it."""
        expected, skipped = found.expected, []
        while expected is not None and self.expected[0] is not expected:
            skipped.append(self.expected[0])
            self._give_up(skipped[-1])
        lines = self._explain(start, skipped)
        value, kind, problem = found.value, found.kind, found.problem
        if isinstance(value, Version):
            is_epuck = value.text.startswith("Version")
            problem = self._learned(value.text) if is_epuck else "not a version of e-puck firmware"
            value = Version(value.text, self._context.profile.name, value.hardware)
        elif kind is Kind.GREETING and value is not None:
            problem = self._learned("")
        if expected is not None:
            if expected.reply is not SCANNED:
                self.expected.popleft()
            if not problem:
                expected.confirm(self._context)
        elif kind is Kind.ANSWER and self.hears_host:
            kind, problem = Kind.SURPLUS, problem or "no request that waits gets this answer"
        elif kind is Kind.ANSWER and found.is_foreign and self.is_certain:
            problem = problem or f"{self._context.profile.name} has no such answer"
        several = found.names if len(found.names) > 1 else ()
        name = found.names[0] if found.names else ""
        lines.append(self._cut(found.end - start, kind, name=name, value=value, candidates=several, problem=problem))
        self._is_in_leftovers = name == "X"
        if (kind is Kind.GREETING and value is None) or (name == "reset" and kind is Kind.ANSWER):
            self._restart()
        return lines

    # -- what nothing explains --

    def _lose(self, end: int) -> list[Line]:
        self._lost, self._seen = end, 0
        return self._explain(end, ()) if end >= MOST_LOST else []

    def _explain(self, count: int, skipped: Sequence[ExpectedAnswer]) -> list[Line]:
        """Return lines for the first *count* bytes, which are not a text answer.

        Args:
            count: How many bytes.
            skipped: Requests that must have been answered before, as a later one is answered behind these bytes.
        """
        if not count:
            return []
        data = bytes(self._buffer.bytes[:count])
        if not data.strip(LINE_ENDS):
            return [self._cut(count, Kind.FILLER, name="line end")]
        for expected in skipped:
            if expected.is_binary:
                self._unanswered.remove(expected.request)
                found = measure(expected.parts, data, self._context)
                if found.length == count and not found.error:
                    return self._parts(found)
                return [self._cut(count, Kind.MALFORMED, name=expected.name, problem=found.lacks(count))]
        if self._is_in_leftovers:
            return [self._cut(count, Kind.ANSWER, name="X", problem="what the robot's buffer still held")]
        if data.strip(LINE_ENDS) == b"r":
            return [self._cut(count, Kind.ANSWER, name="reset")]
        if is_text(data):
            is_line = data.endswith(b"\n") and not self._seen
            problem = "no answer looks like this" if is_line else "the end of the answer is missing"
            return [self._cut(count, Kind.UNKNOWN if is_line else Kind.HALF, problem=problem)]
        if self.hears_host:
            return [self._cut(count, Kind.UNKNOWN, problem="no request that waits gets these bytes")]
        profiles = [self._context.profile] if self.is_certain else list(PROFILES.values())
        names = candidates(data, profiles)
        if not names:
            return [self._cut(count, Kind.UNKNOWN, problem=f"no binary answer has {count} bytes")]
        return [self._cut(count, Kind.ANSWER, name=names[0] if len(names) == 1 else "", candidates=names)]

    def _cut(self, count: int, kind: Kind, **meaning: Unpack[Meaning]) -> Line:
        self._lost, self._seen = max(0, self._lost - count), max(0, self._seen - count)
        meaning["unanswered"] = tuple(self._unanswered)
        self._unanswered.clear()
        return self._buffer.cut(count, kind, **meaning)

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
