"""The server of ``elib simulate``: one world, its robots on ptys, TCP ports and Wi-Fi ports."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import os
import socket
import sys
import tempfile
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from elib.base.errors import ArgumentError, LinkBusy, LinkDenied, LinkError, Unsupported
from elib.base.timebase import require_real_time, require_speed
from elib.link.transport.stream import StreamTransport
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.link import Link
from elib.simulator.emulator.loopback import LOOPBACK, named, refusal, split
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.emulator.tcp_client import is_request, notice_absence
from elib.simulator.emulator.wifi_link import WifiLink
from elib.simulator.emulator.wifi_server import WifiPort

if TYPE_CHECKING:
    from elib.link.transport.pty import PtyTransport

MAX_FLOOD = 10.0
"""s that a client may send more than the robot's line takes: 115 kB of commands."""

STUCK = (
    "a client left before it sent a valid command; like a real robot, this one accepts no other until it is switched "
    "off and on"
)
"""What happened to a robot with Wi-Fi (wire-protocol.md, 4.1)."""

Traffic = Callable[[str, float, Literal["to robot", "to host"], bytes], None]
"""Called with the robot's name, time since the start (s), direction and bytes."""


@dataclass(frozen=True, slots=True)
class Served:
    """A robot that can be driven now."""

    name: str  # `epuck-1`, `epuck-2`, ..
    url: str  # what opens it, such as `serial:///dev/pts/5`, `tcp://127.0.0.1:40001` or `wifi://127.0.0.1:40002`


@contextlib.asynccontextmanager
async def serve(
    settings: SimulationSettings,
    *,
    pty: bool | None = None,
    link: str | None = None,
    tcp: str | None = None,
    wifi: str | None = None,
    traffic: Traffic | None = None,
    control: Callable[[Control], None] | None = None,
    warn: Callable[[str], None] | None = None,
) -> AsyncIterator[list[Served]]:
    """Serve every robot of a simulation until the block is left.

    A client may leave and another come: the robot keeps its state, unread bytes are dropped. One client at a
    time: a second one on TCP is turned away; while a TCP client is there, the robot does not hear its pty.

    While a fault script or the control server keeps a link down, its pty vanishes with its name, and TCP clients are
    turned away. A pty that comes back has another number, so each pty then has a symbolic link, in a folder of its own
    if *link* gives none.

    Args:
        settings: The simulation; its speed must be that of the running loop.
        pty: Offer a pty for each robot; if None, where *link* is given or *tcp* is not.
        link: Path of a symbolic link to the first robot's pty; the next robots' count up: ``rfcomm0``,
            ``rfcomm1``, or ``epuck``, ``epuck-2``.
        tcp: ``HOST:PORT`` or ``PORT`` of the first robot, the next ones' count up; port 0 takes free ones.
            The host is 127.0.0.1 unless given: every program that reaches the port can drive the robot.
        wifi: ``HOST:PORT`` or ``PORT`` of the first robot with the firmware ``epuck2-wifi``, the next ones' count up;
            port 0 takes free ones, as does None. The host is 127.0.0.1 unless given.
        traffic: Called with everything that arrives at a robot or a client.
        control: Called with the simulation's ``Control`` before the robots can be opened.
        warn: Called with a sentence when a robot can no longer be reached because of what a client did.

    Yields:
        What can be opened, a robot's pty before its TCP port.

    Raises:
        ArgumentError: *tcp*, *wifi* or a setting is wrong, or no robot has the kind of port that is asked for.
        LinkBusy: A port or the name of a symbolic link is taken.
        LinkNotFound: There is no such world.
        SimulationError: The loop runs at another speed, or simulates time.
        Unsupported: This system has no ptys.
    """
    require_real_time("a server")
    require_speed(settings.speed)
    async with contextlib.AsyncExitStack() as stack:
        simulation = Simulation(settings)
        stack.callback(simulation.close)
        robots = simulation.robots.values()
        on_wifi = sum(isinstance(robot.link, WifiLink) for robot in robots)
        if wifi is not None and not on_wifi:
            raise ArgumentError("no robot of this simulation has Wi-Fi", hint="add --firmware epuck2-wifi")
        if on_wifi == len(robots) and (pty or link is not None or tcp is not None):
            raise ArgumentError("a robot with the firmware epuck2-wifi has no serial line", hint="use --wifi alone")
        tcp_place, wifi_place = _Place(tcp, 4000, len(robots)), _Place(wifi, 1000, on_wifi)
        wants_pty = pty if pty is not None else link is not None or tcp is None
        may_cut = control is not None or any(robot.player is not None and robot.player.cuts for robot in robots)
        if wants_pty and link is None and may_cut:
            link = f"{stack.enter_context(tempfile.TemporaryDirectory(prefix='elib-'))}/epuck-1"
        if control is not None:
            control(Control(simulation))
        served: list[Served] = []
        numbers = itertools.count()
        for index, (name, robot) in enumerate(zip(simulation.names, robots, strict=True)):
            if traffic is not None:
                robot.link.trace = partial(traffic, name)
            if isinstance(robot.link, WifiLink):
                stuck = None if warn is None else partial(warn, f"{name}: {STUCK}")
                urls = [_offer_wifi(stack, robot.link, wifi_place.address(next(numbers)), stuck)]
            else:
                ports = _Ports(robot.link)
                urls = [_offer_pty(stack, ports, link and _counted(link, index))] if wants_pty else []
                if tcp is not None:
                    urls.append(await _offer_tcp(stack, ports, *tcp_place.address(index)))
            served += [Served(name, url) for url in urls]
        yield served


