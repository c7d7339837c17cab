"""Virtual robots beside the figures of real ones, and a recorded robot beside both."""

from __future__ import annotations

import asyncio
import importlib
import json
import math
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError, SimulationError
from elib.behaviours import RunContext, RunMessage, StateChanged, play
from elib.records.mcapwriter import McapWriter
from elib.records.reader import read_recording
from elib.records.topics import ABOUT, FORMAT, NOTES, PICTURES, READINGS
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.physics import Pose
from elib.simulator.physics.body import RADIUS
from elib.studies.drive import simulation_of
from elib.studies.reality.figures import FILE, parse, reference
from elib.studies.reality.measures import WAYS
from elib.studies.reality.parity import Found, Realism, empty, of_recording, realism
from elib.studies.reality.session import Recorded, reality
from lanes import short

ROOT = Path(__file__).parents[2]
LONG = ("epuck2", "btcom-2.0", "btcom-1.1.3", "epuck2-wifi")
FIRMWARES = short(["asercom-1.2.2", *LONG], "asercom-1.2.2")
RENEW = "change [[apart]] and score in src/elib/studies/reality/measured.toml, and say why"


# -- the figures -----------------------------------------------------------------------------------------------------


def test_every_quantity_has_a_way_to_measure_it() -> None:
    assert WAYS.keys() == reference().quantities.keys()


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('["1 cm", 668, 996, 1324]', '["1 cm", 996, 668, 1324]', "it must not fall|falls"),
        ('["2 cm", 249, 331, 413]', '["1 cm", 249, 331, 413]', "'1 cm' once more"),
        ('["1 cm", 668, 996, 1324]', '["1 cm", 668, 996]', "a condition and three numbers"),
        ('source = "moh"', 'source = "mho"', "moh"),
        ('fact = "infrared.distance_8_sensors"', 'fact = "infrared.distance"', "fact"),
        ('key = "cla"', 'key = "moh"', "moh is there once more"),
        ('quantities = "', 'quantities = "ground.whit, ', "ground.white"),
        ("score = 0", "score = 7 # ", "score"),
    ],
)
def test_a_mistake_in_the_file_of_figures_is_named_with_its_line(old: str, new: str, what: str) -> None:
    content = FILE.read_text(encoding="utf-8")
    assert old in content
    with pytest.raises(SimulationError, match=rf"(?s)figures\.toml:\d+: .*({what})"):
        parse(content.replace(old, new, 1).encode(), "figures.toml")


# -- the simulator beside the robots ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found() -> Realism:
    return realism()


@pytest.mark.long
def test_the_simulator_has_what_robots_have_except_in_what_is_said_to_be_apart(found: Realism) -> None:
    apart = {each.quantity.key for each in found.counted if each.share < 1}
    assert apart == reference().apart.keys(), RENEW
    assert round(found.score, 2) == reference().score, RENEW


