"""``elib fit``: a profile from a recorded drive."""

import json
from pathlib import Path

import pytest
from elib_process import Told

from elib.behaviours import run_behaviour
from elib.behaviours.calibration_drive import calibration_drive
from elib.cli import fit, main
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.emulator.robotprofile import load_profile
from elib.studies import Fitted


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("drive") / "drive.mcap"

    async def record(robot: Epuck) -> None:
        with robot.record(file):
            await run_behaviour(calibration_drive, robot, options={"duration": 60.0})

    run_on("sim://square?speed=max&quality=ideal&latency=0.03", record)
    return file


FOUND: list[Fitted] = []


@pytest.fixture
def fits_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the drive be fitted once, which takes seconds, and let the result be shown in every form."""
    fit_robot = fit.fit_robot

    def remember(*arguments: object, **options: object) -> Fitted:
        if not FOUND:
            FOUND.append(fit_robot(*arguments, **options))
        return FOUND[0]

    monkeypatch.setattr(fit, "fit_robot", remember)


@pytest.mark.long
@pytest.mark.usefixtures("fits_once")
def test_what_was_found_is_printed_and_the_profile_written(
    capsys: pytest.CaptureFixture[str], drive: Path, tmp_path: Path
) -> None:
    file = tmp_path / "robot.toml"
    assert main(["fit", str(drive), "-o", str(file)]) == 0
    out, err = capsys.readouterr()
    labels = ["left wheel", "right wheel", "axle", "drive", "latency", "infrared", "gains", "in the open", "predicted"]
    assert [line[2:13].strip() for line in out.splitlines() if line[2:3].strip()] == labels
    assert max(map(len, out.splitlines())) <= 79
    assert f"wrote {file}" in err
    profile = load_profile(str(file))
    assert profile.link is not None
    assert profile.link.latency == pytest.approx(0.03, abs=0.002)
    assert main(["send", "encoders", "--robot", f"sim://square?speed=max&profile={file}"]) == 0


@pytest.mark.long
@pytest.mark.usefixtures("fits_once")
def test_the_json_holds_the_same(printed: Told, drive: Path) -> None:
    found = json.loads(printed("fit", drive, "--json"))
    assert found["wheels"]["axle"] == pytest.approx(0.053, rel=0.002)
    assert found["wheels"]["left_radius"] == pytest.approx(0.0205, rel=0.002)
    assert found["link"]["latency"] == pytest.approx(0.03, abs=0.002)
    assert found["infrared"]["near_error"] < 0.1
    assert found["missing"] == []


def still(file: Path) -> Path:
    async def stand(robot: Epuck) -> None:
        with robot.record(file):
            for _ in range(20):
                await robot.encoders()
                await robot.sleep(0.1)

    run_on("sim://square?speed=max", stand)
    return file


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["none.mcap"], "none.mcap"),
        (["{still}"], "turns on the spot to both sides: elib run calibration-drive"),
        (["{still}", "-o", "robot.json"], "must end in .toml"),
        (["{still}", "--world", "moon"], "no world 'moon'"),
        ([], "needs"),
    ],
)
def test_a_mistake_is_said_with_what_to_do(refused: Told, tmp_path: Path, arguments: list[str], says: str) -> None:
    file = still(tmp_path / "still.mcap")
    assert says in refused("fit", *(each.format(still=file) for each in arguments), code=None)
