"""What the panel shows: every number with its unit and its age, as JSON."""

from __future__ import annotations

import asyncio
import base64
import json
import math
import random
from typing import Any

import msgspec
import numpy as np
import pytest
import pytest_asyncio
from msgspec import Struct

from elib.base.pose import Pose
from elib.base.timebase import SimulatedLoop
from elib.link.protocol import values as v
from elib.link.protocol.profiles import PROFILES
from elib.panel.gauges import instruments, numbers
from elib.panel.server.instruments import MAX_POINTS, Cursor, scheme, summary, tick
from elib.panel.slot import Slot
from elib.robot.snapshot import SENSORS
from elib.testing.inside import transport_of
from shared import until

# clock: simulated
LOOP = SimulatedLoop
SIM = "sim://square?speed=max"


@pytest_asyncio.fixture
async def slot(slot: Slot) -> Slot:
    await asyncio.sleep(0.5)
    return slot


def told(what: Struct) -> Any:
    """Return something as the page gets it."""
    return json.loads(msgspec.json.encode(what))


def seen(slot: Slot, cursor: Cursor | None = None) -> Any:
    """Return a tick as the page gets it."""
    return told(tick(slot, cursor))


def test_a_charge_is_in_percent_and_yes_and_no_are_no_numbers() -> None:
    gauges = {each.name: each for each in instruments()}
    assert gauges["battery"].units[2] == "%"
    assert list(numbers(v.Battery(900, 3.67, 0.372))) == [900, 3.67, pytest.approx(37.2)]
    assert list(numbers(v.Battery(900, None, None))) == [900, None, None]
    assert numbers(v.Button(pressed=True))[0] is True
    assert numbers(v.SdCard(present=False))[0] is False


def test_every_reading_of_every_firmware_has_an_instrument() -> None:
    for firmware in ("", *PROFILES):
        there = instruments(firmware)
        assert [each.name for each in there] == list(SENSORS)
        assert all(len(each.labels) == len(each.units) for each in there)
        assert all(each.low is None or each.high is None or each.low < each.high for each in there)


async def test_before_the_first_reading_nothing_is_known_and_all_is_grey() -> None:
    slot = Slot(SIM)
    shown = seen(slot)
    assert (shown["phase"], shown["link"], shown["pose"], shown["picture"]) == ("disconnected", None, None, None)
    assert set(shown["readings"]) == set(SENSORS)
    assert shown["readings"]["proximity"] == {"values": None, "physical": None, "age": None, "stale": True}
    assert (slot.watcher.age("encoders"), slot.is_stale("encoders")) == (math.inf, True)


@pytest.mark.parametrize("firmware", PROFILES)
async def test_readings_come_with_unit_and_age_and_absent_ones_with_the_reason(slot: Slot, firmware: str) -> None:
    absent = PROFILES[firmware].absent
    about = told(scheme(slot))
    assert about["firmware"] == firmware
    assert {each["name"] for each in about["instruments"] if each["absent"]} == set(SENSORS) & set(absent)
    readings = seen(slot)["readings"]
    assert set(readings) == set(SENSORS) - set(absent)
    for each in about["instruments"]:
        if not each["absent"]:
            reading = readings[each["name"]]
            assert 0 < len(reading["values"]) <= len(each["labels"]) == len(each["units"])
            assert 0 <= reading["age"] < 0.3
            assert not reading["stale"]
    up = readings["accelerometer"]["physical"][2]
    assert up == pytest.approx(1, abs=0.2)


@pytest.mark.parametrize("firmware", PROFILES)
async def test_the_wheels_show_what_they_were_told_by_the_console_and_by_a_behaviour(slot: Slot, firmware: str) -> None:
    slot.join("page")
    await slot.command("set_speed", 0.5, -0.25, page="page")
    drive = seen(slot)["drive"]
    assert (drive["left"], drive["right"]) == (0.5, -0.25)
    slot.stop()
    await asyncio.sleep(0.5)
    drive = seen(slot)["drive"]
    assert (drive["left"], drive["right"]) == (0, 0)
    slot.runner.start("avoid", {"cruise": 0.5})
    await asyncio.sleep(1)
    drive = seen(slot)["drive"]
    assert abs(drive["left"]) + abs(drive["right"]) > 0.3


