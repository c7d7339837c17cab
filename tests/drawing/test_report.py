"""The page of a performance."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import install
from elib.simulator.physics import World
from elib.studies.report import Chart, _broken, check_report, draw_report


def test_a_line_is_broken_where_nothing_was_read_for_long():
    times, values = _broken([0.0, 0.1, 10.0, 10.1], [1.0, 2.0, 3.0, 4.0])
    assert [value for value in values if not math.isnan(value)] == [1.0, 2.0, 3.0, 4.0]
    assert math.isnan(values[2])
    assert 0.1 < times[2] < 10.0


def test_the_page_has_a_map_and_a_chart_for_each_kind_of_reading(tmp_path: Path):
    world = World.load("square")
    chart = Chart("wheels, rev/s", [0.0, 1.0], [[0.1, 0.2], [0.2, 0.1]], ["left", "right"], is_stepped=True)
    page = {
        "title": "a run",
        "trails": [world.poses],
        "states": [(0.0, "driving"), (0.5, "turning")],
        "seconds": 1.0,
    }
    draw_report(tmp_path / "both.png", floor=world.snapshot(), charts=[chart, chart], **page)
    draw_report(tmp_path / "map.png", floor=world.snapshot(), charts=[], **page)
    draw_report(tmp_path / "chart.svg", floor=None, charts=[chart], **page)
    assert (tmp_path / "both.png").stat().st_size > (tmp_path / "map.png").stat().st_size > 5_000
    assert (tmp_path / "chart.svg").read_text().startswith("<?xml")


def test_a_name_that_ends_otherwise_is_refused(tmp_path: Path):
    with pytest.raises(ArgumentError, match=r"its name must end in .png, .svg, .pdf"):
        check_report(tmp_path / "run.txt")


def test_without_matplotlib_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(Unsupported) as caught:
        check_report("run.png")
    assert caught.value.hint == install("plot")
