"""What the guide to parity shows is what the commands print."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from elib.cli import main

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs/guides/parity.md").read_text(encoding="utf-8")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", GUIDE, re.MULTILINE | re.DOTALL)


def require_alike(shown: str, printed: str) -> None:
    """The same words; figures may differ in their last digits from computer to computer."""
    assert [NUMBER.sub("#", line).split() for line in shown.splitlines()] == [
        NUMBER.sub("#", line).split() for line in printed.splitlines()
    ]
    for ours, theirs in zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True):
        assert float(theirs) == pytest.approx(float(ours), rel=0.05, abs=0.05)


def test_the_guide_shows_what_its_commands_print(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (world,) = blocks("toml")
    Path("mine.toml").write_text(world, encoding="utf-8")
    plain, fit, fitted = blocks("text")
    shown = {
        'elib run calibration-drive --robot "sim://mine.toml?seed=3&latency=0.023&speed=max" --record drive.mcap': "",
        "elib compare drive.mcap --plot compared.png": plain,
        "elib fit drive.mcap -o robot.toml": fit,
        "elib compare drive.mcap --profile robot.toml": fitted,
        "elib compare monday.mcap friday.mcap --plot week.png": "",
    }
    lines = [line.removeprefix("$ ") for block in blocks("console") for line in block.splitlines()]
    assert lines == list(shown)
    for line, text in shown.items():
        if "monday.mcap" in line:  # of another day
            for name in ("monday.mcap", "friday.mcap"):
                shutil.copy("drive.mcap", name)
        assert main(shlex.split(line)[1:]) == 0
        printed = capsys.readouterr().out.splitlines()
        require_alike(text, "\n".join(printed[: len(text.splitlines())]))
    assert {"compared.png", "week.png"} <= {path.name for path in tmp_path.iterdir()}
