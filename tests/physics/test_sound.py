"""The microphones: 1/r, a body in the way, and enough in four numbers to tell where a sound comes from."""

import math
import statistics

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from world_rig import room_of

from elib.link.protocol.values import locate_sound
from elib.simulator.physics import EpuckModel, Pose, Scene
from elib.simulator.physics.fittings import Sound
from elib.simulator.physics.sensors.microphones import (
    FLOOR,
    FLOOR_DEVIATION,
    GAIN,
    PLACE_X,
    PLACE_Y,
    RELATIVE_DEVIATION,
    SHADE,
)
from lanes import few_and_many

RIGHT, LEFT, REAR, FRONT = range(4)
QUIET = EpuckModel(sensor_noise=0, quality="ideal")


ALONE = (Pose(3, 3),)


def heard(*sounds, starts=ALONE, model=QUIET, robot=0, volumes=(), tick=0, engine="interpreted"):
    room = room_of(Scene(6, 6, starts=starts, sounds=sounds, model=model), engine=engine).at_tick(tick)
    for k in range(len(starts)):
        room.robots[k].volume, room.robots[k].silent_from = volumes[k] if volumes else 0, math.inf
    return room.read("microphones", robot)


def beside(angle, distance, volume=1000):
    return Sound(3 + distance * math.cos(angle), 3 + distance * math.sin(angle), volume)


def test_a_quiet_room_reads_its_floor():
    assert heard() == [FLOOR] * 4
    assert heard(beside(1, 0.1, volume=0)) == [FLOOR] * 4


@pytest.mark.parametrize("distance", [0.1, 0.2, 0.5, 1, 2])
def test_a_sound_that_a_microphone_faces_falls_with_the_distance(distance):
    # The left microphone faces away from the middle of the robot.
    facing = math.atan2(PLACE_Y[LEFT], PLACE_X[LEFT])
    source = beside(facing, math.hypot(PLACE_X[LEFT], PLACE_Y[LEFT]) + distance)
    assert heard(source)[LEFT] == pytest.approx(FLOOR + 1000 * 0.1 / distance, abs=0.5)


def test_the_body_shades_a_microphone_a_little():
    facing = math.atan2(PLACE_Y[FRONT], PLACE_X[FRONT])
    place = 3 + PLACE_X[FRONT], 3 + PLACE_Y[FRONT]
    for turn, share in ((0, 1), (math.pi / 2, 1 / 1.12), (math.pi, 0.88 / 1.12)):
        source = Sound(place[0] + math.cos(facing + turn), place[1] + math.sin(facing + turn), 4000)
        assert heard(source)[FRONT] == pytest.approx(FLOOR + 400 * share, abs=0.5)


def test_sounds_add_up_to_the_end_of_the_converter():
    first, second = beside(0.3, 0.5), beside(2, 1)
    both = [a + b - FLOOR for a, b in zip(heard(first), heard(second), strict=True)]
    assert heard(first, second) == pytest.approx(both, abs=1)
    assert heard(beside(0, 0.03, volume=4095))[FRONT] == 4095


def test_a_sound_in_a_microphone_is_as_loud_as_one_a_centimetre_away():
    assert heard(Sound(3 + PLACE_X[REAR], 3, 100))[REAR] == FLOOR + 1000


@pytest.mark.parametrize(("turn", "loudest"), [(0, FRONT), (math.pi / 2, LEFT), (math.pi, REAR), (-math.pi / 2, RIGHT)])
@pytest.mark.parametrize("distance", [0.1, 0.4, 1.0])
@pytest.mark.parametrize("heading", [0, 2.2])
def test_the_microphone_that_faces_the_sound_hears_most(turn, loudest, distance, heading):
    values = heard(beside(heading + turn, distance), starts=(Pose(3, 3, heading),))
    assert values.index(max(values)) == loudest
    assert values.index(min(values)) == {FRONT: REAR, LEFT: RIGHT, REAR: FRONT, RIGHT: LEFT}[loudest]


def guessed(values):
    """The direction and distance of one sound of volume 1000, from what each microphone hears of it."""
    sound = locate_sound([value - FLOOR for value in values])
    return sound.bearing, 1000 * 0.1 / (1 + SHADE) / sound.volume


@few_and_many(20, 40)
def test_direction_and_distance_can_be_told_from_the_four_readings(examples):
    @settings(max_examples=examples)
    @given(st.floats(-math.pi, math.pi), st.floats(0.15, 1.0))
    def check(angle, distance):
        guess, length = guessed(heard(beside(angle, distance)))
        assert math.remainder(guess - angle, math.tau) == pytest.approx(0, abs=math.radians(15))
        assert length == pytest.approx(distance, rel=0.2)

    check()


