import asyncio
import contextlib
import fcntl
import os
import sys
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest
import serialx

from elib.base.errors import LinkBusy, LinkDenied, LinkError, LinkLost, LinkNotFound, SimulationError
from elib.base.timebase import SimulatedLoop
from elib.link.transport import Transport, open_transport, parse_url, serial
from elib.link.transport.ports import holders, list_ports
from elib.link.transport.pty import PtyTransport
from elib.link.transport.serial import open_serial
from shared import held, until


@pytest.fixture
async def port() -> Iterator[PtyTransport]:
    pty = PtyTransport()
    yield pty
    await pty.close()


async def test_any_pty_can_be_opened_by_its_bare_name(port: PtyTransport) -> None:
    transport = await open_transport(port.path)
    await transport.write(b"V\r")
    assert await port.read() == b"V\r"
    assert transport.url == f"serial://{port.path}"
    assert transport.origin == "robot"
    await transport.close()


async def test_what_came_before_opening_is_dropped(port: PtyTransport) -> None:
    client = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    await port.write(b"stale")
    await until(lambda: int.from_bytes(fcntl.ioctl(client, termios.FIONREAD, bytes(4)), sys.byteorder) == len(b"stale"))
    transport = await open_serial(parse_url(port.path))
    os.close(client)
    await port.write(b"fresh")
    assert await transport.read() == b"fresh"
    await transport.close()


async def test_a_missing_port_is_not_found_and_the_ports_there_are_are_listed(monkeypatch) -> None:
    monkeypatch.setattr(serial, "list_ports", lambda: ["/dev/ttyS0", "/dev/ttyUSB1"])
    with pytest.raises(LinkNotFound) as caught:
        await open_serial(parse_url("/dev/ttyUSB7"))
    assert "this computer has /dev/ttyS0, /dev/ttyUSB1" in caught.value.message


async def test_a_missing_bluetooth_port_comes_with_the_command_that_makes_it() -> None:
    with pytest.raises(LinkNotFound, match=r"hint: .*sudo rfcomm bind 0 .* 1 \(an e-puck2's channel is 2\)"):
        await open_serial(parse_url("/dev/rfcomm29"))


async def test_a_port_held_by_another_program_is_busy_and_names_it(port: PtyTransport) -> None:
    with (
        held(port.path, locks=True) as holder,
        pytest.raises(LinkBusy, match=rf"python.* \(process {holder}\) holds it"),
    ):
        await open_serial(parse_url(port.path))


async def test_a_port_held_by_this_program_says_so(port: PtyTransport) -> None:
    transport = await open_serial(parse_url(port.path))
    with pytest.raises(LinkBusy, match=rf"this program \(process {os.getpid()}\) holds it") as caught:
        await open_serial(parse_url(port.path))
    assert caught.value.hint.startswith("close the robot object that this program made before")
    await transport.close()


async def test_a_closed_port_can_be_opened_again(port: PtyTransport) -> None:
    for _ in range(3):
        transport = await open_serial(parse_url(port.path))
        await transport.close()


@pytest.mark.parametrize("kind", ["file", "folder", "null"])
async def test_a_file_that_is_not_a_serial_port_is_called_so(kind: str, tmp_path: Path) -> None:
    path = {"file": tmp_path / "notes.txt", "folder": tmp_path, "null": Path("/dev/null")}[kind]
    if kind == "file":
        path.write_text("")
    with pytest.raises(LinkError, match="is not a serial port") as caught:
        await open_serial(parse_url(str(path)))
    assert type(caught.value) is LinkError


@pytest.mark.parametrize(
    ("number", "error", "message"),
    [
        (13, LinkDenied, "usermod -aG dialout" if sys.platform == "linux" else "may not open"),
        (16, LinkBusy, "ModemManager"),
        (112, LinkNotFound, "no robot answers behind this port"),
        (5, LinkError, "Input/output error"),
    ],
)
async def test_what_the_system_refuses_is_explained(
    number: int, error: type[LinkError], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def refuse(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(serialx, "create_serial_connection", refuse)
    with pytest.raises(error) as caught:
        await open_serial(parse_url("/dev/ttyFAKE0"))
    assert type(caught.value) is error
    assert message in str(caught.value)


async def test_a_port_that_never_opens_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    never = asyncio.Event()

    async def hang(*_: object, **__: object) -> None:
        await never.wait()

    monkeypatch.setattr(serialx, "create_serial_connection", hang)
    monkeypatch.setattr(serial, "OPEN_TIMEOUT", 0.01)
    with pytest.raises(LinkNotFound, match=r"did not open within 0\.01 s"):
        await open_serial(parse_url("/dev/ttyFAKE0"))


async def test_a_cancelled_opening_leaves_the_port_free(port: PtyTransport, monkeypatch: pytest.MonkeyPatch) -> None:
    has_begun = asyncio.Event()
    create = serialx.create_serial_connection

    async def begin(*args: object, **options: object) -> object:
        has_begun.set()
        return await create(*args, **options)

    monkeypatch.setattr(serialx, "create_serial_connection", begin)
    opening = asyncio.create_task(open_serial(parse_url(port.path)))
    await has_begun.wait()
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening

    async def open_again() -> Transport | None:
        with contextlib.suppress(LinkBusy):
            return await open_serial(parse_url(port.path))
        return None

    await (await until(open_again)).close()


async def test_a_hang_up_ends_a_waiting_read_and_later_writes(port: PtyTransport) -> None:
    transport = await open_serial(parse_url(port.path))
    reading = asyncio.create_task(transport.read())
    await asyncio.sleep(0)
    await port.close()
    with pytest.raises(LinkLost, match="hint: is the robot switched on"):
        await reading
    with pytest.raises(LinkLost):
        await transport.write(b"D,0,0\r")
    await transport.close()


def test_a_port_is_refused_in_simulated_time() -> None:
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner, pytest.raises(SimulationError, match="real time"):
        runner.run(open_serial(parse_url("/dev/rfcomm0")))


def test_ports_are_listed_without_opening_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "open", None)
    assert list(list_ports()) == sorted(list_ports())


def test_a_system_that_lists_no_ports_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise OSError

    monkeypatch.setattr(serialx, "list_serial_ports", fail)
    assert [port for port in list_ports() if "rfcomm" not in port] == []


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells")
def test_without_a_lock_the_program_that_has_the_file_open_holds_it(tmp_path: Path) -> None:
    with open(tmp_path / "port", "wb") as file:
        assert holders(file.name) == [f"this program (process {os.getpid()})"]
        fcntl.flock(file, fcntl.LOCK_EX)
        assert holders(file.name) == [f"this program (process {os.getpid()})"]
    assert holders(file.name) == []
    assert holders(str(tmp_path / "nothing")) == []
