"""How bright the camera sees things: the room, lamps, its own front LED, and the LEDs of others."""

import math

import numpy as np
import pytest
from camera_rig import NOTHING, Cameras, showing, window
from world_rig import IDEAL

from elib.base.body import FOCAL, LENS
from elib.simulator.physics import Box, Colour, Cylinder, Pose, Scene
from elib.simulator.physics.fittings import Light
from elib.simulator.physics.optics import ABOVE
from elib.simulator.physics.sensors.brightness import LampArrays, decay, exposure, lamp_light, led_light, room_light

CHIP = window(640, 480, 1)
SMALL = window(40, 40, 8)
GREEN = 0x10E020
GREY = Colour(90, 90, 90)
PAIR = (Pose(0.5, 0.5), Pose(0.7, 0.5, math.pi))


def seen(*, starts=PAIR, lamps=NOTHING, ambient=3750.0, at=CHIP, lights=(), **things):
    return Cameras(Scene(1, 1, starts=starts, lights=lights, **things), lamps=lamps).picture(*at, ambient=ambient)


def greenish(picture):
    whole = picture.astype(int)
    return (whole[:, :, 1] > 180) & (whole[:, :, 0] < 60) & (whole[:, :, 2] < 60)


def test_a_room_is_as_light_as_its_reading_is_below_that_of_the_dark():
    assert [room_light(counts) for counts in (3750.0, 4095.0, 4500.0)] == [1.0, 0.0, 0.0]
    assert room_light(3405.0) == pytest.approx(2.0)


def test_the_exposure_keeps_the_brightness_from_a_quarter_to_eight_times_the_usual_light():
    assert [light * exposure(light) for light in (0.25, 0.5, 1.0, 3.0, 8.0)] == pytest.approx([1.0] * 5)
    assert 0.125 * exposure(0.125) == pytest.approx(0.5)
    assert 12.0 * exposure(12.0) == pytest.approx(1.5)
    assert exposure(0.0) == 4.0


def test_the_darker_the_room_the_darker_the_picture_below_what_the_exposure_makes_up_for():
    means = [seen(ambient=counts).mean() for counts in (0.0, 3000.0, 3750.0, 4000.0, 4050.0, 4085.0, 4095.0)]
    assert means[1] == pytest.approx(means[2], abs=1)
    assert means[3] == pytest.approx(means[2], abs=1)
    assert means[0] > means[2] + 10
    assert means[3] > means[4] + 20 > means[5] + 40
    assert means[6] == 0.0


@pytest.mark.parametrize("led", range(8))
def test_a_ring_led_is_seen_from_where_it_sits_and_not_from_behind(led):
    places = ((33.7, 0), (22, -25), (0, -33.7), (-27, -20.1), (-33, 0), (-27, 20.1), (0, 33.7), (22, 25))
    bearing = math.atan2(places[led][1], places[led][0])
    for turned, is_seen in ((0.0, True), (0.6, True), (-0.6, True), (math.pi, False)):
        other = Pose(0.7, 0.5, math.pi - bearing + turned)
        picture = seen(starts=(PAIR[0], other), lamps=showing(2, {1: {led: GREEN}}))
        spot = greenish(picture)
        assert spot.any() == is_seen
        if is_seen:
            rows, columns = np.nonzero(spot)
            ahead = 0.2 - 0.037 * math.cos(turned) - LENS
            aside = 0.037 * math.sin(turned)  # Turned to its left, what faced us moves to our right.
            assert columns.mean() == pytest.approx(319.5 + FOCAL * aside / ahead, abs=8)
            assert rows.mean() == pytest.approx(239.5 - FOCAL * (0.041 - ABOVE) / ahead, abs=3)


def test_each_led_has_its_own_colour():
    lamps = showing(2, {1: {0: 0xFF0000, 1: 0x0000FF, 7: 0x00FF00}})
    row = seen(lamps=lamps)[int(239.5 - FOCAL * (0.041 - ABOVE) / 0.133)].astype(int)
    # It looks at us: its right is our left.
    order = [np.nonzero(row[:, k] - row.sum(axis=1) + row[:, k] > 120)[0].mean() for k in (2, 0, 1)]
    assert order == sorted(order)
    assert order[1] == pytest.approx(319.5, abs=3)


def test_a_hidden_led_is_not_seen():
    lamps = showing(2, {1: {0: GREEN}})
    assert greenish(seen(lamps=lamps)).any()
    assert not greenish(seen(lamps=lamps, boxes=(Box(0.6, 0.5, 0.02, 0.2),))).any()


def test_a_lit_body_glows_green():
    dark, lit = seen(), seen(lamps=showing(2, {1: {8: 1}}))
    body = 240, 320
    assert lit[body][1] > dark[body][1] + 50
    assert int(lit[body][1]) > int(lit[body][0]) + 40


def test_the_front_led_of_another_robot_shines_on_its_right():
    lit = seen(lamps=showing(2, {1: {9: 1}})).astype(int)
    rows, columns = np.nonzero((lit[:, :, 0] > 230) & (lit[:, :, 2] < 100))
    ahead = 0.2 - 0.037 * 0.9275 - LENS
    assert columns.mean() == pytest.approx(319.5 - FOCAL * 0.037 * 0.3739 / ahead, abs=3)
    assert rows.mean() == pytest.approx(239.5 - FOCAL * (0.0285 - ABOVE) / ahead, abs=3)


