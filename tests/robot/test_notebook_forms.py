"""How a notebook shows what robots, worlds and recordings return."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import elib
from elib.base.plaintext import Html, html_bar, html_table

FAST = "sim://red-boxes?speed=max"


def test_a_reading_is_a_table_with_units_and_bars() -> None:
    with elib.connect(FAST) as robot:
        near, battery, sensors = robot.proximity(), robot.battery(), robot.sensors()
    shown = near._repr_html_()
    assert shown.count("<tr>") == shown.count("background") == 8
    assert f">{near.front_right} counts</td>" in shown
    assert f"Proximity at {near.time:.2f} s" in shown
    assert "volts" in battery._repr_html_()
    assert "<td style='text-align:left'>-</td>" in sensors._repr_html_(), "this firmware does not have every sensor"
    assert "at nan" not in elib.Selector(3)._repr_html_()


def test_a_snapshot_shows_each_reading_its_age_and_the_picture() -> None:
    with elib.connect(FAST) as robot:
        snapshot = next(iter(robot.watch("proximity", "image")))
    shown = snapshot._repr_html_()
    assert "<img src='data:image/png;base64,iVBOR" in shown
    assert "Proximity(front_right=" in shown
    assert "s old" in shown
    picture = replace(snapshot.image, mode=elib.CameraMode.YUV)
    assert "<img" not in replace(snapshot, readings={"image": picture})._repr_html_()


def test_a_world_and_its_snapshot_are_pictures() -> None:
    world = elib.World.load("corridor")
    for shown in (world, world.snapshot()):
        assert (shown._repr_svg_() or "").startswith("<svg")


def test_a_recording_says_what_it_holds(tmp_path: Path) -> None:
    with elib.connect(FAST, name="<b>robot</b>") as robot:
        robot.record(tmp_path / "run.mcap")
        robot.proximity()
    shown = elib.read_recording(tmp_path / "run.mcap")._repr_html_()
    assert "recording run.mcap" in shown
    assert "readings/proximity 1" in shown
    assert "&lt;b&gt;robot&lt;/b&gt;" in shown, "a name from a file is text"


def test_only_html_is_taken_as_html() -> None:
    table = html_table([("<a>", "<script>", Html("<b>bold</b>"))], "<title>")
    assert "<script>" not in table
    assert "<b>bold</b>" in table
    assert "&lt;a&gt;" in table
    assert "&lt;title&gt;" in table
    assert "width:0px" in html_bar(-1)
    assert "width:120px" in html_bar(7)
