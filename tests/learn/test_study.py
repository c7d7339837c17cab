"""A study survives whatever happens to its program, goes on to the same result, and refuses what would spoil it."""

import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError, ElibError
from elib.learn.journal import Journal
from elib.learn.study import Generation, Settings, Study, read_study, settings_of

SETTINGS = Settings("avoid", population=3, generations=4, seed=7)


def line(number: int, value: float = 0.1) -> Generation:
    return Generation(number, "00ff", [1, 2], [value, 1 / 3, -2e-300], [0.0, 0.5, 1.0], [1.0, 0.5, 0.0])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study of two generations."""
    with Study(tmp_path / "study", SETTINGS) as study:
        study.append(line(1))
        study.append(line(2))
    return tmp_path / "study"


def test_a_study_is_read_back_to_the_last_bit(folder: Path) -> None:
    assert read_study(folder) == (SETTINGS, [line(1), line(2)])
    with Study(folder, SETTINGS) as study:
        assert study.generations == [line(1), line(2)]


def test_the_settings_are_a_file_that_people_can_read(folder: Path) -> None:
    text = (folder / "study.toml").read_text()
    for part in ("[settings]", 'task = "avoid"', "population = 3", "seed = 7", "[versions]", "elib = ", "numpy = "):
        assert part in text


def test_a_task_in_a_folder_with_any_name_is_read_back(tmp_path: Path) -> None:
    (tmp_path / "ünï-🤖").mkdir()
    (tmp_path / "ünï-🤖" / "mine.py").touch()
    settings = replace(SETTINGS, task=f"{tmp_path}/ünï-🤖/mine.py:TASK")
    Study(tmp_path / "study", settings).close()
    assert settings_of(tmp_path / "study") == settings


@pytest.mark.parametrize("torn", [b'{"generation": 3, "fit', b"{}{}\n", b"\0\0\0\0", b"\xff\n", b'{"generation": 3}'])
def test_a_last_line_that_was_not_written_to_its_end_is_dropped(folder: Path, torn: bytes) -> None:
    path = folder / "generations.jsonl"
    whole = path.read_bytes()
    path.write_bytes(whole + torn)
    assert read_study(folder)[1] == [line(1), line(2)]
    with Study(folder, SETTINGS) as study:
        assert len(study.generations) == 2
        assert path.read_bytes() == whole
        study.append(line(3))
    assert read_study(folder)[1] == [line(1), line(2), line(3)]


def test_a_damaged_line_in_the_middle_is_named(folder: Path) -> None:
    path = folder / "generations.jsonl"
    first, second = path.read_text().splitlines()
    path.write_text(f"{first[:20]}\n{second}\n")
    with pytest.raises(ElibError, match=r"generations\.jsonl:1: this line is damaged"):
        Study(folder, SETTINGS)
    path.write_text(f"{second}\n{first}\n")
    with pytest.raises(ElibError, match=r"generations\.jsonl:1: this is not generation 1 of 3 individuals"):
        Study(folder, SETTINGS)
    assert path.read_text() == f"{second}\n{first}\n"


def test_two_programs_cannot_write_one_study(folder: Path) -> None:
    with Study(folder, SETTINGS):
        with pytest.raises(ElibError, match="another program writes into"):
            Study(folder, SETTINGS)
        assert len(read_study(folder)[1]) == 2  # To read it is possible.
    Study(folder, SETTINGS).close()


def test_the_lock_of_a_killed_program_is_gone(tmp_path: Path) -> None:
    path = tmp_path / "generations.jsonl"
    code = f"""
