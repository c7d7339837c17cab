"""Robots behind a URL: opening one, asking it, and running it under the fault script of a test."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

import elib
from elib.link.transport import Transport, open_transport
from elib.simulator.emulator.sim_transport import SimTransport
from shared import PATIENCE

CUT = 'kind = "cut"\nfrom = 5\nevery = 100\nfor = 10\n'
"""The link is cut from 5 s to 15 s, and every 100 s again."""


async def open_url(url: str) -> SimTransport:
    transport = await open_transport(url)
    assert isinstance(transport, SimTransport)
    return transport


@asynccontextmanager
async def opened(url: str) -> AsyncIterator[SimTransport]:
    transport = await open_url(url)
    try:
        yield transport
    finally:
        await transport.close()


async def ask(transport: Transport, line: bytes, lines: int = 1) -> bytes:
    """Send *line* and return the answer, of so many lines."""
    await transport.write(line)
    return await receive(transport, lines)


async def receive(transport: Transport, lines: int = 1) -> bytes:
    """Return so many lines."""
    answer = b""
    pace = getattr(asyncio.get_running_loop(), "factor", 1.0)  # the bound is one of the wall clock
    async with asyncio.timeout(PATIENCE * pace):
        while answer.count(b"\r\n") < lines:
            answer += await transport.read()
    return answer


async def until_lost(transport: SimTransport) -> elib.LinkLost:
    with pytest.raises(elib.LinkLost) as caught:
        while True:
            await transport.read()
    return caught.value
