"""Noise on the line that looks like an answer is refused, and never breaks the session."""

from __future__ import annotations

import pytest

from elib.base.errors import RemoteProtocolError
from elib.link.protocol.commands import SPECS
from elib.link.protocol.connection import HostConnection, Refusal
from elib.link.protocol.context import Context
from elib.link.protocol.profiles import PROFILES


@pytest.mark.parametrize("firmware", ["asercom-1.2.2", "epuck2"])
def test_a_battery_of_four_hundred_digits_is_not_an_answer(firmware: str) -> None:
    context = Context(PROFILES[firmware])
    connection = HostConnection(context)
    connection.send(SPECS["battery"].request(context))
    try:
        connection.receive(b"b," + b"9" * 400 + b" (67%)\r\n", 1.0)
        events = []
        while (event := connection.next_event()) is not None:
            events.append(event)
    except RemoteProtocolError:
        return
    assert not events or isinstance(events[0], Refusal)
