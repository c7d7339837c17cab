"""Reading labs: what a good one says, and how each mistake is named."""

from __future__ import annotations

from pathlib import Path

import pytest
from labs_for_tests import GIVEN, SURVIVES, TOP, lab_in, run_program

from elib.base.errors import ArgumentError, SimulationError, Unsupported
from elib.lab import find_lab, labfile, load_lab
from elib.lab.labfile import shipped_labs


def goal(keys: str) -> str:
    return f'[[goal]]\nname = "goal"\n{keys}\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TOP + GIVEN, r"goal is missing.*write \[\[goal\]\], and below it kind = .reach."),
        (TOP + SURVIVES, "variant is missing"),
        (TOP.replace("title", "titel") + GIVEN + SURVIVES, "lab.toml:1: titel is not a key of a lab.*mean title"),
        (TOP.replace("20", "0") + GIVEN + SURVIVES, "lab.toml:3: time is 0 s; it must be a number from 1 to 600 s"),
        (TOP + GIVEN + "[[gaol]]\n" + SURVIVES, "gaol is not a key of a lab.*did you mean goal"),
        (TOP + GIVEN + goal("points = 1"), r"lab.toml:7: goal\[0\].kind is missing; it must be .reach."),
        (TOP + GIVEN + goal('kind = "reech"'), r"lab.toml:9: goal\[0\].kind is .reech.*did you mean reach"),
        (TOP + GIVEN + goal('kind = "reach"'), r"goal\[0\].zone is missing"),
        (
            TOP + GIVEN + goal('kind = "reach"\nzone = "x"\nholds = 1'),
            'holds is not a key of a goal of the kind "reach"',
        ),
        (TOP + GIVEN + goal('kind = "reach"\nzone = "x"'), r"lab.toml:10: goal\[0\].zone names .x., and there is no"),
        (TOP + GIVEN + goal('kind = "visit"\nzones = []'), r"goal\[0\].zones is \[\]; it must be a list of 1 to 50"),
        (TOP + GIVEN + goal('kind = "turned"'), r"goal\[0\].least is missing.*write least = 350"),
        (TOP + GIVEN + goal('kind = "pose"'), r"goal\[0\].position is missing"),
        (TOP + GIVEN + goal('kind = "says"\ntext = "("'), r"goal\[0\].text is not a regular expression"),
        (
            TOP + GIVEN + goal('kind = "stands"\nrobot = 2'),
            r"robot is 2, but there are 1 robots, in the variant 'given'",
        ),
        (TOP + GIVEN + goal('kind = "follow-line"\nstripe = 2'), r"stripe is 2, but the world has 1 stripes"),
        (TOP + GIVEN + goal('kind = "push"\nthing = "crat"\nzone = "z"'), r"goal\[0\].zone names .z."),
        (TOP + GIVEN + goal('kind = "requests"\ncommand = "proximty"'), "is not a command.*did you mean proximity"),
        (TOP + GIVEN + goal('kind = "stands"\nneeds = ["x"]'), r"goal\[0\].needs names .x., which is not another goal"),
        (TOP + GIVEN + SURVIVES + SURVIVES, r"goal\[1\].name is .ends. again"),
        (TOP + GIVEN + GIVEN + SURVIVES, r"variant\[1\].name is there twice"),
        (
            TOP + GIVEN.replace("world.toml", "nix.toml") + SURVIVES,
            r"lab.toml:6: variant\[0\].world is .*nix.toml.*cannot be read",
        ),
        (TOP + GIVEN.replace("world.toml", "arina") + SURVIVES, r"variant\[0\].world is .arina.*did you mean arena"),
        (TOP + GIVEN + 'fault = "x"\n' + SURVIVES, r"lab.toml:7: variant\[0\].fault is .x."),
        (TOP + GIVEN + 'firmware = "epuck3"\n' + SURVIVES, r"variant\[0\].firmware is .epuck3.*did you mean epuck2"),
        (TOP + GIVEN + SURVIVES + '[[zone]]\nname = "z"\nposition = [0, 0]\n', "needs a radius or a size"),
        (
            TOP + GIVEN + SURVIVES + '[[zone]]\nname = "z"\nposition = [0, 0]\nradius = 1\nvariant = "gven"\n',
            r"zone\[0\].variant is .gven.*did you mean given",
        ),
    ],
)
def test_a_mistake_is_named_with_its_place_and_a_cure(tmp_path: Path, text: str, message: str) -> None:
    lab_in(tmp_path)
    (tmp_path / "lab.toml").write_text(text)
    with pytest.raises(SimulationError) as failure:
        load_lab(tmp_path)
    assert failure.match(f"(?s){message}")


def test_what_holds_for_all_variants_is_said_once(tmp_path: Path) -> None:
    both = GIVEN + '[[variant]]\nname = "fast"\nworld = "arena"\ntime = 5\nfirmware = "epuck2"\n'
    lab = lab_in(tmp_path, variants=both, top=TOP + 'firmware = "btcom-2.0"\n')
    assert [(each.time, each.firmware) for each in lab.variants] == [(20, "btcom-2.0"), (5, "epuck2")]
    assert lab.variant("fast").world == "arena"
    with pytest.raises(ArgumentError, match=r"(?s)no variant 'fats'.*did you mean fast"):
        lab.variant("fats")


def test_the_teachers_variants_are_hidden(tmp_path: Path) -> None:
    lab_in(tmp_path)
    teacher = tmp_path / "teacher"
    teacher.mkdir()
    (teacher / "hidden.toml").write_text('[[variant]]\nname = "other"\nworld = "../world.toml"\n')
    assert [each.name for each in load_lab(tmp_path).variants] == ["given"]
    assert [each.name for each in load_lab(tmp_path, hidden=True).variants] == ["given", "other"]
    (teacher / "hidden.toml").write_text(SURVIVES)
    with pytest.raises(SimulationError, match=r"hidden\.toml:1: goal is not a key of a lab"):
        load_lab(tmp_path, hidden=True)


def test_the_lab_of_a_program_is_the_nearest_above_it(tmp_path: Path) -> None:
    lab_in(tmp_path)
    deep = tmp_path / "mine" / "today"
    deep.mkdir(parents=True)
    assert find_lab(deep / "program.py") == tmp_path.resolve()
    with pytest.raises(ArgumentError, match="name the lab"):
        find_lab("/program.py")


def test_the_labs_that_come_with_elib_are_read_by_their_names() -> None:
    assert "go-10-cm" in shipped_labs()
    assert load_lab("go-10-cm").title == "Go 10 cm"
    with pytest.raises(ArgumentError, match=r"did you mean go-10-cm\?"):
        load_lab("go-11-cm")


def test_a_hidden_variant_of_the_same_name_is_found_in_its_own_file(tmp_path: Path) -> None:
    lab_in(tmp_path)
    (tmp_path / "teacher").mkdir()
    (tmp_path / "teacher" / "hidden.toml").write_text(GIVEN.replace("world.toml", "../world.toml"))
    with pytest.raises(SimulationError, match=r"hidden\.toml:\d+: variant\[0\]\.name is there twice"):
        load_lab(tmp_path, hidden=True)


def test_a_lab_whose_extra_is_missing_is_not_checked_and_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = lab_in(tmp_path, top=TOP + 'extra = "vision"\n')
    monkeypatch.setitem(labfile.EXTRAS, "vision", "elib_has_no_such_package")
    assert (lab.lacks, lab_in(tmp_path).lacks) == ("vision", "")
    with pytest.raises(Unsupported, match="need the extra vision, which is not installed here") as caught:
        run_program(lab, "print('never')")
    assert "vision" in caught.value.hint