async def test_with_the_link_cut_the_last_values_stay_and_turn_grey(slot: Slot) -> None:
    before = seen(slot)["readings"]["accelerometer"]
    transport = transport_of(slot.robot)
    transport.lose("pulled")
    await asyncio.sleep(0.05)
    cut = seen(slot)
    assert (cut["phase"], cut["phase_text"]) == ("gap", "connection lost, trying again")
    assert len(cut["readings"]["accelerometer"]["values"]) == len(before["values"])
    assert cut["readings"]["accelerometer"]["stale"]


async def test_the_helm_and_the_lamps_are_shown_as_they_were_set(slot: Slot) -> None:
    slot.drive.limit_to(0.4)
    slot.drive.steer("page", 1, -0.5)
    await slot.command("set_led", 3, 1)
    await slot.command("set_body_led", "ON")
    await asyncio.sleep(0.1)
    shown = seen(slot)
    assert shown["drive"] == {
        "driver": "page",
        "left": 0.4,
        "right": -0.2,
        "limit": 0.4,
        "may_move": True,
        "trouble": "",
    }
    assert scheme(slot).fastest == 1.0
    assert shown["lamps"] == {"ring": [0, 0, 0, 1, 0, 0, 0, 0], "body": 1, "front": 0, "rgb": None}
    assert shown["camera"] == {"width": 24, "height": 18, "zoom": 20, "mode": "COLOUR"}


@pytest.mark.parametrize("firmware", ["epuck2"])
async def test_an_epuck2_has_colours_and_is_a_little_faster(slot: Slot) -> None:
    await slot.command("set_rgb_led", 3, 0.5, 0, 1)
    shown = seen(slot)
    assert shown["lamps"]["rgb"] == [[0, 0, 0], [50, 0, 100], [0, 0, 0], [0, 0, 0]]
    assert scheme(slot).fastest == 1.1


async def test_a_picture_is_sent_once_to_each_page(slot: Slot) -> None:
    one, other = Cursor(), Cursor()
    slot.watch_camera(0.5)
    await asyncio.sleep(2)
    picture = seen(slot, one)["picture"]
    assert (picture["width"], picture["height"], picture["mode"]) == (24, 18, "COLOUR")
    assert base64.b64decode(picture["pixels"]) == slot.readings["image"].pixels.tobytes()  # type: ignore[union-attr]
    assert seen(slot, one)["picture"]["pixels"] is None
    assert seen(slot, other)["picture"]["pixels"] is not None
    await asyncio.sleep(1)
    assert seen(slot, one)["picture"]["pixels"] is not None


async def test_trail_and_event_log_come_in_pieces_and_only_what_is_new(slot: Slot) -> None:
    cursor = Cursor()
    seen(slot, cursor)
    for tenth in range(1200):
        slot.watcher.put(Pose(tenth / 1000, 0.1))
    sizes = []
    for _ in range(4):
        trail = seen(slot, cursor)["trail"]
        assert not trail["whole"]
        sizes.append(len(trail["points"]))
    assert sizes == [MAX_POINTS, MAX_POINTS, 200, 0]
    slot.log.note("<script>alert(1)</script>" + "a" * 5000)
    lines = seen(slot, cursor)["lines"]
    assert (lines["whole"], len(lines["lines"])) == (False, 1)
    assert lines["lines"][0]["text"].startswith("<script>")
    assert len(lines["lines"][0]["text"]) < 2100
    assert lines["lines"][0]["number"] == slot.log.count - 1
    assert seen(slot)["trail"]["whole"]


async def test_a_page_that_fell_behind_or_a_new_journey_begins_the_trail_anew(slot: Slot) -> None:
    cursor = Cursor()
    seen(slot, cursor)
    for tenth in range(6000):
        slot.watcher.put(Pose(tenth / 1000, 0.1))
    trail = seen(slot, cursor)["trail"]
    assert trail["whole"]
    assert trail["points"][0] == [1.0, 0.1]
    await slot.disconnect()
    await slot.connect()
    await asyncio.sleep(0.5)
    trail = seen(slot, cursor)["trail"]
    assert (trail["whole"], len(trail["points"])) == (True, 1)


