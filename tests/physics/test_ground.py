"""The ground module over white paper, black lines, grey floors, holes and the edge of the world."""

import math
import statistics
from itertools import chain

import pytest
from PIL import Image
from world_rig import room_of

from elib.simulator.physics import Colour, EpuckModel, Pose, Scene, World
from elib.simulator.physics.fittings import Checkers, Patch, Print, Stripe
from elib.simulator.physics.sensors.ground import PLACE_X, PLACE_Y

LEFT, CENTRE, RIGHT, CLIFF_LEFT, CLIFF_RIGHT = range(5)
QUIET = EpuckModel(sensor_noise=0, quality="ideal")
WHITE = Colour(255, 255, 255)
BLACK_PAINT = Colour(0, 0, 0)
DARK = 500  # counts, below those of a line's edge
MIDDLE = Pose(0.2, 0.2)


def readings(pose, *paint, floor=WHITE, model=QUIET, tick=0, engine="interpreted"):
    room = room_of(Scene(0.4, 0.4, starts=(pose,), paint=paint, floor=floor, model=model), engine=engine)
    return room.at_tick(tick).read("ground")


def test_white_paper_reads_960_and_black_325_on_an_ideal_robot():
    assert readings(MIDDLE) == [960] * 5
    assert readings(MIDDLE, floor=BLACK_PAINT) == [325] * 5


@pytest.mark.parametrize(
    ("print_of", "share"),
    [(80, 0.17), (70, 0.25), (60, 0.35), (50, 0.45), (40, 0.655), (30, 0.895), (20, 0.985), (10, 1), (0, 1)],
)
def test_a_printed_grey_reads_what_a_real_robot_read_of_it(print_of, share):
    grey = round(255 * (1 - print_of / 100))
    expected = 325 + (960 - 325) * share
    assert readings(MIDDLE, floor=Colour(grey, grey, grey)) == pytest.approx([expected] * 5, abs=4)


@pytest.mark.parametrize("tape", ["#c02020", "#108030", "#2060c0", "#e0c020", "#ff0000", "#00ff00", "#0000ff"])
def test_coloured_tape_is_white_in_the_infrared(tape):
    assert min(readings(MIDDLE, floor=Colour.parse(tape))) > 960 - 20


def test_a_trace_of_colour_in_black_paint_leaves_it_black():
    assert max(readings(MIDDLE, floor=Colour(3, 0, 2))) < 325 + 40


def test_every_reading_lies_between_black_and_white_and_grows_with_the_floor():
    seen = [readings(MIDDLE, floor=Colour(k, k, k))[0] for k in range(0, 256, 5)]
    assert seen == sorted(seen)
    below_white = [count for count in seen if count < 960]
    assert len(set(below_white)) == len(below_white) > 40


def test_a_line_is_seen_by_the_sensor_above_it():
    line = Stripe(((0.02, 0.2), (0.38, 0.2)), width=0.012)
    for aside, sensor in ((0, CENTRE), (-0.009, LEFT), (0.009, RIGHT)):
        values = readings(Pose(0.15, 0.2 + aside), line)
        assert [k for k in range(3) if values[k] < DARK] == [sensor]
        assert values[sensor] == round(325 + (960 - 325) * 0.85 * 16 / 255)  # Painted in 16, 16, 16.


def test_the_sensors_turn_with_the_robot():
    line = Stripe(((0.2, 0.02), (0.2, 0.38)), width=0.012)
    up = readings(Pose(0.2 + 0.009, 0.15, math.pi / 2), line)
    down = readings(Pose(0.2 + 0.009, 0.15, -math.pi / 2), line)
    assert [k for k in range(3) if up[k] < DARK] == [LEFT]
    assert [k for k in range(3) if down[k] < DARK] == [RIGHT]


def test_each_sensor_looks_at_its_place():
    for sensor in range(5):
        spot = Patch(0.2 + PLACE_X[sensor] - 0.003, 0.2 + PLACE_Y[sensor] - 0.003, 0.006, 0.006, Colour(0, 0, 0))
        assert [k for k, value in enumerate(readings(MIDDLE, spot)) if value < DARK] == [sensor]


def test_the_cliff_sensors_lie_under_the_body_outside_the_others():
    assert all(math.hypot(x, y) < 0.035 for x, y in zip(PLACE_X, PLACE_Y, strict=True))
    assert PLACE_Y[CLIFF_LEFT] > PLACE_Y[LEFT] > 0 > PLACE_Y[RIGHT] > PLACE_Y[CLIFF_RIGHT]