class _Place:
    """The addresses of *count* robots: ``HOST:PORT`` or ``PORT`` of the first one, from which the others count up."""

    def __init__(self, place: str | None, low: int, count: int) -> None:
        self._host, self._port = (LOOPBACK, 0) if place is None else split(place, low)
        if self._port and self._port + count - 1 > 65535:
            raise ArgumentError(
                f"{count} robots from port {self._port} on pass port 65535", hint="take a lower port, or 0"
            )

    def address(self, index: int) -> tuple[str, int]:
        """Return host and port of a robot; port 0 takes a free one."""
        return self._host, self._port and self._port + index


class _Ports:
    """The ports of one robot: at most one client on TCP has it, else its pty; none while its link is down."""

    def __init__(self, link: Link) -> None:
        self.client: _TcpClient | None = None
        self.pty: _PtyPort | None = None
        self._link = link
        link.on_down = self._close
        link.on_up = self._open

    def offer(self, pty: _PtyPort) -> None:
        self.pty = pty
        pty.open(self._link)

    def admit(self, client: _TcpClient) -> bool:
        if self.client is not None or self._link.is_down:
            return False
        self.client = client
        self._link.attach(client)
        if self.pty is not None:
            self.pty.ignore()
        return True

    def leave(self, client: _TcpClient) -> None:
        if self.client is client:
            self.client = None
            self._link.detach()
            if self.pty is not None:
                self.pty.listen(self._link)

    def _close(self) -> None:
        if self.pty is not None:
            self.pty.close()
        if self.client is not None:
            self.client.abort()

    def _open(self) -> None:
        if self.pty is not None:
            self.pty.open(self._link)


class _TcpClient(StreamTransport):
    """A client on TCP. It is turned away if another one has the robot, or if it brings a web page's request."""

    def __init__(self, ports: _Ports) -> None:
        super().__init__("tcp://client", origin="simulator")
        self._ports = ports
        self._loop = asyncio.get_running_loop()
        self._held: bytes | None = b""
        self._flooding_since: float | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        connection = transport.get_extra_info("socket")
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        notice_absence(connection)
        if not self._ports.admit(self):
            self.abort()

    def data_received(self, data: bytes) -> None:
        if self._held is not None:
            self._held += data
            verdict = is_request(self._held)
            if verdict:
                self.abort()
            if verdict is not False:
                return
            data, self._held = self._held, None
        super().data_received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        try:
            super().connection_lost(exc)
        finally:
            self._ports.leave(self)

    def _pause(self) -> None:
        """Let the client wait, and disconnect one that keeps the line full for long: it may have left long ago."""
        super()._pause()
        now = self._loop.time()
        if self._flooding_since is None:
            self._flooding_since = now
        elif now - self._flooding_since > MAX_FLOOD:
            self.abort()

    def _resume(self) -> None:
        super()._resume()
        if not self.unread:
            self._flooding_since = None


