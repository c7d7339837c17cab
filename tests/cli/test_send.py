"""``elib send``: every row of the table, on every firmware, for people and for programs."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import pytest
from elib_process import Ran, Told
from PIL import Image as Pillow

from elib.cli import main
from elib.link.protocol.commands import SPECS
from elib.link.protocol.profiles import PROFILES
from elib.robot.actions import catalogue
from lanes import short

ARGUMENTS = {
    "set_speed": ["0.5", "-0.25"],
    "set_encoders": ["-3000", "3001"],
    "set_proximity_rate": ["slow"],
    "set_distance_sensor": ["on"],
    "set_led": ["8", "toggle"],
    "set_body_led": ["on"],
    "set_front_led": ["1"],
    "set_rgb_led": ["3", "1", "0.5", "0"],
    "play_sound": ["2"],
    "set_camera": ["20", "10", "4", "grey"],
    "i2c_read": ["0xc0", "0"],
    "i2c_write": ["0xc0", "0", "1"],
    "text": ["V"],
    "set_obstacle_avoidance": ["off"],
}
EMPTY = ("stop", "reset", "calibrate_proximity")
FIRST = ("asercom-1.2.2", "epuck2-wifi")
"""The firmwares of the quick lane: bytes and messages."""


def sim(firmware: str) -> str:
    return f"sim://?speed=max&firmware={firmware}"


@pytest.fixture
def sent(ran: Ran) -> Ran:
    """Return a function that runs ``elib send`` here and returns exit code, stdout and stderr."""
    return partial(ran, "send")


@pytest.mark.parametrize("firmware", short(PROFILES, *FIRST))
def test_every_command_answers_with_one_line_of_json_or_says_why_there_is_none(firmware: str, sent: Ran) -> None:
    for name in catalogue():
        code, out, err = sent(name, *ARGUMENTS.get(name, []), "--json", "--robot", sim(firmware))
        reason = PROFILES[firmware].absent.get(name)
        if reason is not None:
            assert (code, out) == (1, ""), name
            assert reason in err, name
            continue
        assert (code, err) == (0, ""), name
        assert out.count("\n") == 1, name
        is_empty = name.startswith(("set_", "start_", "play_", "i2c_write")) or name in EMPTY
        assert (json.loads(out) is None) == is_empty, name


def test_every_command_has_a_page_with_the_rule_of_each_argument(printed: Told) -> None:
    for name in catalogue():
        page = printed("send", name, "--help")
        assert page.startswith(f"Usage: elib send {name}")
        assert all(len(line) <= 80 for line in page.splitlines()), name
        flowing = " ".join(page.split())
        for parameter in SPECS[name].parameters if name in SPECS else ():
            assert parameter.name.upper() in page, name
            if parameter.quantity.choices is None:
                rule = parameter.quantity.rule
                assert rule.removesuffix(f" {parameter.quantity.unit}") in flowing, name


def test_a_page_names_the_firmwares_that_do_not_have_the_command_and_those_with_another_range(
    capsys: pytest.CaptureFixture[str],
) -> None:
    main(["send", "battery", "--help"])
    assert "Not on btcom-1.1.3, btcom-2.0: BTcom has no command for the battery." in capsys.readouterr().out
    main(["send", "set_speed", "--help"])
    page = " ".join(capsys.readouterr().out.split())
    assert "rev/s, a number from -1 to 1; on epuck2 and epuck2-wifi from -1.1 to 1.1" in page


def test_the_list_shows_every_command_and_fits_eighty_columns(printed: Told) -> None:
    page = printed("send")
    assert all(f"\n  {name} " in page for name in catalogue())
    assert all(len(line) <= 80 for line in page.splitlines())


def test_named_fields_are_shown_with_their_unit(sent: Ran) -> None:
    code, out, _ = sent("speed")
    assert code == 0
    assert out == "left   0 rev/s\nright  0 rev/s\n"


def test_a_command_without_an_answer_leaves_stdout_empty(sent: Ran) -> None:
    assert sent("set_speed", "0.5", "-0.5") == (0, "", "set_speed: done\n")


@pytest.mark.parametrize(
    "tokens",
    [
        ["set-speed", "0.1", "0.1", "--robot", sim("epuck2"), "--json"],
        ["set_speed", "--robot", sim("epuck2"), "--json", "0.1", "0.1"],
        ["set-speed", f"--robot={sim('epuck2')}", "0.1", "--json", "0.1", "--within", "2"],
    ],
)
def test_names_take_dashes_and_options_stand_anywhere_behind_them(tokens: list[str], sent: Ran) -> None:
    assert sent(*tokens) == (0, "null\n", "")


@pytest.mark.parametrize(
    ("tokens", "message"),
    [
        (
            ["set_speed", "2", "0"],
            "left is 2 rev/s; it must be a number from -1 to 1 rev/s\nhint: elib send set_speed --help has",
        ),
        (["set_speed", "fast", "0"], "left is 'fast'; it must be a number"),
        (["set_speed", "1"], "elib send set_speed needs RIGHT: rev/s"),
        (["set_speed", "1", "1", "1"], "elib send set_speed takes no '1'"),
        (
            ["drive", "0.1"],
            "drive is a motion that elib makes of them\nhint: write a program: robot.drive(",
        ),
        (["pose"], "elib send opens the robot for one command, and the pose is where it drove since it was opened"),
        (["set_pose", "1", "0"], "hint: ask in a program: robot.pose()"),
        (["set_sped", "1", "1"], "elib send has no command 'set_sped'\nhint: did you mean elib send set_speed?"),
        (["set_led", "9", "on"], "n is 9; it must be a whole number from 0 to 8"),
        (["set_led", "0", "blink"], "action is 'blink'; it must be one of OFF, ON, TOGGLE"),
        (["set_obstacle_avoidance", "maybe"], "on is 'maybe'; it must be one of OFF, ON"),
        (["set_camera", "640", "640"], "takes 819200 bytes"),
        (["i2c_read", "3", "0"], "device is 3; it must be a multiple of 2 from 0 to 254"),
        (["text", " D"], "is not a text command"),
        (["proximity", "--within", "-1"], "--within is -1.0 s; it must be a number from 0 to 3600 s"),
        (["proximity", "--within", "soon"], "--within is 'soon'; it must be a number from 0 to 3600 s"),
        (["proximity", "--robot", "sim://?sped=max"], "sim:// has no key 'sped'\nhint: did you mean speed?"),
        (["image", "--save", "picture.jpg"], "it must end in .png"),
    ],
)
def test_a_wrong_call_is_told_the_rule_and_reaches_no_robot(tokens: list[str], message: str, sent: Ran) -> None:
    # No robot is there: if the call were not refused, the link would fail instead.
    robot = [] if "--robot" in tokens else ["--robot", "tcp://127.0.0.1:9"]
    code, out, err = sent(*tokens, *robot)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert message in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("tcp://127.0.0.1:9", "127.0.0.1:9"),
        ("serial:///dev/no-such-port", "/dev/no-such-port"),
        ("sim://nowhere?speed=max", "there is no world 'nowhere'"),
    ],
)
def test_a_robot_that_cannot_be_reached_is_a_failure_not_a_wrong_call(url: str, message: str, sent: Ran) -> None:
    code, out, err = sent("proximity", "--robot", url)
    assert (code, out) == (1, "")
    assert message in err
    assert "hint: " in err


def test_no_answer_in_time_is_a_failure_that_names_the_request(sent: Ran) -> None:
    code, _, err = sent("calibrate_proximity", "--within", "0.01", "--robot", sim("btcom-1.1.3"))
    assert code == 1
    assert err.startswith("error: calibrate_proximity() did not end within 0.01 s")


def test_a_picture_is_saved_and_described(tmp_path: Path, sent: Ran) -> None:
    file = tmp_path / "seen.png"
    code, out, err = sent("image", "--save", str(file))
    assert code == 0
    assert out == "40 x 40 pixels, COLOUR, 3200 bytes\n"
    assert err == f"saved {file}\n"
    with Pillow.open(file) as picture:
        assert (picture.size, picture.mode) == ((40, 40), "RGB")


def test_a_picture_as_json_has_its_pixels_unless_they_were_saved(tmp_path: Path, sent: Ran) -> None:
    value = json.loads(sent("image", "--json")[1])
    assert (value["mode"], value["width"], value["height"]) == ("COLOUR", 40, 40)
    assert len(value["pixels"]) == 40
    assert all(len(pixel) == 3 for row in value["pixels"] for pixel in row)
    saved = json.loads(sent("image", "--json", "--save", str(tmp_path / "a.png"))[1])
    assert saved["pixels"] is None
    assert saved["saved"] == str(tmp_path / "a.png")


def test_a_picture_that_cannot_be_saved_is_a_failure_that_names_the_file(tmp_path: Path, sent: Ran) -> None:
    code, _, err = sent("image", "--save", str(tmp_path / "none" / "a.png"))
    assert code == 2
    path = str(tmp_path / "none" / "a.png")
    assert err.startswith(f"error: {path!r} cannot be written: No such file or directory\nhint: ")


@pytest.mark.parametrize("name", [f"{'写' * 80}.png", f"a.{'x' * 200}.png"])
def test_a_file_may_have_as_long_a_name_as_the_system_allows(name: str, tmp_path: Path, sent: Ran) -> None:
    assert sent("image", "--save", str(tmp_path / name))[0] == 0
    assert [each.name for each in tmp_path.iterdir()] == [name]


def test_samples_are_nested_lists(sent: Ran) -> None:
    rings = json.loads(sent("microphone_samples", "--json")[1])
    assert [len(ring) for ring in rings] == [100, 100, 100]
    assert all(isinstance(sample, int) for ring in rings for sample in ring)


def test_any_text_command_can_be_sent(sent: Ran) -> None:
    code, out, _ = sent("text", "D,100,-100")
    assert (code, out) == (0, "d\n")


def test_the_variable_elib_robot_names_the_robot_of_a_command(sent: Ran, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ELIB_ROBOT", sim("btcom-2.0"))
    code, out, _ = sent("version", "--json")
    assert (code, json.loads(out)["firmware"]) == (0, "btcom-2.0")


def test_a_command_for_one_robot_refuses_a_variable_that_names_two(sent: Ran, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ELIB_ROBOT", "sim:// sim://maze")
    code, out, err = sent("version")
    assert (code, out) == (2, "")
    assert "ELIB_ROBOT" in err
    assert "--robot URL" in err
