"""The console: what is typed becomes a command of the table, or an explanation."""

from __future__ import annotations

import pytest

from elib.base.errors import ArgumentError
from elib.base.timebase import SimulatedLoop
from elib.link.protocol import values as v
from elib.link.protocol.commands import SPECS
from elib.link.protocol.words import to_text
from elib.panel.console import MAX_SHOWN, Call, answer, complete, help_line, parse, result_text
from elib.panel.slot import Slot
from elib.robot.actions import catalogue

# clock: simulated
LOOP = SimulatedLoop
SIM = "sim://square?speed=max"


def test_what_is_typed_is_understood() -> None:
    for line, call in (
        ("set_speed 0.1 0.2", Call("set_speed", (0.1, 0.2))),
        ("set_speed(0.1, -0.2)", Call("set_speed", (0.1, -0.2))),
        ("  Set_Speed   .1,.2  ", Call("set_speed", (0.1, 0.2))),
        ("set_led(3, ON)", Call("set_led", (3, "ON"))),
        ("set_led 3 'toggle'", Call("set_led", (3, "toggle"))),
        ("i2c_read 0x60 4", Call("i2c_read", (0x60, 4))),
        ("proximity", Call("proximity")),
        ("proximity()", Call("proximity")),
        ("stop", Call("stop")),
        ("text D,100,-100", Call("text", ("D,100,-100",))),
        ("text('D,100,-100')", Call("text", ("D,100,-100",))),
        ('text "H"', Call("text", ("H",))),
        ("set_obstacle_avoidance off", Call("set_obstacle_avoidance", ("off",))),
        ("set_camera 40 40 8 GREY", Call("set_camera", (40, 40, 8, "GREY"))),
    ):
        assert parse(line) == call, line


def test_what_is_no_command_is_explained() -> None:
    for line, reason in (
        ("", "not a command"),
        ("set_sped 1 1", "did you mean set_speed"),
        ("__class__", "no command"),
        ("set_speed", "0 arguments"),
        ("set_speed 0,1 0,2", "4 arguments"),
        ("set_speed(1, 2,)", "ends in a comma"),
        ("set_speed 'a", "cannot be read"),
        ("proximity 1", "1 argument"),
        ("text", "0 arguments"),
        ("; rm -rf /", "not a command"),
        ("stop\nstop", "one line"),
        ("a" * 300, "one line"),
    ):
        with pytest.raises(ArgumentError) as refused:
            parse(line)
        assert reason in str(refused.value), line


def test_every_row_of_the_table_can_be_sent() -> None:
    assert set(SPECS) <= set(catalogue())
    for entry in catalogue().values():
        assert help_line(entry.name).startswith(entry.usage)


def test_lines_are_completed() -> None:
    for line, completions in (
        ("set_sp", ["set_speed"]),
        ("SET_SP", ["set_speed"]),
        ("led", ["set_body_led", "set_front_led", "set_led", "set_rgb_led"]),
        ("set_led 3 ", ["set_led 3 OFF", "set_led 3 ON", "set_led 3 TOGGLE"]),
        ("set_led(3, t", ["set_led(3, TOGGLE"]),
        ("set_led ", []),
        ("set_led 3 ON ", []),
        ("help set_cam", ["help set_camera"]),
        ("nothing ", []),
        ("a" * 999, []),
    ):
        assert complete(line) == completions, line


def test_only_what_the_firmware_has_is_offered() -> None:
    assert "battery" in complete("", "asercom-1.2.2")
    assert "battery" not in complete("", "btcom-2.0")
    assert "not on btcom-2.0" in help_line("battery", "btcom-2.0")
    assert "from -1.1 to 1.1 rev/s" in help_line("set_speed 0.1", "epuck2")


async def test_a_line_is_sent_and_answered_and_a_wrong_one_explained() -> None:
    slot = Slot(SIM)
    assert (await answer(slot, "proximity")).is_bad
    await slot.connect()
    near = await answer(slot, "proximity")
    assert not near.is_bad
    assert near.text.startswith("front_right ")
    assert near.text.count("counts") == 8
    assert (await answer(slot, "set_led 3 ON")).text == "done"
    assert slot.robot.context.last_set.lamps[3] == 1
    bad = await answer(slot, "set_led 77 ON")
    assert bad.is_bad
    assert "n is 77" in bad.text
    assert "set_speed(left, right)" in (await answer(slot, "help set_speed")).text
    assert "set_speed(left, right)" in (await answer(slot, "help")).text
    assert "distance" not in (await answer(slot, "help")).text
    assert (await answer(slot, "distance")).is_bad
    for line in ("sensors", "version", "help_text", "camera", "image", "microphone_samples", "i2c_scan", "text V"):
        said = await answer(slot, line)
        assert said.text, line
        assert not said.is_bad, said.text
    await slot.disconnect()


async def test_a_typed_speed_belongs_to_its_page(slot: Slot) -> None:
    assert not (await answer(slot, "set_speed 0.2 0.2", "page")).is_bad
    assert slot.drive.driver == "page"
    refused = await answer(slot, "set_speed 0.2 0.2", "other")
    assert "another page drives" in refused.text
    assert not (await answer(slot, "stop", "other")).is_bad


def test_answers_are_said_in_the_words_of_elib_send() -> None:
    assert result_text(None) == "done"
    assert result_text(v.Wheels(0.5, -0.25)) == to_text(v.Wheels(0.5, -0.25), 100)
    assert result_text(v.Wheels(0.5, -0.25)).splitlines()[1] == "right  -0.25 rev/s"
    assert result_text([96, 192]) == "0x60 (96)\n0xc0 (192)"
    assert len(result_text("x" * 9999)) == MAX_SHOWN
