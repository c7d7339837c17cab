"""``elib compare``: two recorded drives, or one and the simulator."""

import json
from pathlib import Path

import pytest
from elib_process import Told

from elib.cli import main
from elib.records.reader import Recording
from elib.records.topics import MEASURED
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.studies.reality.parity import realism
from lanes import short


def recorded(
    file: Path, url: str = "sim://square?speed=max&quality=ideal", *, seconds: float = 6.0, speed: float = 0.3
) -> Path:
    async def drive(robot: Epuck) -> None:
        with robot.record(file):
            await robot.set_speed(speed, speed / 2)
            while robot.time < seconds:
                await robot.encoders()
                await robot.proximity()
                await robot.sleep(0.05)

    run_on(url, drive)
    return file


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("first") / "first.mcap")


@pytest.fixture(scope="module")
def second(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("second")
    return recorded(folder / "second.mcap", "sim://square?speed=max&latency=0.02&firmware=btcom-2.0", seconds=4.0)


@pytest.fixture
def compared(capsys: pytest.CaptureFixture[str]) -> Told:
    """Return a function that compares, about which nothing is to be said beside, and returns what it printed."""

    def run(*words: object) -> str:
        assert main(["compare", *map(str, words)]) == 0
        out, err = capsys.readouterr()
        assert err == ""
        return out

    return run


def test_a_recording_is_equal_to_itself(compared: Told, first: Path) -> None:
    found = json.loads(compared(first, first, "--json"))
    assert found["path"]["largest"] == 0
    assert {each["rms"] for each in found["readings"]} == {0.0}
    assert found["notes"] == []
    assert found["a"] == found["b"]
    assert "parity" not in found


def test_two_recordings_stand_side_by_side(compared: Told, first: Path, second: Path) -> None:
    text = compared(first, second)
    assert max(map(len, text.splitlines())) <= 82
    for line in ("commands, ms", "path, measured", "readings", "encoders", "proximity  front_right"):
        assert f"\n{line}" in text
    assert "note:  A ran asercom-1.2.2 and B btcom-2.0" in text
    assert "note:  B is shorter" in text


def test_the_json_holds_what_the_table_shows(compared: Told, first: Path, second: Path) -> None:
    found = json.loads(compared(first, second, "--json"))
    assert list(found) == ["a", "b", "notes", "path", "readings"]
    assert found["a"]["duration"] == pytest.approx(6.0, abs=0.5)
    assert found["b"]["commands"]["encoders"]["p50"] == pytest.approx(
        found["a"]["commands"]["encoders"]["p50"] + 0.04, abs=0.005
    )
    assert found["path"]["measured"] is True
    assert 0 < found["path"]["mean"] < found["path"]["largest"] < 0.05
    left = next(each for each in found["readings"] if each["field"] == "left" and each["reading"] == "encoders")
    assert left["correlation"] > 0.99
    assert left["n"] > 20


def test_one_recording_is_compared_with_the_simulator(compared: Told, first: Path) -> None:
    found = json.loads(compared(first, "--json"))
    assert found["parity"].keys() == {"encoders", "proximity", "path", "latency"}
    assert all(0.9 < each["score"] <= 1 for each in found["parity"].values())
    assert found["left_out"] == []
    assert "parity" in compared(first)


def test_a_profile_and_a_world_may_be_named(compared: Told, first: Path, tmp_path: Path) -> None:
    profile = tmp_path / "slow.toml"
    profile.write_text("[link]\nlatency = 0.05\n", encoding="utf-8")
    found = json.loads(compared(first, "--profile", profile, "--world", "square", "--json"))
    assert found["parity"]["latency"]["score"] < 0.1
    assert found["b"]["recording"] == f"the simulator with {profile}"


@pytest.mark.parametrize("suffix", short(["png", "svg"], "svg"))
def test_a_picture_is_drawn(compared: Told, first: Path, second: Path, suffix: str) -> None:
    file = first.with_suffix(f".{suffix}")
    compared(first, second, "--plot", file)
    assert file.stat().st_size > 10_000


def test_a_cut_file_is_compared_as_far_as_it_goes(compared: Told, first: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    content = first.read_bytes()
    cut.write_bytes(content[: len(content) * 2 // 3])
    found = json.loads(compared(first, cut, "--json"))
    assert found["notes"][0].startswith("B was cut")
    assert found["b"]["whole"] is False


def test_a_recording_with_nothing_in_it_is_compared_too(compared: Told, first: Path, tmp_path: Path) -> None:
    file = tmp_path / "empty.mcap"

    async def nothing(robot: Epuck) -> None:
        with robot.record(file):
            pass

    run_on("sim://square?speed=max", nothing)
    text = compared(first, file)
    assert "note:  B has no command in it" in text
    assert "note:  only A has encoders, proximity" in text
    assert "readings: none that both have" in text
    assert compared(file, file, "--plot", tmp_path / "empty.png")
    assert "parity" in compared(file)


def test_without_measured_poses_and_counters_there_is_no_path(
    compared: Told, first: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "look.mcap"

    async def look(robot: Epuck) -> None:
        with robot.record(file):
            await robot.set_speed(0.2, 0.2)
            for _ in range(20):
                await robot.proximity()
                await robot.sleep(0.1)

    run_on("sim://square?speed=max", look)
    entries = Recording.entries
    monkeypatch.setattr(
        Recording,
        "entries",
        lambda self, *topics, **more: (each for each in entries(self, *topics, **more) if each.topic != MEASURED.name),
    )
    text = " ".join(compared(first, file).split())
    assert "path: one of the recordings has none" in text
    assert "note: B has no path: it has no measured poses, and the step counters were read less than twice" in text
    assert "0.000 m" not in text
    found = json.loads(compared(first, file, "--json", "--plot", tmp_path / "look.svg"))
    assert found["path"] is None
    assert "<!-- paths by the step counters, m; B has none -->" in (tmp_path / "look.svg").read_text(encoding="utf-8")
    assert any(note.startswith("B has no path") for note in found["notes"])
    assert not any("so the paths are" in note for note in found["notes"])
    found = json.loads(compared(file, "--json"))
    assert found["parity"]["path"]["score"] is None


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["none.mcap"], "none.mcap"),
        (["{first}", "none.mcap"], "none.mcap"),
        (["{first}", "{first}", "--world", "square"], "are for the simulator"),
        (["{first}", "--profile", "none.toml"], "cannot be read"),
        (["{first}", "--world", "moon"], "no world 'moon'"),
        (["{first}", "--plot", "picture.doc"], "must end in"),
        ([], "needs"),
        (["{first}", "{first}", "--reality"], "takes no second recording"),
        (["{first}", "--seed", "3"], "--seed is for --reality"),
        (["{first}", "--reality"], "elib record FILE --reality"),
        (["--reality", "--quality", "great"], "great"),
    ],
)
def test_a_mistake_is_said_in_a_sentence(refused: Told, first: Path, arguments: list[str], says: str) -> None:
    assert says in refused("compare", *(each.format(first=first) for each in arguments), code=None)


def test_real_robots_stand_beside_drawn_ones_in_a_table_that_fits_a_terminal(
    compared: Told, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = realism(robots=1)
    monkeypatch.setattr("elib.cli.compare.realism", lambda **how: found)
    text = compared("--reality")
    assert max(map(len, text.splitlines())) <= 80
    for each in found.quantities:
        assert each.quantity.title.split()[0] in text
    assert f"score  {found.score:.2f}" in text
    assert all(key in text for keys in found.apart.values() for key in keys)
    monkeypatch.setenv("COLUMNS", "50")
    assert "".join(compared("--reality").split()) == "".join(text.split())
    told = json.loads(compared("--reality", "--json"))
    assert told["score"] == found.score
    assert [each["key"] for each in told["quantities"]] == [each.quantity.key for each in found.quantities]
    assert {each["why"] is None for each in told["quantities"] if each["counts"]} == {True, False}
