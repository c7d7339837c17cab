import asyncio
import errno
import socket

import pytest

from elib.base.errors import LinkBusy, LinkDenied, LinkError, LinkNotFound, Unsupported
from elib.link.transport import open_transport, parse_url, rfcomm

URL = "rfcomm://10:00:E8:AA:BB:CC?channel=2"


async def test_a_python_without_bluetooth_gets_the_recipe_that_works(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(socket, "AF_BLUETOOTH", raising=False)
    with pytest.raises(Unsupported) as caught:
        await open_transport(URL)
    assert "this Python was built without Bluetooth sockets" in caught.value.message
    assert "sudo rfcomm bind 0 10:00:E8:AA:BB:CC 2, then use serial:///dev/rfcomm0" in caught.value.hint


async def test_a_system_without_bluetooth_gets_the_same_recipe(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol")

    monkeypatch.setattr(socket, "AF_BLUETOOTH", 31, raising=False)
    monkeypatch.setattr(socket, "BTPROTO_RFCOMM", 3, raising=False)
    monkeypatch.setattr(rfcomm.socket, "socket", refuse)
    with pytest.raises(Unsupported, match=r"no Bluetooth sockets \(Address family"):
        await rfcomm.open_rfcomm(parse_url(URL))


@pytest.mark.parametrize(
    ("key", "refused", "tried", "is_open"),
    [
        ("", [], [2], True),
        ("", [2], [2, 1], True),
        ("", [2, 1], [2, 1], False),
        ("?channel=1", [], [1], True),
        ("?channel=1", [1], [1], False),
    ],
)
async def test_a_robot_is_asked_for_its_channel_unless_the_url_names_one(
    monkeypatch: pytest.MonkeyPatch, key: str, refused: list[int], tried: list[int], is_open: bool
) -> None:
    seen: list[int] = []

    async def connect(radio: socket.socket, address: tuple[str, int]) -> None:
        seen.append(address[1])
        if address[1] in refused:
            raise ConnectionRefusedError(errno.ECONNREFUSED, "Connection refused")

    pairs = [socket.socketpair() for _ in tried]
    radios = iter(pairs)
    monkeypatch.setattr(socket, "AF_BLUETOOTH", 31, raising=False)
    monkeypatch.setattr(socket, "BTPROTO_RFCOMM", 3, raising=False)
    monkeypatch.setattr(rfcomm.socket, "socket", lambda *_: next(radios)[0])
    monkeypatch.setattr(asyncio.get_running_loop(), "sock_connect", connect)
    opening = rfcomm.open_rfcomm(parse_url("rfcomm://10:00:E8:AA:BB:CC" + key))
    if is_open:
        await (await opening).close()
    else:
        with pytest.raises(LinkNotFound, match="no serial service"):
            await opening
    for _, end in pairs:
        end.close()
    assert seen == tried


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (TimeoutError(), LinkNotFound),
        (OSError(errno.EHOSTDOWN, "Host is down"), LinkNotFound),
        (OSError(errno.EBUSY, "Device or resource busy"), LinkBusy),
        (PermissionError(errno.EACCES, "Permission denied"), LinkDenied),
        (OSError(errno.EIO, "Input/output error"), LinkError),
    ],
)
def test_a_refused_connection_is_explained(error: OSError, kind: type[LinkError]) -> None:
    refusal = rfcomm.refusal(parse_url(URL), error)
    assert type(refusal) is kind
    assert URL in refusal.message