def test_leds_shine_in_the_dark_and_fade_in_glaring_light():
    lamps = showing(2, {1: {0: GREEN}})
    dark = seen(lamps=lamps, ambient=4095.0)
    assert greenish(dark).any()
    assert not dark[:130].any()
    assert not greenish(seen(lamps=lamps, ambient=100.0)).any()


def test_a_robots_own_front_led_lights_what_is_near_in_a_warm_colour():
    at = window(80, 60, 8)
    lit = showing(1, {0: {9: 1}})
    for ambient in (3750.0, 4050.0, 4095.0):
        gains = []
        for box in (Box(0.69, 0.5, 0.04, 0.2, colour=GREY), Box(0.97, 0.5, 0.04, 0.9, colour=GREY)):
            without, with_led = (
                seen(starts=PAIR[:1], boxes=(box,), lamps=lamps, ambient=ambient, at=at)[29, 41].astype(int)
                for lamps in (NOTHING, lit)
            )
            gain = with_led - without
            assert gain[0] >= gain[1] >= gain[2] >= 0
            gains.append(gain[0])
        assert gains[0] > gains[1] + 5
    floor = seen(starts=PAIR[:1], lamps=lit, ambient=4095.0, at=at)[37:, 41].astype(int)
    assert (floor[:, 0] > floor[:, 1]).all()
    assert floor[-1, 0] > floor[0, 0]


def test_the_front_led_falls_to_half_within_8_cm_and_lights_ahead_more_than_aside():
    assert led_light(0.08, 0.0125) == pytest.approx(led_light(1e-6, 0.0125) / 2)
    assert led_light(0.1, 0.1) < 0.5 * led_light(0.1, 0.0)
    assert led_light(0.1, 0.1) > led_light(0.1, -0.1)


def test_a_robot_that_shows_nothing_lights_nothing():
    only_other = showing(2, {1: {4: GREEN}})  # On its far side.
    assert (seen(lamps=only_other) == seen()).all()


def test_lamps_add_up_and_fall_as_the_infrared_sensors_have_it():
    assert [decay(x) for x in (0.0, 1.0, 5.0, 10.0)] == pytest.approx([math.exp(-x) for x in (0, 1, 5, 10)], rel=1e-3)
    assert decay(100.0) == 0.0
    two = LampArrays(*np.array(((0.0, 0.0), (0.0, 1.0), (0.1, 0.1), (1.0, 0.5))))
    expected = 4095 / 345 * (math.exp(-2 * 0.5) + math.exp(-4 * math.hypot(0.5, 1.0)))
    assert lamp_light(np.array(0.5), np.array(0.0), 0.1, two) == pytest.approx(expected, rel=1e-3)


def test_a_lamp_is_a_bright_spot_at_its_height_unless_something_hides_it():
    lamp = Light(0.9, 0.45, 0.06, 0.3)

    def spot(**things):
        picture = seen(starts=PAIR[:1], lights=(lamp,), ambient=4000.0, **things)
        return np.nonzero((picture == (255, 252, 236)).all(axis=2))

    rows, columns = spot()
    depth = 0.4 - LENS
    assert columns.mean() == pytest.approx(319.5 + FOCAL * 0.05 / depth, abs=1)
    assert rows.mean() == pytest.approx(239.5 - FOCAL * (0.06 - ABOVE) / depth, abs=1)
    assert np.ptp(rows) + 1 == pytest.approx(FOCAL * 0.02 / depth, abs=2)
    assert len(spot(boxes=(Box(0.7, 0.45, 0.02, 0.2, height=0.2),))[0]) == 0
    assert len(spot(boxes=(Box(0.7, 0.45, 0.02, 0.2, height=0.03),))[0]) == len(rows)
    assert len(spot(boxes=(Box(0.95, 0.45, 0.02, 0.2, height=0.2),))[0]) == len(rows)  # Behind it.


def test_a_distant_lamp_is_never_lost_between_two_pixels():
    for k in range(20):
        starts = (Pose(0.5, 5 + 0.003 * k),)
        room = Scene(10, 10, starts=starts, lights=(Light(9.5, 5, 0.05 + 0.01 * k, 2.0),), model=IDEAL)
        assert (Cameras(room).picture(*SMALL) == (255, 252, 236)).all(axis=2).any()


def test_a_lamp_lights_what_is_near_it():
    posts = tuple(Cylinder(0.8, y, 0.02, colour=Colour(120, 120, 120)) for y in (0.42, 0.58))
    lamp = Light(0.78, 0.35, 0.05, 0.3)
    picture = seen(starts=PAIR[:1], cylinders=posts, lights=(lamp,), ambient=4095.0).astype(int)
    aside = FOCAL * 0.08 / (0.3 - 0.02 - LENS)
    near, far = picture[240, round(319.5 + aside)], picture[240, round(319.5 - aside)]
    assert near.sum() > far.sum() + 30
    floor = picture[330]
    assert floor[500:].sum() > floor[:140].sum()


def test_a_lamp_switched_off_changes_nothing():
    assert (seen(lights=(Light(0.8, 0.5, 0.05, 0.0),)) == seen()).all()
