"""The connection doctor: every step seen failing, on real ports, real emulators and scripted peers."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
import serialx

from elib.base.errors import LinkDenied, LinkError
from elib.link.protocol.profiles import BTCOM_AMONG_OTHERS, PROFILES, TURN_THE_SELECTOR
from elib.link.transport import Transport, Url, open_transport, parse_url, ports, serial
from elib.link.transport.memory import memory_pair
from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from elib.testing import simulated
from elib.tools import discovery
from elib.tools.diagnosis import CHECKS, Diagnosis, DiagnosisStep, advice, diagnose, doctor, link
from elib.tools.diagnosis.line import interrogate
from elib.tools.diagnosis.link import Examination
from elib.tools.diagnosis.report import CheckResult
from elib.tools.discovery import Found, Survey
from shared import held

MAX_DURATION = 20.0
"""s that a dead link may take: the promise of diagnose()."""

posix = pytest.mark.skipif(sys.platform == "win32", reason="needs ptys")


def step(found: Diagnosis, name: str) -> DiagnosisStep:
    return next(each for each in found.steps if each.name == name)


def names(found: Diagnosis, state: str) -> list[str]:
    return [each.name for each in found.steps if each.state == state]


def after(name: str) -> list[str]:
    order = [check.name for check in CHECKS]
    return order[order.index(name) + 1 :]


Answers = Callable[[bytes], bytes]


@asynccontextmanager
async def scripted(
    answers: Answers, *, first: bytes = b"", codec: str = "serial"
) -> AsyncIterator[Callable[[Url], object]]:
    """Return an opener whose other side sends *first*, then for each piece that comes what *answers* returns."""
    near, far = memory_pair("memory://scripted", origin="robot")
    near.codec = codec

    async def talk() -> None:
        try:
            await far.write(first)
            while True:
                await far.write(answers(await far.read()))
        except LinkError:
            return

    async def opener(_: Url) -> Transport:
        return near

    task = asyncio.create_task(talk())
    try:
        yield opener
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        await far.close()


def by_letter(answers: Mapping[bytes, bytes]) -> Answers:
    """A robot that answers whole commands by their first byte, and nothing else."""

    def answer(data: bytes) -> bytes:
        commands = data.strip(b"\0\r").replace(b"\0", b"\r").split(b"\r")
        return b"".join(answers.get(command[:1], b"") for command in commands if command)

    return answer


UNKNOWN = {
    b"V": b"v,Version 9.9 May 2031\r\n",
    b"N": b"n,1,2,3,4,5,6,7,8\r\n",
    b"C": b"c,3\r\n",
    b"Q": b"q,0,0\r\n",
    b"E": b"e,0,0\r\n",
    b"H": b'\n"A"\tAccelerometer\r\n"V"\tVersion\r\n',
    b"\xb7": b"\x01\x28\x28" + bytes(3200),
}


async def opened_with(before: bytes, url: str = "sim://?speed=max") -> Diagnosis:
    """Diagnose a virtual robot that some other program has sent *before* to."""

    async def opener(target: Url) -> Transport:
        transport = await open_transport(target)
        await transport.write(before)
        return transport

    return await diagnose(url, opener=opener)


# -- healthy --


@pytest.mark.parametrize("firmware", PROFILES)
@simulated
async def test_a_healthy_robot_passes_every_step(firmware: str) -> None:
    seen: list[DiagnosisStep] = []
    found = await diagnose(f"sim://?speed=max&firmware={firmware}", on_step=seen.append)
    assert names(found, "ok") == [check.name for check in CHECKS]
    assert tuple(seen) == found.steps
    assert found.ok
    assert found.failed is None
    assert step(found, "firmware").detail == firmware
    assert found.verdict == "The robot answers, and everything is as it should be."


@simulated
async def test_what_was_measured_is_what_the_line_allows() -> None:
    found = await diagnose("sim://?speed=max&quality=ideal&latency=0.01")
    assert step(found, "round trip").detail.startswith("median 22 ms")  # twice 10 ms, and 23 bytes of line
    assert step(found, "throughput").detail.startswith("11.5 kB/s")
    assert step(found, "picture").detail == "40 x 40, colour, 3200 bytes in 0.32 s"


@posix
async def test_a_robot_on_a_port_is_examined_and_the_port_is_free_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    # What is measured after that takes real time; above, simulated time proves it.
    monkeypatch.setattr(doctor, "CHECKS", doctor.CHECKS[: -len(after("answer"))])
    async with serve(SimulationSettings()) as robots:
        found = await diagnose(robots[0].url)
        assert ports.holders(found.url.removeprefix("serial://")) == []
    assert found.ok
    assert "no other program" in step(found, "holder").detail


# -- the link --


async def test_a_missing_port_is_the_first_thing_said_and_everything_else_is_skipped() -> None:
    found = await diagnose("/dev/ttyUSB77")
    assert names(found, "failed") == ["link"]
    assert names(found, "skipped") == after("link")
    assert "there is no port /dev/ttyUSB77" in step(found, "link").detail
    assert "plugged in" in step(found, "link").fix
    assert found.verdict == "It does not connect: the step 'link' failed."


async def test_a_port_where_no_program_listens_is_not_a_link() -> None:
    server = await asyncio.get_running_loop().create_server(asyncio.Protocol, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    server.close()
    found = await diagnose(f"tcp://127.0.0.1:{port}")
    assert names(found, "failed") == ["link"]
    assert f"elib simulate --tcp 127.0.0.1:{port}" in step(found, "link").fix


async def test_a_computer_without_bluetooth_is_told_before_anything_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(link, "ADAPTERS", tmp_path)
    monkeypatch.setattr(sys, "platform", "linux")
    found = await diagnose("rfcomm://10:00:E8:00:00:01")
    assert step(found, "link").detail == "this computer has no Bluetooth adapter"
    assert "rfkill" in step(found, "link").fix


@posix
async def test_a_port_this_user_may_not_open_fails_at_rights(silent_port: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # Root passes every right, so the refusal comes from the system call's place.
    async def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, os.strerror(13))

    monkeypatch.setattr(serialx, "create_serial_connection", refuse)
    found = await diagnose(silent_port)
    assert names(found, "ok") == ["link"]
    assert names(found, "failed") == ["rights"]
    assert step(found, "rights").detail == "this user may not open the port"
    if sys.platform == "linux":
        assert "usermod -aG" in step(found, "rights").fix


@posix
def test_the_group_that_may_use_a_port_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import grp
    import pwd

    port = tmp_path / "port"
    port.touch()
    user = pwd.getpwuid(os.getuid()).pw_name
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(os, "stat", lambda path: os.stat_result((0o660, 0, 0, 1, 0, 4242, 0, 0, 0, 0)))
    for members, wanted in (([], "sudo usermod -aG robots $USER"), ([user], "log out and in again")):
        monkeypatch.setattr(grp, "getgrgid", lambda number, m=members: grp.struct_group(("robots", "", number, m)))
        error = serial._explain(parse_url(str(port)), str(port), PermissionError(13, "Permission denied"))
        assert isinstance(error, LinkDenied)
        assert wanted in error.hint


@pytest.mark.parametrize(
    ("holders", "hint"),
    [
        (["ModemManager (process 812)"], "sudo systemctl stop ModemManager"),
        (["brltty (process 99)"], "sudo apt remove brltty"),
        (["picocom (process 7)"], "close that program"),
    ],
)
def test_programs_that_grab_ports_are_known_by_name(holders: list[str], hint: str) -> None:
    error = serial.busy(parse_url("/dev/ttyUSB0"), holders)
    assert error.message.endswith(f"the port is busy: {holders[0]} holds it")
    assert hint in error.hint
    assert ("ModemManager" in error.hint) is ("ModemManager" in holders[0])


@posix
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells who holds a port")
@pytest.mark.parametrize("locks", [True, False])
async def test_a_port_of_another_program_is_not_opened_and_its_holder_is_named(locks: bool, silent_port: str) -> None:
    with held(silent_port, locks=locks) as process:
        found = await diagnose(silent_port, opener=never_open)
    assert names(found, "failed") == ["holder"]
    assert f"(process {process}) holds it" in step(found, "holder").detail
    assert step(found, "holder").fix.startswith("close that program")
    assert found.verdict == "It was not tried, for another program has the link: close that one and look again."


@posix
async def test_a_port_that_breaks_while_it_opens_fails_at_opening(
    silent_port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def refuse(*_: object, **__: object) -> None:
        raise OSError(5, os.strerror(5))

    monkeypatch.setattr(serialx, "create_serial_connection", refuse)
    found = await diagnose(silent_port)
    assert names(found, "failed") == ["opening"]
    assert "Input/output error" in step(found, "opening").detail
    assert step(found, "opening").fix == advice.here(advice.OPENING)


async def test_an_opener_that_raises_what_the_system_raised_is_understood() -> None:
    async def refuse(_: Url) -> Transport:
        raise OSError(5, "the wire is cut")

    found = await diagnose("tcp://127.0.0.1:1", opener=refuse)
    assert names(found, "failed") == ["opening"]
    assert step(found, "opening").detail == "the wire is cut"


async def test_a_virtual_robot_that_serves_another_program_says_so() -> None:
    async with serve(SimulationSettings(), tcp="0") as robots:
        url = robots[0].url
        other = await open_transport(url)
        await other.write(b"V\r")
        await other.read()
        found = await diagnose(url)
        await other.close()
    assert names(found, "failed") == ["line"]
    assert "serves one program at a time" in step(found, "line").fix


# -- the line --


@simulated
async def test_silence_is_told_from_noise_and_takes_no_longer_than_promised() -> None:
    found = await diagnose("sim://?speed=max&loss=1")
    assert names(found, "failed") == ["answer"]
    assert step(found, "answer").detail == "nothing answers"
    assert TURN_THE_SELECTOR in step(found, "answer").fix
    assert step(found, "binary session").ok is None
    assert "unknown: nothing answers" in step(found, "binary session").detail
    assert asyncio.get_running_loop().time() < MAX_DURATION


@posix
async def test_noise_on_a_real_port_is_noise() -> None:
    from elib.link.transport.pty import PtyTransport

    port = PtyTransport()
    port.listen(lambda data: port.send_nowait(bytes(255 - byte for byte in data)) and None)
    try:
        found = await diagnose(port.url)
    finally:
        port.abort()
    assert names(found, "failed") == ["line"]


@simulated
async def test_noise_of_another_speed_and_the_text_of_another_device_are_told_apart() -> None:
    async with scripted(lambda data: b"\xf8\x80\x1e\xfe" * len(data)) as opener:
        found = await diagnose("tcp://127.0.0.1:1", opener=opener)
    assert names(found, "failed") == ["line"]
    assert "what comes is not text: " in step(found, "line").detail
    assert " bytes, f8 80 1e fe f8 80 " in step(found, "line").detail
    assert "115200" in step(found, "line").fix
    assert names(found, "skipped") == after("line")
    async with scripted(lambda data: b"ERROR\r\n") as opener:
        found = await diagnose("tcp://127.0.0.1:1", opener=opener)
    assert names(found, "failed") == ["answer"]
    assert "not as an e-puck does" in step(found, "answer").detail


@pytest.mark.parametrize(("said", "fix"), [(b"hello ", advice.CHATTER), (b"\xfe\x03", advice.WRONG_SPEED)])
@simulated
async def test_a_line_that_never_falls_silent_is_given_up(said: bytes, fix: str) -> None:
    near, far = memory_pair()

    async def chatter() -> None:
        while True:
            await far.write(said)
            await asyncio.sleep(0.05)

    async def opener(_: Url) -> Transport:
        return near

    task = asyncio.create_task(chatter())
    found = await diagnose("tcp://127.0.0.1:1", opener=opener)
    await asyncio.gather(task, return_exceptions=True)
    assert names(found, "failed") == ["line"]
    assert step(found, "line").fix == fix


@simulated
async def test_a_line_that_floods_is_given_up_before_it_fills_the_memory() -> None:
    near, far = memory_pair()

    async def flood() -> None:
        while True:
            await far.write(b"x" * 5000)
            await asyncio.sleep(0)

    task = asyncio.ensure_future(flood())
    found = await interrogate(near)
    task.cancel()
    assert not found.is_quiet
    assert len(found.unasked) < 1_000_000


def test_advice_that_two_sources_give_is_given_once() -> None:
    assert advice.joined("close that program", "", "close that program; ask") == "close that program; ask"


def test_wheels_that_took_the_question_for_their_speed_are_stopped_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hardware = tmp_path / "hardware.json"
    hardware.write_text("{}")
    driven: list[tuple[float, float, float]] = []

    def drive(_: FixedHardware, left: float, right: float) -> None:
        driven.append((asyncio.get_running_loop().time(), left, right))

    monkeypatch.setattr(FixedHardware, "drive", drive)

    @simulated
    async def examine() -> Diagnosis:
        return await opened_with(b"\xbc", f"sim://?speed=max&hardware={hardware}")  # set speed, no numbers yet

    assert step(examine(), "binary session").state == "warning"
    turning = [time for time, left, right in driven if (left, right) != (0, 0)]
    standing = [time for time, left, right in driven if (left, right) == (0, 0)]
    assert turning, "the question was no number: this proves nothing"
    assert standing[-1] > turning[-1]
    assert standing[-1] - turning[0] < 0.01


@pytest.mark.parametrize(
    ("before", "name", "state", "detail"),
    [
        (b"\xb7\0", "line", "ok", "3203 bytes of an earlier program's answer came first"),
        (b"\xb1", "binary session", "warning", "one was open and swallowed text; zeros ended it"),
        (b"D,0,0,", "binary session", "warning", "half a command was on the line"),
    ],
)
@simulated
async def test_what_another_program_left_on_the_line_is_recognised_and_ended(
    before: bytes, name: str, state: str, detail: str
) -> None:
    found = await opened_with(before)
    assert step(found, name).state == state
    assert step(found, name).detail.startswith(detail)
    assert found.ok


@simulated
async def test_a_late_answer_is_not_taken_for_a_binary_session() -> None:
    found = await diagnose("sim://?speed=max&latency=0.6&baud=38400")
    assert step(found, "binary session").detail == "none was open; the first answer took 1.2 s"
    assert step(found, "answer").state == "ok"


# -- the robot --


@simulated
async def test_an_unknown_firmware_is_treated_like_the_nearest_and_a_picture_of_one_colour_is_worth_a_look() -> None:
    async with scripted(by_letter(UNKNOWN)) as opener:
        found = await diagnose("tcp://127.0.0.1:1", opener=opener)
    unknown = step(found, "firmware")
    assert unknown.state == "warning"
    assert unknown.detail == "'Version 9.9 May 2031' is unknown; it is spoken to as btcom-2.0"
    assert "firmware=" in unknown.fix
    assert found.ok
    assert found.verdict == "The robot answers; look at: firmware, picture."
    assert "every pixel is the same" in step(found, "picture").detail


@simulated
async def test_a_robot_that_knows_nothing_but_its_name_fails_step_by_step() -> None:
    async with scripted(by_letter({b"V": b"v,Version 9.9\r\n"})) as opener:
        found = await diagnose("tcp://127.0.0.1:1", opener=opener)
    assert names(found, "failed") == ["selector", "round trip", "throughput", "picture"]
    assert found.verdict == "The robot answers, but the step 'selector' failed."
    assert all(each.fix for each in found.steps if each.state == "failed")


@pytest.mark.parametrize(
    ("keys", "name", "detail", "fix"),
    [
        ("latency=0.1", "round trip", "a healthy Bluetooth link takes 65 ms", advice.here(advice.SLOW)),
        ("latency=0.3", "round trip", "of 7 proximity readings", ""),
        ("loss=0.1&seed=1", "round trip", "lost", ""),
        ("baud=9600", "throughput", "1.0 kB/s", ""),
    ],
)
@simulated
async def test_a_slow_or_lossy_link_is_measured_in_a_bounded_time_and_worth_a_look(
    keys: str, name: str, detail: str, fix: str
) -> None:
    slow = step(await diagnose(f"sim://?speed=max&{keys}"), name)
    assert slow.state == "warning"
    assert detail in slow.detail
    assert fix in slow.fix


def test_every_advice_about_the_selector_has_the_positions_of_every_firmware_and_of_a_delivered_robot() -> None:
    for text in (TURN_THE_SELECTOR, advice.CHATTER, advice.WRONG_SPEED):
        for profile in PROFILES.values():
            assert all(f"{position}" in text and place in text for position, place in profile.talks_at.items())
        assert BTCOM_AMONG_OTHERS in text


@pytest.mark.parametrize(
    ("firmware", "position", "state"),
    [("asercom-1.2.2", 7, "warning"), ("asercom-1.2.2", 10, "ok"), ("epuck2", 8, "ok"), ("btcom-2.0", 7, "ok")],
)
@simulated
async def test_a_selector_that_will_silence_the_robot_is_reported(
    firmware: str, position: int, state: str, tmp_path: Path
) -> None:
    hardware = tmp_path / "hardware.json"
    hardware.write_text(json.dumps({"selector": position}))
    found = await diagnose(f"sim://?speed=max&firmware={firmware}&hardware={hardware}")
    assert step(found, "selector").state == state


@simulated
async def test_a_check_that_hangs_is_ended_by_its_limit() -> None:
    async def hang(_: Examination) -> CheckResult:
        await asyncio.Event().wait()
        raise AssertionError

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(doctor, "CHECKS", (doctor.Check("answer", hang, "", 3),))
        found = await diagnose("sim://?speed=max")
    assert found.steps == (DiagnosisStep("answer", False, "it did not end within 3 s", "switch the robot off and on"),)


# -- without a URL, and on other systems --


@pytest.mark.parametrize(
    ("system", "fix"), [("linux", "rfcomm bind 0"), ("darwin", "System Settings"), ("win32", "COM Ports")]
)
async def test_without_any_link_each_system_is_told_how_to_make_one(
    system: str, fix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "candidates", listing())
    monkeypatch.setattr(sys, "platform", system)
    found = await diagnose()
    assert names(found, "failed") == ["link"]
    assert "left out, for robots have no such ports: /dev/ttyS0" in found.steps[0].detail
    assert fix in found.steps[0].fix


async def test_the_only_link_there_is_gets_examined(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "candidates", listing("/dev/ttyUSB77"))
    found = await diagnose()
    assert found.url == "serial:///dev/ttyUSB77"


async def test_of_several_links_the_one_that_answers_gets_examined(monkeypatch: pytest.MonkeyPatch) -> None:
    async with serve(SimulationSettings(), tcp="0") as robots:
        links = (Found("serial:///dev/ttyUSB77", "serial", ""), Found(robots[0].url, "simulation", ""))

        async def both(**_: object) -> Survey:
            return Survey(links)

        monkeypatch.setattr(discovery, "candidates", both)
        monkeypatch.setattr(doctor, "candidates", both)
        # What comes after choosing takes real time, and this test is not about it.
        monkeypatch.setattr(doctor, "CHECKS", doctor.CHECKS[:1])
        found = await diagnose()
    assert found.url == robots[0].url
    assert found.steps[0].detail.endswith("; one of 2, see elib find")


def test_every_advice_has_a_text_for_each_system() -> None:
    texts = [value for value in vars(advice).values() if isinstance(value, dict) and "linux" in value]
    assert len(texts) >= 5
    assert all(set(text) == {"linux", "darwin", "win32"} for text in texts)


# -- helpers --


def listing(*found: str) -> Callable[..., object]:
    async def candidates(**_: object) -> Survey:
        return Survey(tuple(Found(f"serial://{port}", "serial", "") for port in found), ("/dev/ttyS0",))

    return candidates


async def never_open(_: Url) -> Transport:
    raise AssertionError("a port of somebody else was opened")


@pytest.fixture
async def silent_port() -> AsyncIterator[str]:
    from elib.link.transport.pty import PtyTransport

    port = PtyTransport()
    yield port.path
    port.abort()


# -- Wi-Fi --


@pytest.mark.parametrize(
    ("first", "detail", "fix"),
    [
        (b"\x03" * 20, "empty packets come before any command", "current Wi-Fi firmware"),
        (b"HTTP/1.1 400 Bad Request\r\n", "is not an e-puck2's Wi-Fi", "is it the robot's address?"),
    ],
)
@simulated
async def test_what_comes_before_any_command_tells_an_old_build_from_another_device(
    first: bytes, detail: str, fix: str
) -> None:
    async with scripted(lambda data: b"", first=first, codec="wifi") as opener:
        found = await diagnose("wifi://127.0.0.1", opener=opener)
    assert names(found, "failed") == ["line"]
    assert detail in step(found, "line").detail
    assert fix in step(found, "line").fix


@simulated
async def test_a_robot_that_another_program_uses_is_silent_and_the_doctor_says_so() -> None:
    async with scripted(lambda data: b"", codec="wifi") as opener:
        found = await diagnose("wifi://127.0.0.1", opener=opener)
    assert step(found, "line").detail == "silent until it gets a command"
    assert names(found, "failed") == ["answer"]
    assert "serves one at a time" in step(found, "answer").fix
    assert "selector to 15" in step(found, "answer").fix


@simulated
async def test_a_robot_on_wifi_is_examined_to_the_end() -> None:
    found = await diagnose("sim://arena?firmware=epuck2-wifi&speed=max")
    assert {each.state for each in found.steps} == {"ok"}
    assert [each.name for each in found.steps] == [
        each.name for each in CHECKS if each.name not in ("binary session", "throughput")
    ]
    assert "position 15" in step(found, "selector").detail
    assert "160 x 120" in step(found, "picture").detail
