"""A test of the rules of transports: ``await check_transport(factory)`` checks any transport."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from elib.base.errors import LinkClosed, LinkLost
from elib.link.transport.base import Transport

Factory = Callable[[], Awaitable[tuple[Transport, Transport]]]
"""Returns a new, connected pair: the transport under test and the other end of its cable."""

TIMEOUT = 5.0  # s for each rule; far more than a working transport needs
CLOSE_TIMEOUT = 1.0  # s for closing while the other side takes nothing
BIG = 200_000  # bytes; more than any buffer of a system or of ours
SETTLE = 0.02  # s; time for sent bytes to reach this process


async def check_transport(factory: Factory) -> None:
    """Check every rule of :class:`~elib.link.transport.base.Transport` on new pairs.

    Args:
        factory: Called once for each rule.

    Raises:
        AssertionError: A rule is broken; the message names it.
    """
    for rule in RULES:
        transport, peer = await factory()
        try:
            async with asyncio.timeout(TIMEOUT):
                await rule(transport, peer)
        except Exception as error:
            raise AssertionError(f"{rule.__name__.replace('_', ' ')}: {error!r}") from error
        finally:
            await transport.close()
            await peer.close()


async def it_says_what_it_is(transport: Transport, peer: Transport) -> None:
    """The URL has a scheme, and the origin is one of three."""
    assert "://" in transport.url, transport.url
    assert transport.origin in ("robot", "simulator", "replay"), transport.origin


async def every_byte_value_passes_both_ways(transport: Transport, peer: Transport) -> None:
    """No byte is changed, lost or echoed."""
    every = bytes(range(256)) + bytes(reversed(range(256)))
    await transport.write(every)
    assert await receive(peer, len(every)) == every
    await peer.write(every)
    assert await receive(transport, len(every)) == every


async def bytes_keep_their_order(transport: Transport, peer: Transport) -> None:
    """Many small writes arrive as one stream."""
    words = [b"%d," % number for number in range(500)]
    for word in words:
        await transport.write(word)
    assert await receive(peer, sum(map(len, words))) == b"".join(words)


async def an_empty_write_sends_nothing(transport: Transport, peer: Transport) -> None:
    """Writing no bytes is allowed and does not end the stream."""
    await transport.write(b"")
    await transport.write(b"x")
    assert await receive(peer, 1) == b"x"


async def a_cancelled_read_loses_nothing(transport: Transport, peer: Transport) -> None:
    """Reading again returns what a cancelled read would have."""
    for number in range(20):
        reading = asyncio.create_task(transport.read())
        await asyncio.sleep(0)
        await peer.write(b"%02d" % number)
        for _ in range(number % 4):
            await asyncio.sleep(0)
        reading.cancel()
        try:
            got = await reading
        except asyncio.CancelledError:
            got = b""
        got += await receive(transport, 2 - len(got)) if len(got) < 2 else b""
        assert got == b"%02d" % number, got


async def reading_and_writing_do_not_wait_for_each_other(transport: Transport, peer: Transport) -> None:
    """A read that waits lets writes pass."""
    reading = asyncio.create_task(transport.read())
    await asyncio.sleep(0)
    await transport.write(b"question")
    assert await receive(peer, 8) == b"question"
    await peer.write(b"a")
    assert await reading == b"a"


async def much_passes_both_ways_at_once(transport: Transport, peer: Transport) -> None:
    """Full buffers make the writer wait, and nothing is lost."""
    there, back = bytes(range(250)) * (BIG // 250), bytes(range(249, -1, -1)) * (BIG // 250)
    async with asyncio.TaskGroup() as group:
        group.create_task(transport.write(there))
        group.create_task(peer.write(back))
        came = group.create_task(receive(transport, BIG))
        went = group.create_task(receive(peer, BIG))
    assert came.result() == back, "what came in is not what was sent"
    assert went.result() == there, "what went out is not what arrived"


async def closing_twice_is_closing_once(transport: Transport, peer: Transport) -> None:
    """Close never raises, not even at the same time."""
    await asyncio.gather(transport.close(), transport.close())
    await transport.close()


async def a_closed_transport_stays_closed(transport: Transport, peer: Transport) -> None:
    """Reading and writing raise LinkClosed, even with unread bytes."""
    await peer.write(b"unread")
    await asyncio.sleep(SETTLE)
    await transport.close()
    await raises(LinkClosed, transport.read())
    await raises(LinkClosed, transport.write(b"x"))


async def closing_ends_a_waiting_read(transport: Transport, peer: Transport) -> None:
    """A closed transport ends a read that waits."""
    reading = asyncio.create_task(transport.read())
    await asyncio.sleep(0)
    await transport.close()
    await raises(LinkClosed, reading)


async def closing_is_bounded_while_nobody_reads(transport: Transport, peer: Transport) -> None:
    """A peer that stopped reading holds up neither close nor the writer."""
    writing = asyncio.create_task(transport.write(bytes(50 * BIG)))
    await asyncio.sleep(SETTLE)
    assert not writing.done(), "ten megabytes were taken although the peer does not read; is there no bound?"
    async with asyncio.timeout(CLOSE_TIMEOUT):
        await transport.close()
        await raises(LinkClosed, writing)


async def unread_bytes_come_before_the_loss(transport: Transport, peer: Transport) -> None:
    """Bytes that arrived before the other side closed can still be read; then reading and writing raise LinkLost."""
    await peer.write(b"last ")
    await peer.write(b"words")
    await asyncio.sleep(SETTLE)
    await peer.close()
    await asyncio.sleep(SETTLE)
    assert await receive(transport, 10) == b"last words"
    await raises(LinkLost, transport.read())
    await raises(LinkLost, transport.read())
    await raises(LinkLost, transport.write(b"x"))


async def a_lost_link_ends_a_waiting_read(transport: Transport, peer: Transport) -> None:
    """A read that waits ends when the other side goes."""
    reading = asyncio.create_task(transport.read())
    await asyncio.sleep(0)
    await peer.close()
    await raises(LinkLost, reading)


RULES = (
    it_says_what_it_is,
    every_byte_value_passes_both_ways,
    bytes_keep_their_order,
    an_empty_write_sends_nothing,
    a_cancelled_read_loses_nothing,
    reading_and_writing_do_not_wait_for_each_other,
    much_passes_both_ways_at_once,
    closing_twice_is_closing_once,
    a_closed_transport_stays_closed,
    closing_ends_a_waiting_read,
    closing_is_bounded_while_nobody_reads,
    unread_bytes_come_before_the_loss,
    a_lost_link_ends_a_waiting_read,
)
"""Every rule, in the order in which they are checked; each gets a new pair."""


async def receive(transport: Transport, count: int) -> bytes:
    """Read until *count* bytes are there; fail on more."""
    received = bytearray()
    while len(received) < count:
        part = await transport.read()
        assert part, "read returned no bytes"
        received += part
    assert len(received) == count, f"{len(received) - count} bytes too many"
    return bytes(received)


async def raises(error: type[Exception], awaitable: Awaitable[object]) -> None:
    """Fail unless *awaitable* raises exactly *error*."""
    try:
        await awaitable
    except error as caught:
        if type(caught) is not error:
            raise AssertionError(f"{type(caught).__name__} instead of {error.__name__}") from caught
    else:
        raise AssertionError(f"no {error.__name__}")