@pytest.mark.long
def test_the_pages_have_what_was_measured(found: Realism, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    script = importlib.import_module("generate_reference")
    monkeypatch.setattr(script.reality, "measured", lambda: found)
    stale = [path.name for path, text in script.measured().items() if path.read_text("utf-8").rstrip() != text.rstrip()]
    assert stale == [], "make docs"


@pytest.mark.parametrize("robots", short([2, None], 2))
def test_every_quantity_could_be_measured(robots: int | None, request: pytest.FixtureRequest) -> None:
    found = realism(robots=robots) if robots else request.getfixturevalue("found")
    missing = [each.quantity.key for each in found.quantities for it in each.conditions if math.isnan(it.compared)]
    assert missing == []


def test_the_same_seed_gives_the_same_figures_and_another_one_others() -> None:
    first, again, other = (realism(robots=1, seed=seed) for seed in (5, 5, 6))
    assert first == again
    assert first.quantities != other.quantities


@pytest.mark.parametrize("wrong", [{"quality": "great"}, {"robots": 0}, {"seed": -1}])
def test_a_wrong_argument_is_refused_before_anything_is_measured(wrong: dict[str, object]) -> None:
    with pytest.raises(ArgumentError, match=next(iter(wrong))):
        realism(progress=lambda text: pytest.fail(text), **wrong)  # type: ignore[arg-type]


# -- a recorded robot ------------------------------------------------------------------------------------------------

WORLD = """
[arena]
size = [1.2, 1.0]
[floor]
colour = "#ffffff"
[epuck]
ground_module = true
[[robot]]
position = [0.6, 0.5]
"""


class Session:
    """The drive of ``elib record --reality`` on a virtual robot, whose person has hands.

    Args:
        file: The recording.
        has_wall: Whether the person puts the robot to the wall when it asks.
    """

    def __init__(self, file: Path, *, has_wall: bool = True) -> None:
        self.file, self.has_wall = file, has_wall
        self.told: list[str] = []
        self.states: list[str] = []

    def begin(self, run: RunContext, robots: tuple[Epuck, ...]) -> None:
        recorder, (simulation, _) = robots[0].record(self.file), simulation_of(robots[0])
        assert simulation is not None
        self.world = simulation.world
        self.motors = simulation.robots[0].emulator.firmware.motors

        def note(event: StateChanged | RunMessage) -> None:
            if isinstance(event, StateChanged):
                self.states.append(event.state)
                recorder.note(event.state, kind="state")
            else:
                self.told.append(event.text)
                if self.has_wall and "against a white wall" in event.text:
                    asyncio.get_running_loop().call_later(3.0, self._put)

        run.listeners.append(note)

    def _put(self) -> None:
        assert self.world is not None
        self.world.move_robot(0, Pose(RADIUS, 0.5, math.pi))


def recorded(folder: Path, keys: str, *, has_wall: bool = True) -> tuple[Session, Found]:
    """Record a robot, and return the drive and what was measured of it."""
    world = folder / "room.toml"
    world.write_text(WORLD)
    session = Session(folder / "own.mcap", has_wall=has_wall)
    play(reality, f"sim://{world}?speed=max&seed=3&{keys}", watch=session.begin)
    robot = Recorded(read_recording(session.file))
    return session, asyncio.run(of_recording(robot, reference().quantities.values()))


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_recorded_robot_reads_what_the_same_robot_reads_on_the_bench(firmware: str, tmp_path: Path) -> None:
    session, own = recorded(tmp_path, f"firmware={firmware}")
    assert session.states == ["standing", "pictures", "turning", "placing", "wall", "driving", "end"]
    kind = "e-puck2" if firmware.startswith("epuck2") else "e-puck1"
    missing = empty(reference().quantities.values())
    expected = {
        "infrared.open_air",
        "infrared.noise_standing",
        "infrared.front",
        "microphones.floor_driving",
        "accelerometer.tilt",
        f"camera.noise_{kind.replace('-', '')}",
    }
    if not firmware.startswith("btcom"):  # these do not read the module
        expected |= {"ground.white", "ground.noise_driving"}
    if kind == "e-puck2":
        expected |= {"gyroscope.noise_driving", "magnetometer.radius", "time_of_flight.reading"}
    assert {key for key in expected if own[key] == missing[key]} == set()
    assert own["motion.turn"] == missing["motion.turn"]
    counts = [max(values, default=0.0) for values in own["infrared.front"]]
    assert counts == sorted(counts, reverse=True)
    if kind == "e-puck2":
        assert own["time_of_flight.reading"][1] == pytest.approx([220], abs=15)
        assert own["magnetometer.radius"][0] == pytest.approx([20], abs=1)
    assert bool(own["latency.wifi_packet"][0]) == (firmware == "epuck2-wifi")


def test_without_a_wall_what_needs_one_is_left_out(tmp_path: Path) -> None:
    session, own = recorded(tmp_path, "firmware=asercom-1.2.2", has_wall=False)
    assert session.states == ["standing", "pictures", "turning", "placing", "driving", "end"]
    assert "there is no wall" in session.told[-1]
    assert not any(own["infrared.front"])
    assert any(own["infrared.open_air"])


def test_a_link_that_breaks_as_it_drives_is_opened_again_and_the_wheels_stand_at_the_end(tmp_path: Path) -> None:
    (tmp_path / "cut.toml").write_text(
        'description = "Three cuts"\n'
        + "".join(f'[[fault]]\nkind = "cut"\nfrom = {at}\nfor = 1\n' for at in (20.0, 36.0, 42.0))
    )
    session, own = recorded(tmp_path, f"fault={tmp_path / 'cut.toml'}")
    assert session.states[-2:] == ["driving", "end"]
    assert [motor.speed for motor in session.motors] == [0, 0]
    assert any(own["microphones.floor_driving"])


def test_another_recording_is_refused_with_what_makes_one(tmp_path: Path) -> None:
    file = tmp_path / "other.mcap"

    async def stand(robot: Epuck) -> None:
        with robot.record(file):
            await robot.proximity()

    run_on("sim://?speed=max", stand)
    with pytest.raises(ArgumentError, match="--reality"):
        realism(recording=read_recording(file), progress=lambda text: pytest.fail(text))


def test_readings_and_pictures_of_a_stranger_that_lack_something_are_left_out(tmp_path: Path) -> None:
    whole = {name: 10.0 + number for number, name in enumerate("abcdefhi")}
    odd = ({"a": 1.0}, {}, {"a": "b"}, {"g": [1.0]}, {"counts": None}, {"counts": [[1.0]]}, {"metres": None})
    pictures = [{"encoding": "rgb8", "width": 1, "height": 1, "data": data} for data in ("AAAA", "AAAAAAAA")]
    with (tmp_path / "odd.mcap").open("xb") as stream:
        writer = McapWriter(stream, "test")
        writer.add_metadata(
            ABOUT, {"format": FORMAT, "began": "0", "robot": "x", "url": "x", "firmware": "asercom-1.2.2"}
        )

        def write(topic: str, *messages: dict[str, object]) -> None:
            channel = writer.register(topic, "x", b"{}")
            for each in messages:
                writer.add_message(channel, 0, json.dumps({"time": 1.0} | each).encode())

        for time, part in ((0.0, "standing"), (50.0, "pictures"), (99.0, "wall")):
            write(NOTES.name, {"time": time, "message": part, "name": "state", "level": 2, "event": ""})
        write(PICTURES.name, *({"time": 60.0, "frame_id": "", "step": 3} | each for each in pictures))
        write(READINGS.name + "proximity", *[whole] * 20, *odd)
        for name in ("accelerometer", "gyroscope", "magnetometer", "ground", "microphones", "distance"):
            write(READINGS.name + name, *odd * 3)
        writer.finish()
    own = asyncio.run(of_recording(Recorded(read_recording(tmp_path / "odd.mcap")), reference().quantities.values()))
    assert own["infrared.open_air"] == [[*whole.values()]]
    assert own["accelerometer.tilt"] == [[]]
