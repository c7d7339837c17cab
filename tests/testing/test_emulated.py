"""What a test sees of an emulated robot."""

import pytest

from elib.base.errors import ArgumentError, SimulationStalled
from elib.simulator.emulator.firmware import FIRMWARES
from elib.testing import EmulatedRobot, emulated

BYTE = 10 / 115_200


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_robot_greets_when_it_is_switched_on(firmware: str) -> None:
    bench = EmulatedRobot(firmware)
    assert bench.boot.endswith(
        b'\x0c\x07WELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'
    )
    assert bench.hardware["resets"] == (0 if firmware == "epuck2" else 1)


def test_only_the_line_takes_time() -> None:
    bench = EmulatedRobot("btcom-1.1.3")
    start = bench.time
    bench.send(b"K\r")
    assert bench.time - start == pytest.approx((2 + 62 + 25) * BYTE)


def test_a_command_may_come_in_pieces() -> None:
    bench = EmulatedRobot("btcom-2.0")
    assert [bench.send(piece) for piece in (b"D,1", b"0,20", b"\r")] == [b"", b"", b"d\r\n"]


def test_the_hardware_changes_only_when_told() -> None:
    bench = EmulatedRobot("btcom-2.0", {"selector": 4})
    assert bench.send(b"C\r") == b"c,4\r\n"
    bench.set(selector=9)
    assert bench.send(b"C\r") == b"c,9\r\n"
    with pytest.raises(ArgumentError, match="selector is 99"):
        bench.set(selector=99)
    assert bench.send(b"C\r") == b"c,9\r\n"


def test_motors_stand_still_but_for_ticks() -> None:
    bench = EmulatedRobot("asercom-1.2.2")
    bench.send(b"D,1000,500\r")
    bench.send(b"H\r" * 10)
    assert bench.hardware["steps"] == [0, 0]
    bench.tick(10_000)
    assert bench.send(b"Q\r") == b"q,1000,500\r\n"


def test_motors_run_with_the_line_if_the_state_says_so() -> None:
    bench = EmulatedRobot("asercom-1.2.2", {"motor_time": "running"})
    bench.send(b"D,1000,1000\r")
    bench.send(b"H\r" * 10)  # 0.93 s of line
    assert bench.send(b"Q\r").startswith(b"q,9")


def test_two_benches_are_two_robots() -> None:
    one, other = EmulatedRobot("epuck2"), EmulatedRobot("epuck2")
    one.send(b"D,5,5\rL,8,1\r")
    assert other.hardware == EmulatedRobot("epuck2").hardware


def test_a_report_is_a_copy() -> None:
    bench = EmulatedRobot("btcom-1.1.3")
    bench.hardware["led"].append(7)
    assert bench.hardware["led"] == [0] * 8


def test_a_robot_that_never_falls_silent_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(emulated, "LIMIT", 0.1)
    with pytest.raises(SimulationStalled, match=r"not idle after 0\.1 s"):
        EmulatedRobot("btcom-1.1.3").send(b"H\r" * 5)


def test_the_longest_answer_is_within_the_limit() -> None:
    bench = EmulatedRobot("btcom-1.1.3")
    bench.send(b"J,0,-40,40,8\r")  # announces 63,939 bytes
    assert len(bench.send(b"\xb7\0")) == 63_939
    assert bench.send(b"C\r") == b"c,3\r\n"


COMMAND = bytes.fromhex("80 02 00 6400 9CFF 01 000000 000000 000000 000000 00")


def test_a_robot_with_wifi_streams_while_time_passes() -> None:
    robot = EmulatedRobot("epuck2-wifi", {"tof": 777, "motor_time": "running"})
    assert robot.boot == b""
    assert robot.run(5.0) == b""
    assert robot.send(COMMAND) == b""
    packets = robot.run(1.0)
    assert 45 * 105 <= len(packets) <= 50 * 105
    assert packets[-105:][70:72] == (777).to_bytes(2, "little")
    assert robot.hardware["speed"] == [100, -100]
    assert robot.hardware["led"] == [1, 0, 0, 0]
    robot.set(tof=5)
    assert robot.run(0.1)[-105:][70:72] == b"\x05\x00"


def test_run_lets_time_pass_on_a_serial_line_too() -> None:
    robot = EmulatedRobot("btcom-2.0")
    before = robot.time
    assert robot.run(2.5) == b""
    assert robot.time == before + 2.5
