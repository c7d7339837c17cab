"""Listening and asking on the bare line, before anything relies on the protocol."""

from __future__ import annotations

import asyncio
import re
from dataclasses import dataclass

from elib.link.protocol.profiles import MAX_PARAMETERS
from elib.link.transport import Transport

QUIET = 0.2
"""s without a byte that count as silence (wire-protocol.md, 8)."""
MAX_CHATTER = 1.5
"""s in which the answer to an earlier program may still come; the longest, a picture, takes 0.4 s."""
ANSWER_TIME = 1.0
"""s for an answer; a slow Bluetooth link takes 0.2 s."""
ENOUGH = 4096
"""Bytes after which whatever comes is not an answer to ``V``."""
TOO_MUCH = 65536
"""Bytes after which a line is not quiet; the largest picture has 38,403."""
STRANGE = 0.2
"""Share of bytes that text does not have, above which a line is noise."""

_VERSION = re.compile(rb"v,[^\r\n]*\r?\n", re.IGNORECASE)
_STOPPED = re.compile(rb"s\r\n", re.IGNORECASE)  # it may stand behind the last bytes of a binary session
_EITHER = re.compile(_VERSION.pattern + rb"|" + _STOPPED.pattern, re.IGNORECASE)
_TEXT = frozenset(b"\r\n\t\f\a\0") | frozenset(range(0x20, 0x7F))


@dataclass(frozen=True, slots=True)
class Exchange:
    """The bytes that were received on the bare line."""

    unasked: bytes  # bytes that came before anything was asked
    is_quiet: bool  # whether the line fell silent by itself
    first: bytes = b""  # bytes that came after `V` alone
    second: bytes = b""  # bytes that came after zeros, which end a binary session, `S` and `V` once more
    waited: float = 0.0  # time until the first `V` was answered, s; 0 if it never was

    @property
    def answered(self) -> bool:
        """Whether the plain question was answered: at once, or late, but before the answer to the next command."""
        return bool(_VERSION.search(self.first)) or bool(_VERSION.search(_STOPPED.split(self.second)[0]))

    @property
    def was_swallowed(self) -> bool:
        """Whether the plain question got no answer, and the same question after zeros did."""
        return not self.answered and bool(_VERSION.search(self.second))

    @property
    def is_noise(self) -> bool:
        """Whether what came is not text at all."""
        received = self.first + self.second if self.is_quiet else self.unasked
        return not _VERSION.search(received) and sum(byte not in _TEXT for byte in received) > STRANGE * len(received)


async def interrogate(transport: Transport) -> Exchange:
    """Listen, ask ``V``, and if no version comes end a binary session and ask again; this takes at most 8 s.

    A robot in a binary session takes text for commands that it does not know, or for the parameters of one. The first
    question still comes without the zeros: only then can the check tell that a session was open. If a command to the
    motors took the question for its numbers, the zeros let it start; the stop that follows them ends it at once.

    Raises:
        LinkLost: The link broke.
    """
    loop = asyncio.get_running_loop()
    unasked, is_quiet = await _until_quiet(transport, MAX_CHATTER)
    if not is_quiet:
        return Exchange(unasked, False)
    asked = loop.time()
    await transport.write(b"V\r")
    first = await _until(_VERSION, transport)
    if _VERSION.search(first):
        waited = loop.time() - asked
        rest, _ = await _until_quiet(transport, MAX_CHATTER)
        return Exchange(unasked, True, first + rest, b"", waited)
    await transport.write(bytes(MAX_PARAMETERS + 1) + b"\rS\r")
    second = await _until(_EITHER, transport)
    waited = 0.0
    if _VERSION.search(second):  # the answer to the first question: it was late, or the robot was busy
        waited = loop.time() - asked
        second += await _until(_STOPPED, transport)
    if second:
        await transport.write(b"V\r")
        second += await _until(_VERSION, transport)
    rest, _ = await _until_quiet(transport, MAX_CHATTER)
    return Exchange(unasked, True, first, second + rest, waited)


async def heard(transport: Transport) -> bytes:
    """Return what a robot sends before it is asked, in the time that counts as silence or a little longer.

    Raises:
        LinkLost: The link broke.
    """
    received, _ = await _until_quiet(transport, QUIET)
    return received


async def _until_quiet(transport: Transport, longest: float) -> tuple[bytes, bool]:
    """Read until nothing has come for QUIET.

    Returns:
        The bytes, and whether the line fell silent within *longest*, s.
    """
    loop = asyncio.get_running_loop()
    end = loop.time() + longest
    received = bytearray()
    while True:
        try:
            async with asyncio.timeout(QUIET):
                received += await transport.read()
        except TimeoutError:
            return bytes(received), True
        if loop.time() > end or len(received) > TOO_MUCH:
            return bytes(received), False


async def _until(wanted: re.Pattern[bytes], transport: Transport) -> bytes:
    """Read until *wanted* has come, the time for an answer is over, or too many other bytes have come."""
    received = bytearray()
    try:
        async with asyncio.timeout(ANSWER_TIME):
            while not wanted.search(received) and len(received) < ENOUGH:
                received += await transport.read()
    except TimeoutError:
        pass
    return bytes(received)
