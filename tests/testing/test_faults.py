"""The helpers for tests with faults, and programs under all fault scripts that come with elib."""

from pathlib import Path

import pytest

import elib
from elib.link.transport import parse_url
from elib.testing import fault_scripts, faults_of, simulated, with_faults

DURATION = 70.0
"""s of robot time; the faults of every shipped script have happened by then."""


def test_a_script_becomes_a_url_of_a_simulation_as_fast_as_it_can() -> None:
    assert with_faults("robot-reset") == "sim://?speed=max&fault=robot-reset"
    assert with_faults("robot-reset", "sim://square?seed=4") == "sim://square?seed=4&fault=robot-reset"


def test_a_file_is_named_by_its_path_whatever_characters_it_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "50 % & more?.toml"
    path.write_text('description = "odd"')
    assert parse_url(with_faults(path)).keys["fault"] == str(path)
    assert parse_url(with_faults(Path(path.name))).keys["fault"] == f"./{path.name}"


@pytest.mark.parametrize(
    ("script", "url", "error", "message"),
    [
        ("robot-rest", "sim://", elib.ArgumentError, "did you mean robot-reset?"),
        ("nowhere.toml", "sim://", elib.ArgumentError, "cannot be read"),
        ("robot-reset", "tcp://127.0.0.1:1", elib.ArgumentError, "is not a simulation"),
        ("robot-reset", "sim://?fault=half-answers", elib.ArgumentError, "has a fault script already"),
    ],
)
def test_what_cannot_be_chosen_is_refused(script: str, url: str, error: type[elib.ElibError], message: str) -> None:
    with pytest.raises(error) as caught:
        with_faults(script, url)
    assert message in str(caught.value)


def test_what_a_script_did_can_be_counted_behind_either_style() -> None:
    with elib.connect(with_faults("robot-reset")) as robot:
        robot.sleep(20)
        assert faults_of(robot).counts.resets == 1

    @simulated
    async def story() -> None:
        async with elib.open("sim://?speed=max") as robot:
            with pytest.raises(elib.ArgumentError, match="has no fault script"):
                faults_of(robot)

    story()


def test_the_fixture_runs_a_test_under_every_script(elib_link_faults: str) -> None:
    """A program that polls and drives: each call ends once, in a value or a library error, whatever fails."""
    assert parse_url(elib_link_faults).keys["fault"] in fault_scripts()

    @simulated
    async def story() -> dict[str, int]:
        ends = {"value": 0, "error": 0}
        robot = elib.open(elib_link_faults)
        try:
            async with robot:
                while robot.time < DURATION:
                    for call in (robot.proximity, robot.encoders, lambda: robot.set_speed(0.1, -0.1)):
                        try:
                            await call()
                            ends["value"] += 1
                        except (elib.ReplyTimeout, elib.RemoteProtocolError):
                            ends["error"] += 1
                    await robot.sleep(0.2)
        except elib.LinkLost:
            assert not faults_of(robot).is_reachable, "nobody gives up a robot that answers"
            ends["lost"] = 1
        statistics, counts = robot.statistics, faults_of(robot).counts
        assert statistics.count + statistics.lost + statistics.refused + statistics.unsent >= sum(ends.values())
        assert counts.answers >= statistics.count - 10, "the calm beginning"
        return ends

    first = story()
    assert first["value"] > 100
    is_of_link = parse_url(elib_link_faults).keys["fault"] != "loose-wheel"
    assert (first["error"] > 0) is is_of_link, "a link tells nothing of a broken wheel"
    assert story() == first, "the same faults, the same run"


@pytest.mark.parametrize("elib_link_faults", ["half-answers"], indirect=True)
def test_the_fixture_can_be_told_which_script(elib_link_faults: str) -> None:
    assert elib_link_faults == with_faults("half-answers")