@pytest.mark.parametrize("url", [f"{SIM}&latency=0.02"])
async def test_the_link_is_shown_in_numbers_that_can_be_counted_on(slot: Slot) -> None:
    link = seen(slot)["link"]
    assert link["median"] == pytest.approx(0.045, abs=0.02)
    assert (link["lost"], link["loss"], link["waiting"]) == (0, 0, 0)
    assert link["count"] > 5


async def test_a_failure_is_shown_with_what_the_doctor_found() -> None:
    slot = Slot("serial:///dev/elib-nowhere")
    await slot.connect()
    for _ in range(100):
        await asyncio.sleep(0.1)
        if slot.diagnosis is not None:
            break
    shown = seen(slot)
    assert shown["phase"] == "failed"
    assert "elib-nowhere" in shown["error"]["message"]
    assert not slot.diagnosis.ok
    assert {"name", "state", "detail", "fix"} == set(shown["doctor"][0])
    await slot.disconnect()


async def test_the_scheme_is_asked_for_again_after_each_connection() -> None:
    slot = Slot(SIM)
    numbers = [scheme(slot).scheme]
    await slot.connect()
    numbers.append(scheme(slot).scheme)
    await slot.disconnect()
    numbers.append(scheme(slot).scheme)
    assert len(set(numbers)) == 3
    assert scheme(slot).firmware == ""


async def test_what_a_typical_robot_reads_in_the_open_is_no_distance_and_a_wall_is_one() -> None:
    slot = Slot("sim://square?quality=typical&firmware=asercom-1.2.2")
    try:
        await slot.connect()
        await until(lambda: "proximity" in slot.readings)
        assert max(slot.readings["proximity"]) > 60
        assert seen(slot)["distances"] == [None] * 8
        assert slot.control is not None
        slot.control.move_robot(0, 0.05, slot.control.world.scene.depth / 2, math.pi)
        await until(lambda: seen(slot)["distances"][0] is not None)
        assert 0.005 < seen(slot)["distances"][0] < 0.03
    finally:
        await slot.disconnect()


async def test_an_overview_is_small(slot: Slot) -> None:
    text = msgspec.json.encode(summary(slot))
    assert len(text) < 500
    assert json.loads(text)["phase"] == "connected"
    assert len(json.loads(text)["distances"]) == 8


@pytest.mark.parametrize(("url", "is_plugged_in"), [(SIM, False), ("sim://line?speed=max", True)])
async def test_a_ground_module_that_is_not_plugged_in_is_unknown_and_not_minus_one(
    slot: Slot, is_plugged_in: bool
) -> None:
    values = seen(slot)["readings"]["ground"]["values"]
    assert all(value >= 0 for value in values[:3]) if is_plugged_in else values == [None] * 5


@pytest.mark.parametrize("seed", range(5))
async def test_the_parts_of_a_map_that_pages_are_told_at_any_moments_are_the_map(seed: int) -> None:
    draw = random.Random(seed)
    slot, cursor = Slot(SIM), Cursor()
    place, seen_map, whole = Pose(0, 0, 0), np.zeros((0, 0), np.int8), 0
    for step in range(400):
        if step == 300:
            slot.watcher.forget()  # the robot was connected again
        turned = place.heading + draw.uniform(-0.5, 0.5)
        place = Pose(place.x + 0.01 * math.cos(turned), place.y + 0.01 * math.sin(turned), turned)
        counts = [draw.choice([0, 0, 0, draw.randint(1, 3000)]) for _ in range(8)]
        slot.watcher.note("proximity", v.Proximity(*counts))
        slot.watcher.put(place)
        if draw.random() < 0.1 and (part := seen(slot, cursor)["map"]):
            squares = np.frombuffer(base64.b64decode(part["squares"]), np.int8).reshape(-1, part["width"])
            if seen_map.shape != (part["rows"], part["columns"]) or part["width"] == part["columns"]:
                seen_map = np.zeros((part["rows"], part["columns"]), np.int8)
                whole += 1
            row, column = part["at"]
            seen_map[row : row + len(squares), column : column + part["width"]] = squares
            grid = slot.watcher.map
            assert ((seen_map > 0) == (np.rint(grid.odds * 127 / 4) > 0)).all()
            assert ((seen_map < 0) == (np.rint(grid.odds * 127 / 4) < 0)).all()
            assert seen(slot, cursor)["map"] is None
    assert 2 <= whole < 20
