"""What a test sees of served robots: the bytes that reached their ports, and the clients that left."""

from dataclasses import dataclass, field

import pytest

from elib.link.transport.base import BufferedTransport
from elib.link.transport.pty import PtyTransport
from elib.simulator.emulator import server, wifi_server


@dataclass
class Seen:
    """What happened at the ports of served robots so far.

    Attributes:
        data: Bytes that clients wrote and a port has taken, whether or not a robot hears them.
        gone: How many clients were noticed to have left.
    """

    data: bytearray = field(default_factory=bytearray)
    gone: int = 0


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Seen:
    found = Seen()
    feed, hang_up, leave = BufferedTransport.feed, PtyTransport._hang_up, server._Ports.leave

    def see_data(self: BufferedTransport, data: bytes) -> None:
        feed(self, data)
        if isinstance(self, PtyTransport | server._TcpClient | wifi_server._Client):
            found.data += data

    def see_hang_up(self: PtyTransport) -> None:
        hang_up(self)
        found.gone += 1

    def see_leave(self: server._Ports, client: server._TcpClient) -> None:
        leave(self, client)
        found.gone += 1

    monkeypatch.setattr(BufferedTransport, "feed", see_data)
    monkeypatch.setattr(PtyTransport, "_hang_up", see_hang_up)
    monkeypatch.setattr(server._Ports, "leave", see_leave)
    return found
