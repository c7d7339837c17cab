"""The traffic log of ``elib simulate -v``."""

from __future__ import annotations

import asyncio

import pytest

from elib.cli.traffic import QUIET, TrafficLog, shown, split


@pytest.fixture
def lines() -> list[str]:
    return []


async def test_a_text_line_is_shown_when_it_ends_with_the_command_it_is(lines: list[str]) -> None:
    log = TrafficLog("asercom-1.2.2", lines.append)
    log.note("epuck-1", 1.5, "to robot", b"D,5")
    assert lines == []
    log.note("epuck-1", 1.501, "to robot", b"00,500\r")
    assert [line.split() for line in lines] == [["1.500", "epuck-1", "->", r"D,500,500\r", "set_speed"]]
    log.note("epuck-1", 1.6, "to host", b"d\r\n")
    assert lines[1].split() == ["1.600", "epuck-1", "<-", r"d\r\n"]


async def test_the_other_side_speaking_ends_a_piece(lines: list[str]) -> None:
    log = TrafficLog("asercom-1.2.2", lines.append)
    log.note("epuck-1", 0.0, "to robot", b"\xb7\0")
    log.note("epuck-1", 0.1, "to host", b"\x01\x28\x28")
    assert [line.split()[2:] for line in lines] == [["->", "b7", "00", "image"]]
    log.flush()
    assert lines[1].split()[2:] == ["<-", "01", "28", "28"]


async def test_robots_do_not_mix(lines: list[str]) -> None:
    log = TrafficLog("btcom-2.0", lines.append)
    log.note("epuck-1", 0.0, "to robot", b"N")
    log.note("epuck-2", 0.0, "to robot", b"O\r")
    log.note("epuck-1", 0.0, "to robot", b"\r")
    assert [line.split()[1:] for line in lines] == [
        ["epuck-2", "->", r"O\r", "ambient_light"],
        ["epuck-1", "->", r"N\r", "proximity"],
    ]


async def test_what_never_ends_is_shown_after_a_pause(lines: list[str]) -> None:
    log = TrafficLog("btcom-2.0", lines.append)
    log.note("epuck-1", 0.0, "to robot", b"half a li")
    assert lines == []
    await asyncio.sleep(QUIET)
    assert len(lines) == 1
    assert lines[0].endswith("half a li                help_text")


async def test_the_letter_means_what_the_firmware_means_by_it() -> None:
    assert TrafficLog("asercom-1.2.2").command(b"b\r") == "battery"
    assert TrafficLog("btcom-2.0").command(b"b,1\r") == "set_body_led"
    assert TrafficLog("btcom-2.0").command(b"\xb2") == "proximity"
    assert TrafficLog("btcom-2.0").command(b"\0\0") == ""
    assert TrafficLog("btcom-2.0").command(b"\0\0\rS\r") == "stop"


def test_several_lines_are_split_and_binary_data_is_not() -> None:
    assert split(b"v,1\r\nHW\r\n") == [b"v,1\r\n", b"HW\r\n"]
    assert split(b"V\rN\r") == [b"V\r", b"N\r"]
    assert split(b"\x01\r\n\x02") == [b"\x01\r\n\x02"]


def test_of_long_data_the_beginning_is_shown_and_the_rest_counted() -> None:
    assert shown(b"x" * 100) == "x" * 60 + " .. 40 more"
    assert shown(bytes(3203)).endswith(" .. 3187 more")
    assert shown(b"n,1\r\n") == r"n,1\r\n"