def test_a_robot_that_plays_is_heard_by_the_others_and_by_itself_from_behind():
    starts = (Pose(3, 3), Pose(3.2, 3, math.pi / 2))
    playing = {"starts": starts, "volumes": (0, 1000)}
    first, second = heard(**playing, robot=0), heard(**playing, robot=1)
    distance = 0.2 - PLACE_X[FRONT]
    assert first[FRONT] == pytest.approx(FLOOR + 100 / distance, rel=0.02)
    assert first[FRONT] > first[LEFT] > first[REAR]
    behind = 1000 * 0.1 / math.hypot(*place(LEFT)) * (1 - SHADE) / (1 + SHADE)
    assert second[LEFT] == second[RIGHT] == pytest.approx(FLOOR + behind, abs=0.5)
    assert heard(starts=starts, volumes=(0, 0)) == [FLOOR] * 4


def place(microphone):
    return PLACE_X[microphone], PLACE_Y[microphone]


def test_the_places_fit_the_delays_that_the_demo_of_the_epuck1_allows():
    def samples(one, other):
        return math.dist(place(one), place(other)) / 343 * 33_000

    assert samples(RIGHT, LEFT) == pytest.approx(6, abs=0.5)
    assert samples(RIGHT, REAR) < 5


def test_a_mirrored_sound_gives_the_mirrored_readings_of_the_sides():
    for k in range(1, 20):
        one, other = heard(beside(k / 7, 0.3)), heard(beside(-k / 7, 0.3))
        assert (one[LEFT], one[RIGHT], one[REAR]) == (other[RIGHT], other[LEFT], other[REAR])


def test_the_noise_grows_with_what_is_heard():
    def deviation(*sounds):
        return statistics.stdev(
            heard(*sounds, model=EpuckModel(quality="ideal"), tick=tick)[FRONT] for tick in range(400)
        )

    assert deviation() == pytest.approx(FLOOR_DEVIATION, rel=0.15)
    assert deviation(beside(0, 0.1319)) == pytest.approx(FLOOR_DEVIATION + RELATIVE_DEVIATION * 1000, rel=0.15)


def crowd(quality, *sounds):
    """A hundred robots without noise."""
    starts = tuple(Pose(1 + k % 10, 1 + k // 10) for k in range(100))
    model = EpuckModel(sensor_noise=0, quality=quality)
    return room_of(Scene(12, 12, starts=starts, sounds=sounds, model=model))


@pytest.mark.parametrize(("quality", "spread"), [("ideal", 0), ("good", 0.5), ("typical", 1)])
def test_microphones_of_real_robots_are_not_equally_loud(quality, spread):
    loud = [Sound(0, 0, 4000)] * 8
    room, ideal = crowd(quality, *loud), crowd("ideal", *loud)
    gains = [room.read("microphones", k)[RIGHT] / ideal.read("microphones", k)[RIGHT] for k in range(100)]
    assert statistics.stdev(gains) == pytest.approx(spread * GAIN, rel=0.2)


def test_a_typical_robot_hears_its_motors_while_it_drives_and_an_ideal_one_does_not():
    def readings(quality, speed):
        room = crowd(quality)
        found = []
        for k in range(100):
            room.robots[k].left_speed = speed
            found += room.at_tick(k).read("microphones", k)
        return sorted(found)

    assert statistics.fmean(readings("typical", 0.0)) == pytest.approx(FLOOR, abs=0.6)
    driving = readings("typical", 0.03)
    # measured-robots: microphones.quiet. Their 1, 50 and 99 percentiles are 5, 9 and 28.
    assert statistics.fmean(driving) == pytest.approx(10.1, abs=1)
    assert statistics.median(driving) == pytest.approx(9, abs=1)
    assert 20 < driving[-5] < 32
    assert readings("ideal", 0.03) == [FLOOR] * 400


@pytest.mark.usefixtures("compiled_worlds")
def test_compiled_the_readings_are_the_same():
    sounds = [beside(k, 0.1 * k, volume=100 * k) for k in range(1, 9)]
    starts = (Pose(3, 3, 0.4), Pose(3.1, 3.05, 2))
    for tick in range(20):
        options = {"starts": starts, "volumes": (300, 500), "model": EpuckModel(quality="typical"), "tick": tick}
        assert heard(*sounds, **options, engine="compiled") == heard(*sounds, **options)
