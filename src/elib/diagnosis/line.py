"""Listening and asking before anything relies on the protocol: silence, noise, and binary sessions left open."""

from __future__ import annotations

import asyncio
import re
from dataclasses import dataclass

from elib.protocol.profiles import LONGEST_PARAMETERS
from elib.transport import Transport

QUIET = 0.2
"""s without a byte that count as silence (protocol.md, 8)."""
LONGEST_CHATTER = 1.5
"""s that an earlier program's answer may still come; the longest, a picture, takes 0.4 s."""
PATIENCE = 1.0
"""s for an answer; a slow Bluetooth link takes 0.2 s."""
ENOUGH = 4096
"""Bytes after which whatever comes is no answer to ``V``."""
TOO_MUCH = 65536
"""Bytes after which a line is not quiet; the largest picture has 38,403."""
STRANGE = 0.2
"""Share of bytes that no text has, above which a line is noise."""

_VERSION = re.compile(rb"v,[^\r\n]*\r?\n", re.IGNORECASE)
_STOPPED = re.compile(rb"s\r\n", re.IGNORECASE)  # behind whatever a binary session still had to say
_EITHER = re.compile(_VERSION.pattern + rb"|" + _STOPPED.pattern, re.IGNORECASE)
_TEXT = frozenset(b"\r\n\t\f\a\0") | frozenset(range(0x20, 0x7F))


@dataclass(frozen=True, slots=True)
class Exchange:
    """What was heard on the bare line.

    Attributes:
        unasked: What came before anything was asked.
        is_quiet: Whether the line fell silent by itself.
        first: What came after ``V`` alone.
        second: What came after zeros, which end a binary session, ``S`` and ``V`` once more.
        waited: s until the first ``V`` was answered; 0 if it never was.
    """

    unasked: bytes
    is_quiet: bool
    first: bytes = b""
    second: bytes = b""
    waited: float = 0.0

    @property
    def answered(self) -> bool:
        """Whether the plain question was answered: at once, or late, which is before the answer to what came next."""
        return bool(_VERSION.search(self.first)) or bool(_VERSION.search(_STOPPED.split(self.second)[0]))

    @property
    def was_swallowed(self) -> bool:
        """Whether the plain question met no answer, and the same after zeros did."""
        return not self.answered and bool(_VERSION.search(self.second))

    @property
    def is_noise(self) -> bool:
        """Whether what answered is no text at all."""
        heard = self.first + self.second if self.is_quiet else self.unasked
        return not _VERSION.search(heard) and sum(byte not in _TEXT for byte in heard) > STRANGE * len(heard)


async def interrogate(transport: Transport) -> Exchange:
    """Listen, ask ``V``, and where nothing sensible comes end a binary session and ask again; at most 8 s.

    A robot in a binary session takes text for commands it does not know, or for the parameters of one. The question
    comes first without the zeros all the same: only so can it be told that a session was open. In case a command to the
    motors took it for its numbers, the zeros that let it start bring a stop along.

    Raises:
        LinkLost: The link broke.
    """
    loop = asyncio.get_running_loop()
    unasked, is_quiet = await _until_quiet(transport, LONGEST_CHATTER)
    if not is_quiet:
        return Exchange(unasked, False)
    asked = loop.time()
    await transport.write(b"V\r")
    first = await _until(_VERSION, transport)
    if _VERSION.search(first):
        waited = loop.time() - asked
        rest, _ = await _until_quiet(transport, LONGEST_CHATTER)
        return Exchange(unasked, True, first + rest, b"", waited)
    await transport.write(bytes(LONGEST_PARAMETERS + 1) + b"\rS\r")
    second = await _until(_EITHER, transport)
    waited = 0.0
    if _VERSION.search(second):  # the first question's: late, or the robot was deaf
        waited = loop.time() - asked
        second += await _until(_STOPPED, transport)
    if second:
        await transport.write(b"V\r")
        second += await _until(_VERSION, transport)
    rest, _ = await _until_quiet(transport, LONGEST_CHATTER)
    return Exchange(unasked, True, first, second + rest, waited)


async def _until_quiet(transport: Transport, longest: float) -> tuple[bytes, bool]:
    """Read until nothing has come for QUIET; return what came, and whether silence came before *longest* was over."""
    loop = asyncio.get_running_loop()
    end = loop.time() + longest
    heard = bytearray()
    while True:
        try:
            async with asyncio.timeout(QUIET):
                heard += await transport.read()
        except TimeoutError:
            return bytes(heard), True
        if loop.time() > end or len(heard) > TOO_MUCH:
            return bytes(heard), False


async def _until(wanted: re.Pattern[bytes], transport: Transport) -> bytes:
    """Read until *wanted* has come, or time or patience with what else comes is over."""
    heard = bytearray()
    try:
        async with asyncio.timeout(PATIENCE):
            while not wanted.search(heard) and len(heard) < ENOUGH:
                heard += await transport.read()
    except TimeoutError:
        pass
    return bytes(heard)