def test_a_hole_and_the_end_of_the_floor_give_next_to_nothing():
    hole = Patch(0.2, 0.1, 0.2, 0.2)
    assert readings(Pose(0.22, 0.2), hole) == [5] * 5
    assert readings(Pose(0.16, 0.2), hole) == [960] * 5
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


@pytest.mark.parametrize(
    ("quality", "is_driving", "deviation"),
    [("ideal", False, 0.7), ("ideal", True, 0.7), ("typical", False, 0.7), ("typical", True, 1.8), ("bad", True, 2.9)],
)
def test_the_noise_grows_while_a_real_robot_drives(quality, is_driving, deviation):
    model = EpuckModel(quality=quality)
    room = room_of(Scene(0.4, 0.4, starts=(MIDDLE,), floor=Colour(128, 128, 128), model=model))
    room.robots[0].left_speed = 0.05 if is_driving else 0.0
    seen = [room.at_tick(tick).read("ground")[CENTRE] for tick in range(0, 20_000, 10)]
    assert statistics.stdev(seen) == pytest.approx(math.sqrt(deviation**2 + 1 / 12), rel=0.06)  # 1/12: whole counts.


def test_two_readings_22_ms_apart_are_alike_as_on_a_real_robot():
    room = room_of(
        Scene(0.4, 0.4, starts=(MIDDLE,), model=EpuckModel(sensor_noise=3, quality="ideal"), floor=WHITE, step=1 / 46)
    )
    seen = [room.at_tick(tick).read("ground")[CENTRE] for tick in range(5000)]
    assert 0.81 < statistics.correlation(seen[1:], seen[:-1]) < 0.95


def levels(quality, robots=1000):
    """What the ground sensors of many robots read over black, and over white: a list of three for each robot."""
    world = World(Scene(10, 10, model=EpuckModel(quality=quality)), robots=robots)
    rows = world.records.robots
    return [list(robot.black[:3]) for robot in rows], [list(robot.white[:3]) for robot in rows]


def test_ideal_robots_are_all_alike():
    black, white = levels("ideal", 5)
    assert black == [[325.0] * 3] * 5
    assert white == [[960.0] * 3] * 5


def test_typical_robots_differ_over_black_as_ninety_sensors_of_real_ones_did():
    black, white = levels("typical")
    every = sorted(count for robot in black for count in robot)
    assert statistics.fmean(every) == pytest.approx(326, abs=10)
    assert statistics.stdev(every) == pytest.approx(118, abs=8)
    for part, real in ((0.05, 179), (0.5, 294), (0.95, 585)):
        assert every[int(part * len(every))] == pytest.approx(real, abs=30)
    assert statistics.fmean(map(statistics.stdev, black)) == pytest.approx(73, abs=15)  # within a robot
    bright = [count for robot in white for count in robot]
    assert statistics.fmean(bright) == pytest.approx(960, abs=1)
    assert statistics.stdev(bright) == pytest.approx(8, abs=0.5)


@pytest.mark.parametrize(("quality", "spread"), [("good", 0.5), ("bad", 2.0)])
def test_the_spread_of_good_and_bad_robots_is_half_and_twice_that_of_typical_ones(quality, spread):
    (black, white), (typical, typical_white) = levels(quality, 200), levels("typical", 200)
    for mean, some, others in ((325, black, typical), (960, white, typical_white)):
        for count, other in zip(chain(*some), chain(*others), strict=True):
            if {count, other}.isdisjoint((79.0, 750.0)):  # The darkest and the brightest black that there are.
                assert count - mean == pytest.approx(spread * (other - mean))
    assert 79 <= min(map(min, black)) < max(map(max, black)) <= 750 < min(map(min, white)) - 100


@pytest.mark.usefixtures("compiled_worlds")
def test_compiled_the_readings_are_the_same():
    paint = (Checkers(0.05), Patch(0.1, 0.1, 0.06, 0.06), Stripe(((0.1, 0.1), (0.3, 0.37))))
    for k in range(40):
        pose = Pose(0.01 * k + 0.005, 0.18 * math.sin(k) + 0.2, k)
        model = EpuckModel(quality=("ideal", "good", "typical", "bad")[k % 4])
        slow = readings(pose, *paint, model=model, tick=k)
        assert readings(pose, *paint, model=model, tick=k, engine="compiled") == slow
