"""Robot profiles: what a file may say, how mistakes are reported, and what the simulator does with it."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from parity_drives import off

from elib.base.body import AXLE, METRES_PER_STEP
from elib.base.errors import ArgumentError, SimulationError
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.emulator.robotprofile import (
    NOMINAL_RADIUS,
    Infrared,
    LinkDelay,
    RobotProfile,
    Wheels,
    load_profile,
    parse,
    write,
    written,
)
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.physics import EpuckModel
from elib.simulator.physics.profiles import APERTURE, NARROW, Profile
from elib.testing import world_of
from lanes import short

CURVE = ((0.0, 3000.0), (0.02, 500.0), (0.1, 10.0))
WHOLE = RobotProfile(
    'a "robot" \\ of mine',
    Wheels(0.0203, 0.0207, 0.0541),
    LinkDelay(0.02, 0.003),
    Infrared(CURVE, 4.5, (1.0, 0.9, 1.1, 1.0, 1.0, 1.0, 1.0, 1.0)),
)


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False).map(lambda value: value + 0.0)  # no -0.0


@st.composite
def profiles(draw: st.DrawFn) -> RobotProfile:
    radius, axle = (numbers(0.81 * nominal, 1.24 * nominal) for nominal in (NOMINAL_RADIUS, AXLE))
    delay, counts = numbers(0, 60), numbers(0, 4095)
    further = draw(st.lists(numbers(1e-300, 0.25), min_size=1, max_size=6, unique=True))
    infrared = st.builds(
        Infrared,
        st.tuples(*(st.tuples(st.just(distance), counts) for distance in (0.0, *sorted(further)))),
        numbers(0, 500),
        st.tuples(*[numbers(0.1, 10)] * 8),
        st.tuples(*[numbers(0, 4095)] * 8),
    )
    return RobotProfile(
        draw(st.text(max_size=200).filter(str.isprintable)),
        draw(st.none() | st.builds(Wheels, radius, radius, axle)),
        draw(st.none() | st.builds(LinkDelay, delay, delay)),
        draw(st.none() | infrared),
    )


@pytest.mark.parametrize("count", short([25, 100], 25))
def test_every_profile_is_written_so_that_the_same_is_read(count: int) -> None:
    @settings(max_examples=count)
    @given(profiles())
    def check(profile: RobotProfile) -> None:
        assert parse(written(profile).encode(), "p.toml") == profile

    check()


def test_knots_that_are_very_near_each_other_stay_apart() -> None:
    profile = parse(b"[infrared]\ncurve = [[0, 4000], [0.00001, 3999.99], [0.00002, 2]]\n", "p.toml")
    assert parse(written(profile).encode(), "p.toml") == profile


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[wheel]\naxle = 0.05", r"p\.toml:1: wheel is not a key of a robot profile.*did you mean wheels"),
        ("[wheels]\naxel = 0.05", r"p\.toml:2: wheels\.axel is not a key of a robot profile.*did you mean axle"),
        ("[wheels]\naxle = 53", r"p\.toml:2: wheels\.axle is 53 m; it must be a number from 0\.0424 to 0\.06625 m"),
        ("[wheels]\naxle = nan", r"wheels\.axle is nan m; it must be a number"),
        ('[wheels]\nleft_radius = "20 mm"', r"wheels\.left_radius is '20 mm'; it must be a number"),
        ("[wheels]\nleft_radius = true", r"wheels\.left_radius is true; it must be a number"),
        ("wheels = 3", r"p\.toml:1: wheels is 3; it must be a table"),
        ("[link]\njitter = 0.1", r"link\.latency is missing"),
        ("[link]\nlatency = -0.1", r"link\.latency is -0\.1 s; it must be a number from 0 to 60 s"),
        ("[link]\nlatency = inf", r"link\.latency is inf"),
        ("[infrared]\ncurve = []", r"infrared\.curve is \[\]; it must be 2 to 1000 pairs"),
        ("[infrared]\ncurve = [[0.0, 10], [0.0, 5]]", r"infrared\.curve .* rising"),
        ("[infrared]\ncurve = [[0.01, 10], [0.02, 5]]", r"infrared\.curve .* from 0 "),
        ("[infrared]\ncurve = [[0.0, 50000], [0.02, 5]]", "40950"),
        ("[infrared]\ncurve = [[0.0, nan], [0.02, 5]]", r"infrared\.curve"),
        (
            "[infrared]\ncurve = [[0, 9], [0.1, 1]]\ngains = [1, 1]",
            r"infrared\.gains is \[1, 1\]; it must be 8 numbers",
        ),
        ("[infrared]\ncurve = [[0, 9], [0.1, 1]]\ngains = [1, 1, 1, 1, 1, 1, 1, nan]", r"infrared\.gains"),
        ("[infrared]\ncurve = [[0, 9], [0.1, 1]]\noffsets = [-1, 0, 0, 0, 0, 0, 0, 0]", r"infrared\.offsets"),
        ("about = 3", r"about is 3; it must be a text"),
        ("about = ", r"p\.toml: this is not TOML"),
    ],
)
def test_a_mistake_is_named_with_its_line_and_a_cure(text: str, says: str) -> None:
    with pytest.raises(SimulationError, match="(?s)" + says) as caught:
        parse(text.encode(), "p.toml")
    assert caught.value.hint


def test_a_missing_file_is_an_error_with_a_hint() -> None:
    with pytest.raises(ArgumentError, match=r"(?s)no-such\.toml cannot be read.*elib fit"):
        load_profile("no-such.toml")


def test_a_profile_cannot_be_written_where_there_is_no_folder(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="cannot be written"):
        write(WHOLE, tmp_path / "none" / "p.toml")


def test_the_curve_is_straight_between_its_knots_and_even_beyond() -> None:
    infrared = Infrared(CURVE)
    assert [infrared.counts(d) for d in (-0.01, 0.0, 0.01, 0.02, 0.2)] == [3000, 3000, 1750, 500, 10]
    assert infrared.response("measured").counts[40] == pytest.approx(1750)


@pytest.mark.parametrize(("world", "aperture"), [("measured", APERTURE), ("enki", NARROW)])
def test_the_sensors_look_as_widely_as_those_of_the_world(world: str, aperture: float) -> None:
    profile = RobotProfile("", infrared=Infrared(CURVE))
    found = profile.model(EpuckModel(profile=world)).profile
    assert isinstance(found, Profile)
    assert (found.name, found.aperture) == ("fitted", aperture)


def driven(url: str) -> tuple[float, float, list[int], float]:
    """Return distance (m), turn (rad), infrared readings and a round trip of a robot that drives, and then turns."""

    async def main(robot: Epuck) -> tuple[float, float, list[int], float]:
        await robot.set_speed(0, 0)
        began = robot.time
        await robot.encoders()
        trip = robot.time - began
        transport = robot.session.transport
        await robot.set_speed(0.5, 0.5)
        await robot.sleep(2)
        await robot.stop()
        await robot.sleep(0.2)
        ahead = (await robot.encoders()).left * METRES_PER_STEP
        middle = transport.observe()[0]  # type: ignore[attr-defined]
        await robot.set_speed(-0.2, 0.2)
        await robot.sleep(2)
        await robot.stop()
        await robot.sleep(0.2)
        steps = await robot.encoders()
        end = transport.observe()[0]  # type: ignore[attr-defined]
        turned = (steps.right - steps.left) * METRES_PER_STEP
        near = list(await robot.proximity())
        return (middle.x - 0.5) / ahead, (end.heading - middle.heading) / turned, near, trip

    return run_on(url, main)


def test_the_simulator_drives_as_the_profile_says(tmp_path: Path) -> None:
    file = tmp_path / "p.toml"
    write(RobotProfile("", Wheels(1.02 * NOMINAL_RADIUS, 1.02 * NOMINAL_RADIUS, 0.05)), file)
    ahead, turned, _, _ = driven(f"sim://square?speed=max&profile={file}")
    assert off(ahead, 1.02) < 0.002
    assert off(turned, 1.02 / 0.05) < 0.005


def test_wheels_that_differ_turn_as_fast_as_they_are_told_which_is_what_a_reward_counts(tmp_path: Path) -> None:
    file = tmp_path / "p.toml"
    write(RobotProfile("", Wheels(1.02 * NOMINAL_RADIUS, 0.98 * NOMINAL_RADIUS, 0.05)), file)

    async def main(robot: Epuck) -> tuple[float, float]:
        await robot.set_speed(0.5, 0.5)
        await robot.sleep(1)
        return world_of(robot).wheel_speeds(0)

    left, right = run_on(f"sim://square?speed=max&profile={file}", main)
    assert left == right > 0


def test_the_link_is_as_slow_as_the_profile_says_unless_the_url_says_otherwise(tmp_path: Path) -> None:
    file = tmp_path / "p.toml"
    write(RobotProfile("", link=LinkDelay(0.05)), file)
    plain = driven("sim://square?speed=max")[3]
    assert driven(f"sim://square?speed=max&profile={file}")[3] == pytest.approx(plain + 0.1, abs=1e-3)
    assert driven(f"sim://square?speed=max&latency=0.01&profile={file}")[3] == pytest.approx(plain + 0.02, abs=1e-3)


def test_the_infrared_sensors_read_as_the_profile_says(tmp_path: Path) -> None:
    file = tmp_path / "p.toml"
    gains = (1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 1.0, 1.0)
    offsets = (0.0, 0.0, 200.0, 0.0, 0.0, 50.0, 0.0, 0.0)
    write(RobotProfile("", infrared=Infrared(((0.0, 700.0), (0.2, 700.0)), 0.0, gains, offsets)), file)
    for quality in ("ideal", "bad"):
        read = driven(f"sim://square?speed=max&quality={quality}&profile={file}")[2]
        assert read == [700, 700, 900, 700, 700, 1450, 700, 700]


def test_a_profile_describes_one_robot_so_the_spread_of_the_world_does_not_count(tmp_path: Path) -> None:
    world = tmp_path / "w.toml"
    world.write_text(
        "[arena]\nsize = [1, 1]\n[epuck]\nwheel_spread = 0.05\n[[robot]]\nposition = [0.5, 0.5]", encoding="utf-8"
    )
    write(RobotProfile(), tmp_path / "p.toml")
    assert off(driven(f"sim://{world}?speed=max&seed=3")[0], 1) > 0.005
    assert off(driven(f"sim://{world}?speed=max&seed=3&profile={tmp_path / 'p.toml'}")[0], 1) < 0.002


def test_constant_readings_have_no_profile() -> None:
    with pytest.raises(ArgumentError, match="exclude each other"):
        SimulationSettings(profile="p.toml", hardware="h.json")
