"""How the emulated ESP32 streams: which packets, in which order, and when."""

import pytest
from wifi_rig import Rig, command


def test_the_robot_is_silent_until_a_valid_command() -> None:
    rig = Rig()
    assert rig.ids(5.0) == []
    rig.send(command(2))
    assert set(rig.ids(1.0)) == {2}


def test_it_streams_on_with_the_last_command() -> None:
    rig = Rig()
    rig.send(command(0))
    assert set(rig.ids(3.0)) == {3}
    rig.send(command(2))
    rig.ids(0.05)
    assert set(rig.ids(3.0)) == {2}


def test_a_picture_comes_before_the_sensors() -> None:
    rig = Rig()
    rig.send(command(3))
    ids = rig.ids(2.0)
    assert ids[:6] == [1, 2] * 3
    rig.send(command(1))
    rig.ids(0.2)
    assert set(rig.ids(1.0)) == {1}


def test_other_request_bits_alone_send_nothing_and_move_nothing() -> None:
    rig = Rig()
    rig.send(command(4, left=300, right=300))
    assert rig.ids(2.0) == []
    assert rig.hardware.rates == (0.0, 0.0)
    rig.send(command(6, left=300, right=300))
    assert set(rig.ids(0.5)) == {2}
    assert rig.hardware.rates == pytest.approx((300, 300), rel=0.01)
