"""The port of the panel."""

from __future__ import annotations

import socket
from unittest import mock

import pytest

from elib.base.errors import ArgumentError, LinkBusy, LinkError
from elib.panel.server import listening
from elib.panel.server.listening import Address, listen
from elib.simulator.emulator.loopback import bind


def address(host: str, *, is_shared: bool = False) -> Address:
    sock = mock.Mock()
    sock.getsockname.return_value = (host, 8700)
    return Address(sock, host, is_shared)


def test_it_is_for_this_computer_alone_unless_told_otherwise() -> None:
    alone, open_to_all = listen(port=0), listen("0.0.0.0", 0)
    with alone.socket, open_to_all.socket:
        assert alone.url == f"http://127.0.0.1:{alone.port}/"
        assert (alone.is_shared, open_to_all.is_shared) == (False, True)
        assert open_to_all.url.endswith(f":{open_to_all.port}/")
        assert "0.0.0.0" not in open_to_all.url


def test_every_name_of_the_loopback_is_this_computer_alone() -> None:
    for host in ("localhost", "127.0.0.1", "127.0.0.2"):
        found = listen(host, 0)
        with found.socket:
            assert not found.is_shared, host


def test_an_address_of_version_6_stands_in_brackets() -> None:
    assert address("::1").url == "http://[::1]:8700/"


def test_the_first_free_port_is_taken_unless_one_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        monkeypatch.setattr(listening, "PORT", port)
        found = listen()
        with found.socket:
            assert port < found.port < port + listening.PORTS
        with pytest.raises(LinkBusy, match=rf"port {port} of 127.0.0.1 is taken"):
            listen(port=port)
        monkeypatch.setattr(listening, "PORTS", 1)
        with pytest.raises(LinkBusy, match="are taken"):
            listen()


def test_nobody_else_can_have_the_port_before_the_page_is_served() -> None:
    found = listen(port=0)
    with found.socket, pytest.raises(LinkBusy, match="is taken") as refused:
        listen(port=found.port, option="--view")
    assert refused.value.hint == "choose another with --view, or 0 for a free one"


def test_two_programs_that_start_at_once_do_not_get_the_same_port() -> None:
    with bind("0", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(LinkBusy, match="is taken"):
            bind(str(port), 0)
        with bind("", port) as second:
            assert second.getsockname()[1] > port


def test_a_port_that_cannot_be_is_refused() -> None:
    for port in (-1, 65536):
        with pytest.raises(ArgumentError):
            raise AssertionError(listen(port=port))


def test_an_address_that_this_computer_has_not_is_refused() -> None:
    for host in ("192.0.2.77", "no.such.host.invalid", "a" * 300, "127.0.0.1/x"):
        with pytest.raises(LinkError):
            raise AssertionError(listen(host, 0))
