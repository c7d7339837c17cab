"""The tables of a recording: their columns, their rows, and what becomes of a recording that is not whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import recorded

import elib
from elib.link.protocol.values import READING_TYPES, Role, describe
from elib.records.encoding import fields_of
from elib.records.export import export
from elib.records.recorder import Recorder
from elib.records.tables import FIXED, Tabulator, _Layout, arrays
from lanes import few_and_many

SIM = "sim://light?speed=max&firmware=epuck2&seed=3"


async def work(robot: elib.Epuck, recorder: Recorder) -> None:
    await robot.set_speed(0.3, 0.2)
    for _ in range(10):
        await robot.sensors()
        await robot.sleep(0.1)
    recorder.note("half of it", kind="state")
    await robot.image()
    with pytest.raises(elib.ReplyTimeout):
        await robot.within(0.001).proximity()
    await robot.proximity()


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tables") / "run.mcap"
    recorded(path, work, SIM, keep=None)
    return path


@pytest.fixture(scope="module")
def recording(path: Path) -> elib.records.Recording:  # type: ignore[name-defined]
    return elib.read_recording(path)


def test_pandas_takes_a_table_as_it_is(recording: Any) -> None:
    near = pandas.DataFrame(recording["proximity"])
    assert list(near)[:3] == ["time", "proximity_front_right", "proximity_diagonal_right"]
    assert list(near)[-2:] == ["robot", "origin"]
    assert len(near) == 11
    assert near["time"].dtype == np.float64
    assert near["time"].is_monotonic_increasing
    assert near["proximity_left"].dtype == np.int64
    assert near["origin"].unique().tolist() == ["simulator"]


def test_numbers_have_the_names_and_types_of_their_values(recording: Any) -> None:
    tables = recording.tables()
    for name in ("accelerometer_x", "accelerometer_g_x", "microphones_front", "gyroscope_rad_per_s_z"):
        assert name in tables[name.split("_")[0]]
    assert tables["temperature"]["temperature_celsius"].dtype == np.int64
    assert tables["button"]["button_pressed"].dtype == np.bool_
    assert tables["speed"]["speed_left"].dtype == np.float64
    assert tables["battery"]["battery_volts"].dtype == np.float64
    assert "accelerometer_zero" not in tables["accelerometer"]  # a constant


@pytest.mark.parametrize("name", READING_TYPES)
def test_every_number_of_every_reading_has_a_column_of_its_own(name: str) -> None:
    kind = READING_TYPES[name]
    numbers = describe(kind, Role.NUMBER, Role.CONVERTED, Role.PHYSICAL)
    assert all(
        f"{name}_" == column[: len(name) + 1] for column in _Layout.of(name, _message(kind)).columns if "_" in column
    )
    expected = sum(len(info.names) or 1 for info in numbers)
    assert len(_Layout.of(name, _message(kind)).cells) == expected


def _message(kind: type) -> dict[str, object]:
    """A message of a reading in which every number is 1."""
    infos = describe(kind)
    return {info.name: [1] * len(info.names) if info.names else 1 for info in infos if info.name != "time"}


def test_a_call_is_one_row_with_what_became_of_it(recording: Any) -> None:
    calls = pandas.DataFrame(recording["calls"])
    assert calls["call"].tolist() == list(range(1, len(calls) + 1))
    assert calls.loc[0, ["command", "arguments"]].tolist() == ["set_speed", "0.3, 0.2"]
    (failed,) = calls[~calls["ok"]].itertuples()
    assert failed.command == "proximity"
    assert failed.error.startswith("ReplyTimeout")
    assert (calls["seconds"] > 0).all()


def test_the_path_the_world_and_the_notes_are_tables_too(recording: Any) -> None:
    tables = recording.tables()
    assert tables["measured"]["x"].tolist() == [pose.x for pose in recording.path(measured=True)]
    assert tables["odometry"]["heading"].tolist() == [pose.heading for pose in recording.path(measured=False)]
    assert {*tables["world"]["thing"]} == {"robot", "box", "cylinder"}
    assert "half of it" in tables["notes"]["text"]
    assert {*tables} == {*recording.table_names()}


def test_a_table_that_is_not_there_is_named_with_those_that_are(recording: Any, tmp_path: Path) -> None:
    with pytest.raises(elib.ArgumentError, match="has no table 'prox'") as error:
        recording["prox"]
    assert "proximity" in error.value.hint

    async def nothing(robot: elib.Epuck, recorder: Recorder) -> None: ...

    recorded(tmp_path / "empty.mcap", nothing)
    empty = elib.read_recording(tmp_path / "empty.mcap")["calls"]
    assert [len(column) for column in empty.values()] == [0] * len(FIXED["calls"])
    assert empty["time"].dtype == np.float64


def test_a_recording_that_was_cut_off_gives_what_is_whole(path: Path, tmp_path: Path) -> None:
    content, cut = path.read_bytes(), tmp_path / "cut.mcap"
    rows = set()
    for share in (0.3, 0.6, 0.99):
        cut.write_bytes(content[: int(len(content) * share)])
        tables = elib.read_recording(cut).tables()
        rows.add(sum(len(table["time"]) for table in tables.values()))
        assert all(len({len(column) for column in table.values()}) == 1 for table in tables.values())
    assert max(rows) <= sum(len(table["time"]) for table in elib.read_recording(path).tables().values())


@few_and_many(20, 40)
def test_whatever_is_damaged_the_tables_stay_tables(examples: int, path: Path, tmp_path: Path) -> None:
    whole, bad = path.read_bytes(), tmp_path / "bad.mcap"

    @settings(max_examples=examples)
    @given(st.integers(0, 10**9), st.binary(min_size=1, max_size=60))
    def holds(place: int, junk: bytes) -> None:
        content = bytearray(whole)
        place %= len(content) - len(junk)
        content[place : place + len(junk)] = junk
        bad.write_bytes(content)
        try:
            recording = elib.read_recording(bad)
            tables = recording.tables()
        except elib.ArgumentError:
            return  # its header is damaged
        assert all(len({len(column) for column in table.values()}) == 1 for table in tables.values())
        export(recording, tmp_path / "out", "csv", replace=True) if tables else None

    holds()


Sent = tuple[str, dict[str, Any]]


def rows(*messages: Sent) -> tuple[dict[str, Any], int]:
    tabulator = Tabulator({"robot": "Ada"})
    batches = dict(tabulator.batches(messages))
    return {name: arrays(tabulator.columns[name], [found]) for name, found in batches.items()}, tabulator.misfits


def test_a_reading_with_other_fields_is_left_out_and_counted() -> None:
    near = {**fields_of(elib.Proximity(time=1.0)), "time": 1.0}
    found, misfits = rows(
        ("/readings/proximity", near),
        ("/readings/proximity", {"time": 2.0, "front_left": [[1]]}),
        ("/readings/proximity", {**near, "left": "text"}),
        ("/readings/../../evil", {"time": 1.0}),
        ("/readings/calls", {"time": 1.0}),
        ("/readings/" + "x" * 300, {"time": 1.0}),
    )
    assert {name: len(table["time"]) for name, table in found.items()} == {"proximity": 1}
    assert misfits == 5


def test_a_gap_in_whole_numbers_is_nan() -> None:
    near = fields_of(elib.Proximity(time=1.0))
    found, _ = rows(*(("/readings/proximity", {**near, "left": left}) for left in (3, None)))
    assert found["proximity"]["proximity_left"].tolist() == [3.0, pytest.approx(np.nan, nan_ok=True)]


def test_a_long_text_does_not_make_all_others_of_its_column_as_wide() -> None:
    data = {"time": 1.0, "name": "note", "event": "", "level": 2}
    found, _ = rows(*(("/notes", {**data, "message": text}) for text in ("x" * 500_000, *["short"] * 40)))
    assert found["notes"]["text"].tolist() == ["x" * 500_000, *["short"] * 40]
    assert found["notes"]["text"].nbytes < 1000
    assert found["notes"]["kind"].dtype.kind == "U"


@pytest.mark.parametrize(
    ("command", "text", "arguments"),
    [
        ("stop", "stop()", ""),
        ("set_speed", "set_speed(0.3, 0.2)", "0.3, 0.2"),
        ("sensors", "watch(proximity, encoders)", "proximity, encoders"),
        ("set_speed", "text('D,0,(0)')", "'D,0,(0)'"),
    ],
)
def test_the_arguments_of_a_call_are_what_stands_in_its_parentheses(command: str, text: str, arguments: str) -> None:
    found, _ = rows(("/calls", {"time": 1.0, "call": 1, "command": command, "text": text}))
    assert found["calls"]["arguments"].tolist() == [arguments]


def test_calls_come_in_their_order_and_those_without_an_end_come_last() -> None:
    def call(number: int) -> Sent:
        return ("/calls", {"time": float(number), "call": number, "command": "stop", "text": "stop()"})

    def end(number: int, time: float) -> Sent:
        data = {
            "time": time,
            "call": number,
            "command": "stop",
            "ok": True,
            "error": "",
            "waited": 0.5,
            "round_trip": None,
        }
        return ("/outcomes", data)

    found, _ = rows(end(0, 0.7), call(1), call(2), call(3), end(2, 3.5), end(1, 4.0))
    assert found["calls"]["call"].tolist() == [0, 1, 2, 3]
    assert found["calls"]["time"].tolist() == [pytest.approx(0.2), 1, 2, 3]
    assert found["calls"]["ok"].tolist() == [True, True, True, None]
    found, _ = rows(call(1), end(0, 1.1), end(0, 1.2), end(1, 1.5))
    assert found["calls"]["call"].tolist() == [0, 0, 1], "each call that was made before has a row of its own"
    assert found["calls"]["time"].tolist() == pytest.approx([0.6, 0.7, 1])