import pathlib, sys
from elib.learn.journal import Journal
journal = Journal(pathlib.Path({str(path)!r}))
journal.append({{"generation": 1}})
print("open", flush=True)
sys.stdin.read()
"""
    other = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        assert other.stdout is not None
        assert other.stdout.readline() == b"open\n"
        with pytest.raises(ElibError, match="another program"):
            Journal(path)
    finally:
        other.kill()
        other.communicate()
    with Journal(path) as journal:
        assert journal.lines == [{"generation": 1}]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"seed": 8}, "seed is 7 there, and 8 now"),
        ({"population": 4, "algorithm": "ga"}, "algorithm is 'cma' there, and 'ga' now; population is 3 there, and 4"),
        ({"seconds": 5.0}, "seconds is 0.0 there, and 5.0 now"),
    ],
)
def test_other_settings_are_refused_with_what_differs(folder: Path, changes: dict, said: str) -> None:
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(ArgumentError, match=said):
        Study(folder, replace(SETTINGS, **changes))
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_another_version_of_elib_is_refused(folder: Path) -> None:
    path = folder / "study.toml"
    path.write_text(path.read_text().replace('elib = "', 'elib = "0.0.'))
    with pytest.raises(ArgumentError, match=r"elib was 0\.0\..* there, and is .* now"):
        Study(folder, SETTINGS)


def test_a_file_of_the_user_that_was_changed_is_refused(tmp_path: Path) -> None:
    task = tmp_path / "mine.py"
    task.write_text("TASK = 1\n")
    settings = replace(SETTINGS, task=f"{task}:TASK")
    with Study(tmp_path / "study", settings) as study:
        study.append(line(1))
    Study(tmp_path / "study", settings).close()
    task.write_text("TASK = 2\n")
    with pytest.raises(ArgumentError, match=r"mine\.py was changed"):
        Study(tmp_path / "study", settings)


def test_a_study_without_a_generation_begins_anew_with_a_mended_task_and_other_settings(tmp_path: Path) -> None:
    task = tmp_path / "mine.py"
    task.write_text("TASK = 1\n")
    settings = replace(SETTINGS, task=f"{task}:TASK")
    Study(tmp_path / "study", settings).close()
    task.write_text("TASK = 2\n")
    mended = replace(settings, seed=8)
    with Study(tmp_path / "study", mended) as study:
        study.append(line(1))
    Study(tmp_path / "study", mended).close()
    assert settings_of(tmp_path / "study") == mended


def test_a_study_may_get_more_generations_but_not_fewer_than_it_has(folder: Path) -> None:
    with Study(folder, replace(SETTINGS, generations=10)) as study:
        assert len(study.generations) == 2
    assert settings_of(folder).generations == 10
    with pytest.raises(ArgumentError, match="already has 2 generations, more than 1"):
        Study(folder, replace(SETTINGS, generations=1))
    assert settings_of(folder).generations == 10


def test_a_folder_with_other_files_is_refused_and_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("important")
    with pytest.raises(ArgumentError, match="holds other files and no study"):
        Study(tmp_path, SETTINGS)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_study_that_was_killed_before_its_settings_were_written_begins_again(tmp_path: Path) -> None:
    (tmp_path / "generations.jsonl").touch()
    (tmp_path / ".study.toml.x1y2.toml").touch()
    with Study(tmp_path, SETTINGS):
        assert {path.name for path in tmp_path.iterdir()} == {"study.toml", "generations.jsonl"}


def test_a_folder_without_a_study_is_named(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="there is no study in"):
        settings_of(tmp_path)
    (tmp_path / "study.toml").write_text("[settings]\npopulation = ")
    with pytest.raises(ArgumentError, match=r"study\.toml is damaged"):
        settings_of(tmp_path)


@pytest.mark.parametrize(
    "wrong", [{"population": 1}, {"generations": 0}, {"seconds": -1.0}, {"seed": -1}, {"scenarios": 0}]
)
def test_settings_have_ranges(wrong: dict) -> None:
    with pytest.raises(ArgumentError, match=f"{next(iter(wrong))} is .*; it must be"):
        replace(SETTINGS, **wrong)


def test_no_two_generations_share_a_seed() -> None:
    seeds = [seed for number in range(200) for seed in SETTINGS.seeds(number, 5)]
    assert len(set(seeds)) == 1000
    assert SETTINGS.seeds(3, 5) == seeds[15:20]
    assert SETTINGS.seeds(3, 2) != replace(SETTINGS, seed=8).seeds(3, 2)


def test_a_number_that_is_not_finite_never_gets_into_the_file(folder: Path) -> None:
    with Study(folder, SETTINGS) as study, pytest.raises(ValueError):
        study.append(line(3, float("nan")))
    assert len(read_study(folder)[1]) == 2


def test_the_result_is_noted_beside_the_settings(folder: Path) -> None:
    with Study(folder, SETTINGS) as study:
        study.note({"fitness": 0.1 + 0.2, "solved": 1.0})
    assert "fitness = 0.30000000000000004" in (folder / "study.toml").read_text()
    assert settings_of(folder) == SETTINGS
    assert asdict(settings_of(folder)) == asdict(SETTINGS)
    Study(folder, SETTINGS).close()
