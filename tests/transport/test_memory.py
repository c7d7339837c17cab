import asyncio

import pytest

from elib.base.errors import LinkClosed, LinkError, LinkLost
from elib.link.transport.base import BUFFER_LIMIT, SLICE
from elib.link.transport.memory import memory_pair
from elib.testing import simulated
from shared import now


@simulated
async def test_a_writer_waits_for_a_slow_reader_as_long_as_it_reads_at_all() -> None:
    left, right = memory_pair()
    writing = asyncio.create_task(left.write(bytes(3 * BUFFER_LIMIT)))
    received = 0
    while received < 3 * BUFFER_LIMIT:
        await asyncio.sleep(4)
        received += len(await right.read())
    await writing
    assert now() == 12


@simulated
async def test_a_peer_that_reads_nothing_for_five_seconds_is_lost() -> None:
    left, _ = memory_pair("memory://robot")
    with pytest.raises(LinkLost, match="memory://robot: the other side took no byte for 5 s\nhint: is the robot"):
        await left.write(bytes(BUFFER_LIMIT + 1))
    assert now() == 5
    with pytest.raises(LinkLost):
        await left.read()


@simulated
async def test_what_does_not_fit_is_dropped_whole_when_nobody_may_wait() -> None:
    left, right = memory_pair()
    assert left.send_nowait(bytes(BUFFER_LIMIT - 1))
    assert not left.send_nowait(b"ab")
    assert left.send_nowait(b"c")
    assert len(await right.read()) == BUFFER_LIMIT
    await right.close()
    assert not left.send_nowait(b"d")


@simulated
async def test_a_listener_gets_bytes_at_once_and_in_small_slices() -> None:
    left, right = memory_pair()
    heard: list[bytes] = []
    await left.write(b"early ")
    right.listen(heard.append)
    await left.write(bytes(SLICE + 1))
    assert [len(data) for data in heard] == [6, SLICE, 1]
    right.listen(None)
    await left.write(b"late")
    assert await right.read() == b"late"


@simulated
async def test_a_listener_hears_once_that_the_other_side_is_gone() -> None:
    left, right = memory_pair()
    losses: list[float] = []
    right.listen(lambda _: None, lambda: losses.append(now()))
    await asyncio.sleep(2)
    await left.close()
    await left.close()
    assert losses == [2]
    right.listen(lambda _: None, lambda: losses.append(now()))
    assert losses == [2, 2], "and at once if it comes late"


@simulated
async def test_one_task_reads_and_one_writes() -> None:
    left, right = memory_pair()
    reading = asyncio.create_task(left.read())
    writing = asyncio.create_task(left.write(bytes(BUFFER_LIMIT + 1)))
    await asyncio.sleep(0)
    with pytest.raises(LinkError, match="two tasks read"):
        await left.read()
    with pytest.raises(LinkError, match="two tasks write"):
        await left.write(b"x")
    await right.close()
    for task in (reading, writing):
        with pytest.raises(LinkLost):
            await task


@simulated
async def test_a_waiting_writer_hears_that_its_own_side_was_closed() -> None:
    left, _ = memory_pair()
    writing = asyncio.create_task(left.write(bytes(BUFFER_LIMIT + 1)))
    await asyncio.sleep(1)
    await left.close()
    with pytest.raises(LinkClosed, match="closed on this side\nhint: open it again"):
        await writing
    assert now() == 1
