"""Values for people and for programs."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

from elib.link.protocol import values as v
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.words import shared_unit, to_json, to_text

NEAR = v.Proximity(1, 2, 3, 4, 5, 6, 7, 8, time=9.0, origin="simulator")


def test_rules_are_aligned_and_carry_their_unit() -> None:
    assert to_text(v.Wheels(0.5, -0.25), 80) == "left     0.5 rev/s\nright  -0.25 rev/s"
    assert to_text(NEAR, 80).splitlines()[1] == "diagonal_right  2 counts"


def test_what_converts_is_shown_in_both_units() -> None:
    assert to_text(v.Acceleration(2048, 2048, 2816), 80).splitlines()[2] == "z  2816 counts     1.000 g"
    assert to_json(v.Acceleration(2048, 2048, 2816)) == {"x": 2048, "y": 2048, "z": 2816, "g": [0.0, 0.0, 1.0]}
    assert to_json(v.AngularVelocity(131, 0, 0)) == {
        "x": 131,
        "y": 0,
        "z": 0,
        "rad_per_s": [pytest.approx(math.radians(1)), 0.0, 0.0],
    }


def test_what_the_robot_cannot_say_is_unknown_for_people_and_null_for_programs() -> None:
    battery = v.Battery(1, None, None)
    assert to_text(battery, 80) == "raw       1 counts\nvolts     unknown\nfraction  unknown"
    assert to_json(battery) == {"raw": 1, "volts": None, "fraction": None}
    assert to_json(math.nan) is None


def test_counts_are_labelled_for_people_and_a_list_for_programs() -> None:
    ground = v.Ground(counts=(10, 20, 30))
    assert to_text(ground, 80) == "left    10 counts\ncentre  20 counts\nright   30 counts"
    assert to_json(ground) == [10, 20, 30]
    assert to_text(v.Microphones(counts=(1, 2, 3, 4, 5)), 80).splitlines()[3:] == ["front  4 counts", "4      5 counts"]


def test_yes_and_no_are_words_for_people() -> None:
    assert to_text(v.Button(pressed=True), 80) == "pressed  yes"
    assert to_json(v.Button(pressed=True)) == {"pressed": True}


def test_the_camera_mode_is_named() -> None:
    assert to_text(v.CameraSettings(1, 40, 40, 8, 3200), 80).splitlines()[0] == "mode       1 COLOUR"


def test_a_command_without_a_value_shows_nothing_and_is_null_in_json() -> None:
    assert to_text(None, 80) == ""
    assert to_json(None) is None


def test_addresses_are_shown_as_the_data_sheets_write_them() -> None:
    assert to_text([0x60, 0xC0], 80) == "0x60 (96)\n0xc0 (192)"
    assert to_text([], 80) == "none"
    assert to_json([0x60]) == [96]


def test_all_readings_at_once_take_a_line_each_and_wrap_under_themselves() -> None:
    lines = to_text(v.Sensors(proximity=NEAR, selector=v.Selector(3)), 60).splitlines()
    assert all(len(line) <= 60 for line in lines)
    assert "selector         position 3" in lines
    assert "distance         -" in lines
    first = next(index for index, line in enumerate(lines) if line.startswith("proximity"))
    assert lines[first].startswith("proximity        front_right 1, diagonal_right 2,")
    assert lines[first + 1].startswith(" " * 17)


def test_all_readings_as_json_have_every_name_and_no_time() -> None:
    value = to_json(v.Sensors(proximity=NEAR, time=3.0))
    assert isinstance(value, dict)
    assert set(value) == {item.name for item in dataclasses.fields(v.Sensors)} - {"time", "origin"}
    assert value["speed"] is None
    assert value["proximity"] == {
        "front_right": 1,
        "diagonal_right": 2,
        "right": 3,
        "rear_right": 4,
        "rear_left": 5,
        "left": 6,
        "diagonal_left": 7,
        "front_left": 8,
    }


def test_samples_are_summed_up_and_then_shown_one_by_one() -> None:
    rings = np.arange(300, dtype=np.int16).reshape(3, 100)
    text = to_text(rings, 80)
    assert text.splitlines()[0] == "right: 100 samples from 0 to 99 counts"
    assert all(len(line) <= 80 for line in text.splitlines())
    assert [int(word) for word in text.split() if word.isdigit()][3:103] == list(range(100))
    assert to_json(rings) == rings.tolist()


def test_a_picture_nobody_can_decode_keeps_its_facts() -> None:
    image = Image(CameraMode.YUV, 2, 1, bytes(4))
    assert to_text(image, 80) == "2 x 1 pixels, YUV, 4 bytes"
    assert to_json(image) == {"mode": "YUV", "width": 2, "height": 1, "pixels": None}


def test_every_kind_of_value_can_be_shown_and_survives_json() -> None:
    kinds = [
        kind
        for kind in vars(v).values()
        if isinstance(kind, type) and issubclass(kind, v.Reading) and dataclasses.fields(kind)[2:]
    ]
    assert len(kinds) > 20
    for kind in kinds:
        names = [item.name for item in dataclasses.fields(kind) if not item.kw_only]
        if kind in (v.Counts, v.InfraredRing, v.Vector):
            continue  # bases; no command returns them
        value = kind(*range(len(names))) if names else kind(counts=(1, 2, 3)) if issubclass(kind, v.Counts) else kind()
        json.dumps(to_json(value), allow_nan=False)
        text = to_text(value, 80)
        assert all(name in text for name in names)


def test_every_number_of_every_value_has_a_unit_where_there_is_one() -> None:
    for kind in (
        v.Wheels,
        v.Steps,
        v.Proximity,
        v.AmbientLight,
        v.Acceleration,
        v.Ground,
        v.Microphones,
        v.MagneticField,
    ):
        assert shared_unit(kind)
    for kind in (v.Attitude, v.Temperature, v.Distance):
        assert all(info.unit for info in v.describe(kind, v.Role.NUMBER))
    for kind in (kind for kind in vars(v).values() if isinstance(kind, type) and kind.__base__ is v.Counts):
        assert all(info.names for info in v.describe(kind, v.Role.NUMBER))
