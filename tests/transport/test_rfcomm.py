import errno
import socket

import pytest

from elib.errors import LinkBusy, LinkDenied, LinkError, LinkNotFound, Unsupported
from elib.transport import open_transport, parse_url, rfcomm

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