class _PtyPort:
    """A robot's pty, which may vanish and come back; its name is that of a symbolic link, if it has one."""

    def __init__(self, link: str | None) -> None:
        self.url = ""  # what opens it
        self._link = None if link is None else Path(link)
        self._pty: PtyTransport | None = None
        self._is_ignored = False

    def open(self, robot: Link) -> None:
        from elib.link.transport.pty import PtyTransport

        if self._link is not None:
            _clear_stale(self._link)  # before our own pty may get the number it leads to
        try:
            pty = PtyTransport()
        except OSError as error:
            raise LinkError(f"this system gives no pty: {error.strerror}") from error
        if self._link is not None:
            try:
                _make_link(self._link, pty.path)
            except LinkError:
                pty.abort()
                raise
        self._pty = pty
        self.url = pty.url if self._link is None else f"serial://{self._link.absolute()}"
        pty.on_hang_up = lambda: None if self._is_ignored else robot.hang_up()
        robot.attach(pty)

    def listen(self, robot: Link) -> None:
        self._is_ignored = False
        if self._pty is not None:
            robot.attach(self._pty)

    def ignore(self) -> None:
        """Drop what the pty's client sends: another client has the robot."""
        self._is_ignored = True
        if self._pty is not None:
            self._pty.listen(lambda data: None)

    def close(self) -> None:
        pty, self._pty = self._pty, None
        if pty is None:
            return
        if self._link is not None:  # before the client notices, which might open the name again
            _remove_link(self._link, pty.path)
        pty.abort()


def _offer_wifi(
    stack: contextlib.AsyncExitStack, link: WifiLink, address: tuple[str, int], on_stuck: Callable[[], None] | None
) -> str:
    """Listen for the robot's client and return the URL."""
    link.robot.on_stuck = on_stuck
    port = WifiPort(link, *address)
    stack.callback(port.close)
    return port.url


def _offer_pty(stack: contextlib.AsyncExitStack, ports: _Ports, link: str | None) -> str:
    """Open a pty for the robot, link to it, and return its URL."""
    if sys.platform == "win32":
        raise Unsupported("Windows has no ptys", hint="serve the robot over TCP: elib simulate --tcp 4000")
    pty = _PtyPort(link)
    stack.callback(pty.close)
    ports.offer(pty)
    return pty.url


async def _offer_tcp(stack: contextlib.AsyncExitStack, ports: _Ports, host: str, port: int) -> str:
    """Listen for the robot's clients and return the URL."""
    loop = asyncio.get_running_loop()
    try:
        server = await loop.create_server(lambda: _TcpClient(ports), host, port)
    except socket.gaierror as error:
        raise ArgumentError(f"there is no host {host!r} ({error.strerror})", hint=f"try {LOOPBACK}") from error
    except OSError as error:
        raise refusal(error, host, port) from error

    def shut() -> None:
        server.close()
        if ports.client is not None:
            ports.client.abort()

    stack.callback(shut)
    return f"tcp://{named(server.sockets[0])}"


def _counted(link: str, index: int) -> str:
    """Count the name of a link up: ``rfcomm0`` gives ``rfcomm1``, ``epuck`` gives ``epuck-2``."""
    if index == 0:
        return link
    stem = link.rstrip("0123456789")
    number = link[len(stem) :]
    return f"{stem}{int(number) + index}" if number else f"{link}-{index + 1}"


def _make_link(link: Path, port: str) -> None:
    """Link to *port*."""
    try:
        link.symlink_to(port)
    except FileExistsError as error:
        if not link.is_symlink():
            raise LinkBusy(f"{link} exists already and is not a link", hint="choose another name") from error
        raise LinkBusy(
            f"{link} exists already and leads to {os.readlink(link)}",
            hint=f"if no other elib simulate runs, remove it: rm {link}",
        ) from error
    except OSError as error:
        raise LinkDenied(f"cannot make the link {link}: {error.strerror}") from error


def _clear_stale(link: Path) -> None:
    """Remove a link that leads nowhere: one that a crash left behind."""
    with contextlib.suppress(OSError):
        if link.is_symlink() and not link.exists():
            link.unlink()


def _remove_link(link: Path, port: str) -> None:
    """Remove our link, unless another program has put another one in its place."""
    with contextlib.suppress(OSError):
        if os.readlink(link) == port:
            link.unlink()
