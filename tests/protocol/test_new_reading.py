"""A new sensor is a value class: what people and programs see of it follows from its fields."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from elib.cli.board import Board, trend
from elib.link.protocol import values as v
from elib.link.protocol.words import to_json, to_text
from elib.records.decoding.words import worded
from elib.records.encoding import fields_of, numbers_in
from elib.records.messages import json_of, reading_messages, readings_in
from elib.records.reader import Entry
from elib.robot.snapshot import Snapshot
from elib.studies.comparison import compare_series
from elib.studies.scores import field_parts
from elib.studies.series import Series, series_of

PERCENT = {"info": v.FieldInfo(unit="%", span=5, form=".1f")}


@dataclass(frozen=True, slots=True, eq=False)
class Humidity(v.Numbers[float]):
    """Relative humidity inside and outside the shell."""

    inside: float = field(metadata=PERCENT)
    outside: float = field(metadata=PERCENT)
    dew_point: float = field(kw_only=True, metadata={"info": v.FieldInfo(role=v.Role.CONVERTED, unit="degrees C")})
    gain: float = field(default=3, kw_only=True, metadata={"info": v.FieldInfo(role=v.Role.CONSTANT)})


DAMP = Humidity(45.25, 60.5, dew_point=12.0, time=2.0, origin="robot")


@pytest.fixture
def generator() -> Iterator[None]:
    folder = str(Path(__file__).parents[2] / "docs")
    sys.path.insert(0, folder)
    yield
    sys.path.remove(folder)


def test_its_numbers_are_those_the_robot_sent() -> None:
    assert DAMP == (45.25, 60.5)
    assert [(info.unit, name, number) for info, name, number in v.items(DAMP, v.Role.NUMBER)] == [
        ("%", "inside", 45.25),
        ("%", "outside", 60.5),
    ]


def test_watch_shows_it_in_its_table() -> None:
    board = Board("robot")
    board.take(Snapshot(time=2, origin="robot", sequence=0, dropped=0, period=0.2, readings={"humidity": DAMP}))
    assert board.lines(2.0)[2][0].startswith("humidity      inside 45.2  outside 60.5")
    assert " %  " in board.lines(2.0)[2][0]
    assert trend(DAMP) == pytest.approx(52.875)


def test_send_prints_it_as_text_and_json() -> None:
    assert to_text(DAMP, 80).splitlines() == [
        "inside     45.25 %",
        "outside     60.5 %",
        "dew_point     12 degrees C",
    ]
    assert to_json(DAMP) == {"inside": 45.25, "outside": 60.5, "dew_point": 12.0}
    assert worded(DAMP) == "inside 45.25 %, outside 60.5 %, dew_point 12 degrees C"


def test_a_recording_has_its_fields_and_reads_its_numbers_back() -> None:
    assert list(readings_in("humidity", DAMP)) == [("humidity", DAMP)]
    assert fields_of(DAMP) == {
        "time": 2.0,
        "inside": 45.25,
        "outside": 60.5,
        "dew_point": 12.0,
        "gain": 3,
        "origin": "robot",
    }
    (message,) = reading_messages(2.0, "humidity", DAMP)
    assert json_of(message, 0).startswith(b'{"time":2.0,"inside":45.25')
    assert numbers_in(fields_of(DAMP)) == {"inside": 45.25, "outside": 60.5}


def test_compare_and_parity_see_its_numbers_alone() -> None:
    rows = [Humidity(20.0 + k % 7, 50.0, dew_point=5.0, time=k / 10) for k in range(50)]
    series = series_of([Entry(row.time, "/readings/humidity", fields_of(row)) for row in rows], 0.0)["humidity"]
    assert series.fields == ("inside", "outside")
    assert [each.field for each in compare_series("humidity", series, series)] == ["inside", "outside"]
    assert [name for name, _ in field_parts(series, series, series)] == ["inside", "outside"]


@pytest.mark.usefixtures("generator")
def test_the_reference_page_lists_its_fields_and_unit() -> None:
    from generator.values import entry

    page = entry(Humidity)
    assert "## Humidity" in page
    assert "Fields, in order: `inside` (%), `outside` (%), `dew_point` (degrees C)." in page


def test_an_accelerometer_that_is_off_by_a_hundred_counts_differs_by_a_hundred() -> None:
    times = np.arange(0, 5, 0.1)

    def read(shift: int) -> Series:
        rows = [v.Acceleration(2048 + shift, 2048 + shift, 2816 + shift, time=time) for time in times]
        entries = [Entry(row.time, "/readings/accelerometer", fields_of(row)) for row in rows]
        return series_of(entries, 0.0)["accelerometer"]

    parts = list(field_parts(read(0), read(100), read(100)))
    difference, _, _ = np.sqrt(np.mean([part for _, part in parts], axis=0))
    assert difference == 100
