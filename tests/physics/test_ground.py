"""The ground module over white paper, black lines, grey floors, holes and the edge of the world."""

import math
import statistics

import pytest
from PIL import Image
from world_rig import room_of

from elib.simulator.physics import Colour, EpuckModel, Pose, Scene
from elib.simulator.physics.fittings import Checkers, Patch, Print, Stripe
from elib.simulator.physics.sensors.ground import PLACE_X, PLACE_Y

LEFT, CENTRE, RIGHT, CLIFF_LEFT, CLIFF_RIGHT = range(5)
QUIET = EpuckModel(sensor_noise=0)
WHITE = Colour(255, 255, 255)
MIDDLE = Pose(0.2, 0.2)


def readings(pose, *paint, floor=WHITE, model=QUIET, tick=0, engine="interpreted"):
    room = room_of(Scene(0.4, 0.4, starts=(pose,), paint=paint, floor=floor, model=model), engine=engine)
    return room.at_tick(tick).read("ground")


def test_white_paper_reads_900_and_black_100():
    assert readings(MIDDLE) == [900] * 5
    assert readings(MIDDLE, floor=Colour(0, 0, 0)) == [100] * 5


@pytest.mark.parametrize("grey", [16, 64, 128, 200])
def test_a_grey_floor_reads_by_its_brightness(grey):
    assert readings(MIDDLE, floor=Colour(grey, grey, grey)) == [round(100 + 800 * grey / 255)] * 5


def test_green_is_brighter_than_red_and_red_than_blue():
    green, red, blue = (readings(MIDDLE, floor=c)[0] for c in (Colour(0, 255, 0), Colour(255, 0, 0), Colour(0, 0, 255)))
    assert 900 > green > red > blue > 100


def test_every_reading_lies_between_black_and_white_and_grows_with_the_floor():
    seen = [readings(MIDDLE, floor=Colour(k, k, k))[0] for k in range(0, 256, 5)]
    assert seen == sorted(seen)
    assert len(set(seen)) == len(seen)


def test_a_line_is_seen_by_the_sensor_above_it():
    line = Stripe(((0.02, 0.2), (0.38, 0.2)), width=0.012)
    for aside, sensor in ((0, CENTRE), (-0.009, LEFT), (0.009, RIGHT)):
        values = readings(Pose(0.15, 0.2 + aside), line)
        assert [k for k in range(3) if values[k] < 200] == [sensor]
        assert values[sensor] == 150  # Painted in 16, 16, 16.


def test_the_sensors_turn_with_the_robot():
    line = Stripe(((0.2, 0.02), (0.2, 0.38)), width=0.012)
    up = readings(Pose(0.2 + 0.009, 0.15, math.pi / 2), line)
    down = readings(Pose(0.2 + 0.009, 0.15, -math.pi / 2), line)
    assert [k for k in range(3) if up[k] < 200] == [LEFT]
    assert [k for k in range(3) if down[k] < 200] == [RIGHT]


def test_each_sensor_looks_at_its_place():
    for sensor in range(5):
        spot = Patch(0.2 + PLACE_X[sensor] - 0.003, 0.2 + PLACE_Y[sensor] - 0.003, 0.006, 0.006, Colour(0, 0, 0))
        assert [k for k, value in enumerate(readings(MIDDLE, spot)) if value < 200] == [sensor]


def test_the_cliff_sensors_lie_under_the_body_outside_the_others():
    assert all(math.hypot(x, y) < 0.035 for x, y in zip(PLACE_X, PLACE_Y, strict=True))
    assert PLACE_Y[CLIFF_LEFT] > PLACE_Y[LEFT] > 0 > PLACE_Y[RIGHT] > PLACE_Y[CLIFF_RIGHT]


def test_a_hole_and_the_end_of_the_floor_give_next_to_nothing():
    hole = Patch(0.2, 0.1, 0.2, 0.2)
    assert readings(Pose(0.22, 0.2), hole) == [5] * 5
    assert readings(Pose(0.16, 0.2), hole) == [900] * 5
    squares = Checkers(0.1)
    assert readings(Pose(0.38, 0.2), squares)[:3] == [5, 5, 5]
    assert readings(Pose(0.02, 0.2, math.pi), squares)[:3] == [5, 5, 5]
    assert readings(Pose(0.2, 0.01, -math.pi / 2), squares)[:3] == [5, 5, 5]
    assert readings(Pose(0.2, 0.39, math.pi / 2), squares)[:3] == [5, 5, 5]


@pytest.mark.parametrize("opacity", [0, 100, 155, 255])
def test_a_picture_shows_what_lies_beneath_as_far_as_it_is_transparent(tmp_path, engine, opacity):
    Image.new("RGBA", (10, 10), (0, 0, 0, opacity)).save(tmp_path / "black.png")
    black, hole = Print(str(tmp_path / "black.png"), 0.0, 0.0, 0.4, 0.4), Patch(0.0, 0.0, 0.4, 0.4)
    grey = Colour(255 - opacity, 255 - opacity, 255 - opacity)
    assert readings(MIDDLE, black, engine=engine) == readings(MIDDLE, floor=grey)
    beneath = readings(MIDDLE, hole) if opacity < 128 else readings(MIDDLE, floor=Colour(0, 0, 0))
    assert readings(MIDDLE, hole, black, engine=engine) == beneath


def test_the_noise_is_webots_ten_per_cent():
    floor = Colour(128, 128, 128)
    centre = [readings(MIDDLE, floor=floor, model=EpuckModel(), tick=tick)[CENTRE] for tick in range(500)]
    assert statistics.fmean(centre) == pytest.approx(502, rel=0.01)
    assert statistics.stdev(centre) == pytest.approx(50, rel=0.1)
    assert max(readings(MIDDLE, model=EpuckModel(), tick=tick)[0] for tick in range(100)) == 1000


@pytest.mark.usefixtures("compiled_worlds")
def test_compiled_the_readings_are_the_same():
    paint = (Checkers(0.05), Patch(0.1, 0.1, 0.06, 0.06), Stripe(((0.1, 0.1), (0.3, 0.37))))
    for k in range(40):
        pose = Pose(0.01 * k + 0.005, 0.18 * math.sin(k) + 0.2, k)
        slow = readings(pose, *paint, model=EpuckModel(), tick=k)
        assert readings(pose, *paint, model=EpuckModel(), tick=k, engine="compiled") == slow
