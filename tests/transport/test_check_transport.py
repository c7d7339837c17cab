import asyncio
from collections.abc import Awaitable, Callable

import pytest
from pairs import Pair, in_memory_pair, serial_pair, tcp_pair

from elib.base.timebase import SimulatedLoop
from elib.link.transport import stream
from elib.link.transport.memory import MemoryTransport, memory_pair
from elib.testing import transports
from elib.testing.transports import check_transport
from shared import PATIENCE


@pytest.mark.parametrize("factory", [in_memory_pair, tcp_pair, serial_pair])
@pytest.mark.parametrize("rule", transports.RULES, ids=lambda rule: rule.__name__)
async def test_every_rule_is_kept(
    factory: Callable[[], Awaitable[Pair]], rule, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream, "CLOSE_GRACE", 0.02)
    monkeypatch.setattr(transports, "TIMEOUT", PATIENCE)
    monkeypatch.setattr(transports, "CLOSE_TIMEOUT", PATIENCE)
    monkeypatch.setattr(transports, "RULES", (rule,))
    await check_transport(factory)
    others = asyncio.all_tasks() - {asyncio.current_task()}
    assert not others, "a closed transport leaves no task behind"


def test_memory_keeps_every_rule_in_simulated_time() -> None:
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner:
        runner.run(check_transport(in_memory_pair))


def test_a_transport_that_breaks_a_rule_is_named_with_the_rule() -> None:
    class Silent(MemoryTransport):
        async def read(self) -> bytes:
            return (await super().read()).replace(b"\0", b"")

    async def factory() -> Pair:
        transport, (peer, _) = Silent("silent://"), memory_pair()
        transport.join(peer)
        return transport, peer

    with (
        asyncio.Runner(loop_factory=SimulatedLoop) as runner,
        pytest.raises(AssertionError, match="every byte value passes both ways"),
    ):
        runner.run(check_transport(factory))
