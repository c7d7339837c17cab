"""Finding robots: what is listed, what is asked, and what is left alone."""

from __future__ import annotations

import asyncio
import ipaddress
import json
import os
import socket
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError, SimulationError
from elib.base.timebase import ScaledLoop
from elib.link.transport import Transport, open_transport
from elib.simulator.emulator import registry
from elib.simulator.emulator.registry import Registered, registered, running
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from elib.testing import simulated
from elib.tools import discovery
from elib.tools.discovery import Found, addresses_of, candidates, find, is_likely, survey
from shared import PATIENCE, held

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs ptys and POSIX processes")

Bluetoothctl = Callable[[str], None]


@pytest.fixture(autouse=True)
def quiet_computer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A computer without serial ports, paired robots or simulations; return its runtime folder."""
    place = tmp_path / "run"
    place.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(place))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setattr(discovery, "list_ports", dict)
    return place


@pytest.fixture
def bluetoothctl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bluetoothctl:
    """Return a function that puts a program of that name on the path."""
    monkeypatch.setattr(sys, "platform", "linux")

    def write(script: str) -> None:
        program = tmp_path / "bin" / "bluetoothctl"
        program.parent.mkdir()
        program.write_text(f"#!/bin/sh\n{script}\n")
        program.chmod(0o755)

    return write


def has_ports(monkeypatch: pytest.MonkeyPatch, **about: str) -> None:
    """Let the computer have the ports /dev/NAME with these descriptions."""
    descriptions = {f"/dev/{name}": text for name, text in about.items()}
    monkeypatch.setattr(discovery, "list_ports", lambda: dict(sorted(descriptions.items())))


SPEED = 20.0


def hurried(main: Callable[[], object]) -> None:
    """Run *main* faster than the clock."""
    with asyncio.Runner(loop_factory=lambda: ScaledLoop(SPEED)) as runner:
        runner.run(main())  # type: ignore[arg-type]  # every test's is a coroutine function


# -- which links there are --


@pytest.mark.parametrize(
    ("port", "description", "likely"),
    [
        ("/dev/rfcomm0", "", True),
        ("/dev/ttyACM1", "e-puck2 STM32F407", True),
        ("/dev/ttyUSB0", "CP2102", True),
        ("/dev/cu.e-puck_3021-COM1", "", True),
        ("/dev/cu.usbmodem301", "", True),
        ("COM7", "Standard Serial over Bluetooth link", True),
        ("/dev/ttyS0", "", False),
        ("/dev/cu.Bluetooth-Incoming-Port", "", False),
        ("/dev/ttyACM0", "e-puck2 GDB Server", False),
        ("/dev/ttyUSB2", "HUAWEI Mobile Modem", False),
        ("COM1", "Communications Port", False),
    ],
)
def test_only_ports_that_a_robot_may_be_behind_are_tried(port: str, description: str, likely: bool) -> None:
    assert is_likely(port, description) is likely


async def test_other_ports_are_named_and_left_alone_unless_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    has_ports(monkeypatch, ttyS0="", ttyUSB9="CP2102, Silicon Labs")
    listed = await candidates()
    assert [(each.url, each.kind, each.description) for each in listed.found] == [
        ("serial:///dev/ttyUSB9", "serial", "CP2102, Silicon Labs")
    ]
    assert listed.not_tried == ("/dev/ttyS0",)
    everything = await candidates(all_ports=True)
    assert [each.url for each in everything.found] == ["serial:///dev/ttyS0", "serial:///dev/ttyUSB9"]
    assert everything.not_tried == ()


async def test_paired_robots_are_listed_and_other_devices_are_not(
    bluetoothctl: Bluetoothctl,
) -> None:
    bluetoothctl(
        'test "$1" = devices && printf "Device 10:00:E8:AA:BB:CC e-puck_3021\\n'
        'Device 00:11:22:33:44:55 Headphones\\nDevice 08:3A:F2:00:00:01 e-puck2_04567\\n"'
    )
    listed = await candidates()
    assert [(each.url, each.kind, each.description) for each in listed.found] == [
        ("rfcomm://10:00:E8:AA:BB:CC", "bluetooth", "e-puck_3021, known to this computer"),
        ("rfcomm://08:3A:F2:00:00:01", "bluetooth", "e-puck2_04567, known to this computer"),
    ]
    assert listed.notes == ()


async def test_a_paired_robot_that_is_bound_to_a_port_is_listed_once(
    bluetoothctl: Bluetoothctl, monkeypatch: pytest.MonkeyPatch
) -> None:
    bluetoothctl('echo "Device 10:00:E8:AA:BB:CC e-puck_3021"')
    has_ports(monkeypatch, rfcomm0="")
    monkeypatch.setattr(discovery, "bound_address", lambda port: "10:00:E8:AA:BB:CC")
    assert (await candidates()).found == (
        Found("serial:///dev/rfcomm0", "bluetooth", "e-puck_3021, bound to 10:00:E8:AA:BB:CC"),
    )


async def test_without_bluetoothctl_the_search_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    assert "there is no bluetoothctl here" in (await candidates()).notes[0]


async def test_a_bluetooth_service_that_does_not_run_is_not_waited_for(
    bluetoothctl: Bluetoothctl, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(discovery, "BLUETOOTHCTL_TIMEOUT", 0.05)
    bluetoothctl("exec /bin/sleep 60")
    assert "bluetoothctl does not answer" in (await candidates()).notes[0]


# -- asking --


def test_running_simulations_are_found_by_other_programs_and_asked_without_stopping_them() -> None:
    settings = SimulationSettings(speed=SPEED, robots=2, firmware="epuck2")

    async def main() -> None:
        async with serve(settings) as robots:
            first = await open_transport(robots[0].url)
            await first.write(b"D,100,-100\r")
            await first.read()
            await first.close()
            with registered([(robot.name, robot.url) for robot in robots], settings):
                found = await find(timeout=SPEED * PATIENCE)
            assert [each.url for each in found] == [robot.url for robot in robots]
            assert {(each.kind, each.firmware, each.reason) for each in found} == {("simulation", "epuck2", "")}
            assert found[0].answer == "Version 2.0 January 2018 GCtronic"
            assert found[0].description == f"epuck-1 of elib simulate arena (process {os.getpid()})"
            again = await open_transport(robots[0].url)
            await again.write(b"E\r")
            answer = b""
            while not answer.endswith(b"\n"):
                answer += await again.read()
            assert answer == b"e,100,-100\r\n"
            await again.close()
            assert await find() == []

    hurried(main)


def test_a_robot_that_is_offered_twice_is_asked_once() -> None:
    settings = SimulationSettings(speed=SPEED)

    async def main() -> None:
        async with serve(settings, pty=True, tcp="0") as ways:
            with registered([(way.name, way.url) for way in ways], settings):
                (found,) = await find(timeout=SPEED * PATIENCE)
        assert found.url == ways[0].url
        assert found.description.endswith(f"; also {ways[1].url}")

    hurried(main)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells who holds a port")
async def test_a_port_of_another_program_is_not_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    from elib.link.transport.pty import PtyTransport

    async def never(_: object) -> None:
        raise AssertionError("a port of somebody else was opened")

    port = PtyTransport()
    monkeypatch.setattr(discovery, "list_ports", lambda: {port.path: ""})
    monkeypatch.setattr(discovery, "open_transport", never)
    with held(port.path) as process:
        (found,) = await find(all_ports=True)
    port.abort()
    assert found.firmware is None
    assert f"(process {process}) holds it, so it was left alone" in found.reason


async def test_a_silent_port_is_given_up_in_time_and_comes_last(monkeypatch: pytest.MonkeyPatch) -> None:
    from elib.link.transport.pty import PtyTransport

    port = PtyTransport()
    monkeypatch.setattr(discovery, "list_ports", lambda: {port.path: "", "/dev/ttyGONE0": ""})
    found = await find(timeout=3, all_ports=True)
    port.abort()
    assert [each.reason.partition(";")[0] for each in found] == [
        "opened, but nothing answered within 3 s",
        "there is no port /dev/ttyGONE0",
    ]


async def test_links_are_tried_at_the_same_time_and_robots_come_first(monkeypatch: pytest.MonkeyPatch) -> None:
    together = asyncio.Barrier(3)

    async def ask(candidate: Found, timeout: float) -> Found:
        async with asyncio.timeout(PATIENCE):
            await together.wait()
        is_robot = candidate.url.endswith("ttyUSB1")
        return Found(candidate.url, "serial", "", firmware="btcom-2.0" if is_robot else None)

    monkeypatch.setattr(discovery, "_ask", ask)
    has_ports(monkeypatch, ttyUSB0="", ttyUSB1="", ttyUSB2="")
    assert [each.url[-1] for each in (await survey()).found] == ["1", "0", "2"]


async def test_a_search_without_end_is_refused() -> None:
    with pytest.raises(ArgumentError, match="it must be a number from 0 to 3600 s"):
        await find(timeout=float("inf"))


@simulated
async def test_simulated_time_finds_nobody_and_says_why() -> None:
    with pytest.raises(SimulationError, match="looking for robots works in real time"):
        await find()


# -- the records of simulations --

HERE = SimulationSettings(world="square", firmware="btcom-2.0")


def records(place: Path) -> list[Path]:
    return sorted(place.glob("elib/*"))


def test_a_record_lasts_as_long_as_its_simulation(quiet_computer: Path) -> None:
    ways = [("epuck-1", "serial:///dev/pts/90"), ("epuck-1", "tcp://127.0.0.1:4000"), ("epuck-2", "tcp://127.0.0.1:1")]
    with registered(ways, HERE):
        assert running() == [
            Registered(os.getpid(), "epuck-1", (ways[0][1], ways[1][1]), "btcom-2.0", "square"),
            Registered(os.getpid(), "epuck-2", (ways[2][1],), "btcom-2.0", "square"),
        ]
        (record,) = records(quiet_computer)
        assert stat.S_IMODE(record.stat().st_mode) == 0o600
        assert stat.S_IMODE(record.parent.stat().st_mode) == 0o700
    assert records(quiet_computer) == []
    assert running() == []


def test_ten_robots_are_listed_in_the_order_people_count() -> None:
    with registered([(f"epuck-{number}", f"tcp://127.0.0.1:{number}") for number in range(1, 11)], HERE):
        assert [robot.name for robot in running()][8:] == ["epuck-9", "epuck-10"]


def test_two_simulations_of_one_process_do_not_mix() -> None:
    with registered([("epuck-1", "tcp://127.0.0.1:1")], HERE):
        with registered([("epuck-1", "tcp://127.0.0.1:2")], HERE):
            assert len(running()) == 2
        assert [robot.urls for robot in running()] == [("tcp://127.0.0.1:1",)]


def test_the_record_of_a_crashed_simulation_is_removed(quiet_computer: Path) -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait(PATIENCE)
    with registered([("epuck-1", "tcp://127.0.0.1:1")], HERE):
        (record,) = records(quiet_computer)
        stale = record.with_name("simulate-1-stale.json")
        written = json.loads(record.read_text())
        written[0]["process"] = gone.pid
        stale.write_text(json.dumps(written))
        assert len(running()) == 1
        assert records(quiet_computer) == [record]


@pytest.mark.parametrize(
    "text", ["", "{", "7", "[7]", '[{"process": 1}]', '[{"process": "1", "name": "x", "urls": []}]']
)
def test_a_record_that_makes_no_sense_is_ignored(text: str, quiet_computer: Path) -> None:
    with registered([("epuck-1", "tcp://127.0.0.1:1")], HERE):
        (record,) = records(quiet_computer)
        record.with_name("simulate-1-odd.json").write_text(text)
        assert len(running()) == 1


def test_a_folder_that_others_may_write_is_not_trusted(quiet_computer: Path) -> None:
    with registered([("epuck-1", "tcp://127.0.0.1:1")], HERE):
        (quiet_computer / "elib").chmod(0o777)
        assert running() == []


def test_a_link_in_the_folders_place_is_not_followed(quiet_computer: Path, tmp_path: Path) -> None:
    (quiet_computer / "elib").symlink_to(tmp_path)
    with registered([("epuck-1", "tcp://127.0.0.1:1")], HERE):
        assert not list(tmp_path.glob("simulate-*"))


def test_a_simulation_that_cannot_leave_a_record_goes_on(quiet_computer: Path) -> None:
    (quiet_computer / "elib").write_text("a file where the folder should be")
    with registered([("epuck-1", "tcp://127.0.0.1:1")], HERE):
        assert running() == []


def test_without_a_runtime_folder_records_lie_among_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    monkeypatch.setattr(registry.tempfile, "gettempdir", lambda: str(tmp_path))
    assert registry.folder() == tmp_path / f"elib-{os.getuid()}"
    with registered([("epuck-1", "tcp://127.0.0.1:1")], HERE):
        assert [robot.name for robot in running()] == ["epuck-1"]


# -- the network --


@pytest.mark.parametrize(
    ("network", "complaint"),
    [
        ("robots", "is not a network"),
        ("10.0.0.0/8", "16777216 addresses"),
        ("203.0.113.0/24", "no address in"),
        ("127.0.0.0/33", "is not a network"),
    ],
)
def test_only_a_network_of_this_computer_is_asked(network: str, complaint: str) -> None:
    with pytest.raises(ArgumentError, match=complaint):
        addresses_of(network)


def test_every_other_address_of_the_own_network_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    own = ipaddress.IPv4Address("192.168.7.20")
    monkeypatch.setattr(discovery, "_own_address", lambda target: own)
    asked = addresses_of("local")
    assert len(asked) == 253
    assert (asked[0], asked[-1]) == ("192.168.7.1", "192.168.7.254")
    assert str(own) not in asked
    monkeypatch.setattr(discovery, "_own_address", lambda target: None)
    with pytest.raises(ArgumentError, match="in no network"):
        addresses_of("local")


async def test_an_address_where_nothing_listens_is_not_listed_and_each_robot_is() -> None:
    robots = {}

    async def opened(url: object) -> Transport:
        return await open_transport(robots.get(str(url), "tcp://{}:{}".format(*closed.getsockname())))

    settings = SimulationSettings(firmware="epuck2-wifi", robots=2)
    async with serve(settings, wifi="127.0.0.1:0") as served:
        closed = socket.socket()
        closed.bind(("127.0.0.1", 0))
        robots |= {f"wifi://127.0.0.{3 + number}": robot.url for number, robot in enumerate(served)}
        with pytest.MonkeyPatch.context() as patch, closed:
            patch.setattr(discovery, "open_transport", opened)
            patch.setattr(discovery, "CONNECTING", PATIENCE)
            found = await find(timeout=PATIENCE, network="127.0.0.0/29")
    assert [(each.url, each.kind, each.firmware) for each in found if each.kind == "wifi"] == [
        ("wifi://127.0.0.3", "wifi", "epuck2-wifi"),
        ("wifi://127.0.0.4", "wifi", "epuck2-wifi"),
    ]
