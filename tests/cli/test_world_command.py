"""``elib world``: which worlds there are, what is in one, and whether a file is one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from elib_process import Told
from PIL import Image

from elib.cli import main
from elib.simulator.worlds.files import gallery, load_file

GATE = """about = "A gate to push open."
[arena]
size = [1.0, 0.8]
[[wall]]
from = [0.5, 0.0]
to = [0.5, 0.25]
[[box]]
name = "gate"
position = [0.5, 0.4]
size = [0.04, 0.2]
colour = "#d02020"
pushable = true
mass = 0.05
[[light]]
position = [0.9, 0.4]
[[stripe]]
points = [[0, 0.1], [1, 0.1]]
[[robot]]
position = [0.2, 0.4]
firmware = "epuck2"
"""


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    path = tmp_path / "gate.toml"
    path.write_text(GATE)
    return path


def test_the_list_has_a_line_for_every_world(printed: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    out = printed("world", "list")
    first = [line.split()[0] for line in out.splitlines() if not line.startswith(" ")]
    assert first == gallery()
    assert "soccer     1.7 x 1 m      4 robots   A field with two goals" in out
    assert max(map(len, out.splitlines())) <= 100


def test_the_list_as_json_has_all_of_it(printed: Told) -> None:
    out = printed("world", "list", "--json")
    assert out.count("\n") == 1
    worlds = {world["name"]: world for world in json.loads(out)["worlds"]}
    assert list(worlds) == gallery()
    assert (worlds["soccer"]["width"], worlds["soccer"]["depth"], worlds["soccer"]["robots"]) == (1.7, 1.0, 4)
    assert worlds["crowd"]["robots"] == 20
    assert "crowd" in worlds["crowd"]["about"]


def test_what_a_wall_or_a_box_shows_to_cameras_is_shown(gate: Path, printed: Told) -> None:
    gate.write_text(GATE.replace("to = [0.5", 'face = "tag:7"\nto = [0.5').replace("mass =", 'face = "tag:8"\nmass ='))
    out = " ".join(printed("world", "show", gate).split())
    assert "to (0.5, 0.25), shows tag:7" in out
    assert "pushable, 0.05 kg, shows tag:8" in out


def test_what_is_in_a_world_is_shown_a_line_a_thing(gate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["world", "show", str(gate)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert [line.strip() for line in out.splitlines()] == [
        "gate: A gate to push open.",
        "",
        "size    1 x 0.8 m",
        "time    steps of 0.015625 s, seed 0",
        "robots  (0.2, 0.4), heading 0, epuck2",
        "walls   (0.5, 0) to (0.5, 0.25)",
        "boxes   gate at (0.5, 0.4), 0.04 x 0.2 m, #d02020, pushable, 0.05 kg",
        "lights  (0.9, 0.4), intensity 1",
        "floor   #b0aca4",
        "1 stripe",
    ]


def test_what_the_robots_of_a_world_are_like_is_shown_as_its_file_says_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["world", "show", "maze"]) == 0
    assert "e-puck      ground_module = true" in capsys.readouterr().out


@pytest.mark.parametrize("name", gallery())
def test_a_world_that_comes_with_elib_is_copied_to_be_changed(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["world", "export", name]) == 0
    assert capsys.readouterr().out == f"wrote {name}.toml; open it as sim://{name}.toml\n"
    assert load_file(f"{name}.toml") == load_file(name)
    Path(f"{name}.toml").write_text("mine")
    assert main(["world", "export", name]) == 2
    assert f"{name}.toml exists already" in capsys.readouterr().err
    assert Path(f"{name}.toml").read_text() == "mine"
    assert main(["world", "export", name, "other.toml"]) == 0
    assert load_file("other.toml").about == load_file(name).about


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["maz"], "no world 'maz' comes with elib\nhint: did you mean maze?"),
        (["maze", "maze.txt"], "must end in .toml\nhint: name it maze.txt.toml"),
        (["maze", "none/maze.toml"], "none/maze.toml cannot be written: No such file or directory"),
    ],
)
def test_a_copy_that_cannot_be_made_is_refused(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["world", "export", *words]) == 2
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_many_things_are_counted_and_cut_short(printed: Told) -> None:
    out = printed("world", "show", "crowd", "--robots", "90")
    assert "size         3 x 3 m" in out
    assert "robots (90)  (" in out
    assert "and 79 more" in out


def test_a_world_as_json_has_everything_that_the_file_says(printed: Told, gate: Path) -> None:
    out = printed("world", "show", gate, "--json")
    assert "NaN" not in out
    shown = json.loads(out)
    assert (shown["name"], shown["about"], shown["robots"]) == ("gate", "A gate to push open.", 1)
    assert shown["scene"]["boxes"][0]["colour"] == "#d02020"
    assert shown["scene"]["boxes"][0]["is_pushable"] is True
    assert shown["scene"]["paint"][0]["points"] == [[0, 0.1], [1, 0.1]]
    assert shown["scene"]["model"]["profile"] == "measured"


def test_a_world_is_drawn_into_a_png_file(gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "gate.png"
    assert main(["world", "show", str(gate), "--png", str(path)]) == 0
    out, err = capsys.readouterr()
    assert "gate at" in out
    assert err == f"Drawn in {path}.\n"
    with Image.open(path) as picture:
        assert picture.width > picture.height > 400
        assert (0xD0, 0x20, 0x20) in {colour for _, colour in picture.convert("RGB").getcolors(1 << 24)}


def test_a_picture_that_cannot_be_written_is_a_failure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["world", "show", "square", "--png", str(tmp_path / "none" / "x.png")]) == 2
    assert "No such file" in capsys.readouterr().err


def test_a_correct_file_is_reported_as_correct(gate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["world", "check", str(gate)]) == 0
    out, err = capsys.readouterr()
    assert out == f"{gate} is a good world: 1 x 0.8 m, 1 wall, 1 box, 1 light, 1 robot.\n"
    assert err == ""


def test_every_world_of_the_gallery_passes_the_check(capsys: pytest.CaptureFixture[str]) -> None:
    for name in gallery():
        assert main(["world", "check", name]) == 0, name
        assert capsys.readouterr().out.startswith(f"{name} is a good world: ")


def test_a_bad_file_is_refused_with_its_line_and_a_cure(refused: Told, gate: Path) -> None:
    gate.write_text(GATE.replace("size = [0.04, 0.2]", "sise = [0.04, 0.2]"))
    err = refused("world", "check", gate, code=1)
    assert err == f"error: {gate}:10: box[0].sise is not a key of a world\nhint: did you mean size?\n"


def test_a_start_that_is_not_free_fails_the_check(refused: Told, gate: Path) -> None:
    gate.write_text(GATE.replace("position = [0.2, 0.4]", "position = [0.5, 0.42]"))
    assert f"{gate}:19: robot[0].position stands in a wall or an obstacle: box[0]" in refused(
        "world", "check", gate, code=1
    )


def test_a_file_without_the_ending_is_found_where_it_lies(
    printed: Told, gate: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(gate.parent)
    gate.rename("gate")
    assert main(["world", "check", "gate"]) == 0
    assert "A gate to push open." in printed("world", "show", "gate")


@pytest.mark.parametrize("words", [["check", "nowhere"], ["show", "nowhere"], ["check", "none.toml"]])
def test_a_missing_world_is_a_failure(refused: Told, words: list[str]) -> None:
    assert words[1] in refused("world", *words, code=1)


@pytest.mark.parametrize(
    "words",
    [["show"], ["check"], ["show", "square", "--robots", "-1"], ["list", "square"], ["lits"], ["show", "-x"]],
)
def test_a_wrong_command_line_is_wrong_usage(refused: Told, words: list[str]) -> None:
    assert refused("world", *words).startswith("error: ")


def test_more_robots_than_there_is_room_for_fail(refused: Told) -> None:
    assert "no room for 500 robots" in refused("world", "show", "square", "--robots", "500", code=1)


def test_the_command_alone_lists_its_parts(printed: Told) -> None:
    out = printed("world")
    assert all(f"  {part} " in out for part in ("check", "export", "import", "list", "show"))


def test_a_firmware_that_does_not_exist_is_named_with_its_robot(gate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gate.write_text(GATE.replace("epuck2", "epuck3"))
    assert main(["world", "check", str(gate)]) == 1
    line = gate.read_text().splitlines().index('firmware = "epuck3"') + 1
    assert f"{gate}:{line}: robot[0].firmware is 'epuck3'; it must be \"btcom-1.1.3\" or " in capsys.readouterr().err


def test_a_robot_with_wifi_may_stand_in_a_world(printed: Told, gate: Path) -> None:
    gate.write_text(GATE.replace("epuck2", "epuck2-wifi"))
    assert "is a good world" in printed("world", "check", gate)


def test_what_stands_outside_the_arena_is_noted(gate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gate.write_text(gate.read_text() + "\n[[light]]\nposition = [5, 0.5]\n[[wall]]\nfrom = [2, 0]\nto = [2, 1]\n")
    assert main(["world", "check", str(gate)]) == 0
    out, err = capsys.readouterr()
    assert "is a good world" in out
    assert err == "note: light[1] stands outside the arena, at (5, 0.5)\nnote: wall[1] stands outside the arena\n"


def test_what_stands_in_another_thing_is_noted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    world = tmp_path / "overlaps.toml"
    world.write_text(
        "[arena]\nsize = [2, 1]\n[[wall]]\nfrom = [0.5, 0]\nto = [0.5, 1]\n"
        "[[box]]\nposition = [0.5, 0.5]\nsize = [0.1, 0.1]\n"  # in the wall
        "[[box]]\nposition = [0.5, 0.58]\nsize = [0.1, 0.1]\n"  # likewise; with the one above it is one shape
        "[[box]]\nposition = [1.0, 0.5]\nsize = [0.1, 0.1]\npushable = true\n"
        "[[cylinder]]\nposition = [1.1, 0.5]\nradius = 0.06\n"  # in the box that can be pushed
        "[[cylinder]]\nposition = [1.23, 0.5]\nradius = 0.07\npushable = true\n"  # touches the other one
        "[[cylinder]]\nposition = [1.95, 0.5]\nradius = 0.07\n"
    )
    assert main(["world", "check", str(world)]) == 0
    assert sorted(capsys.readouterr().err.splitlines()) == [
        "note: box[0] stands in wall[0]",
        "note: box[1] stands in wall[0]",
        "note: box[2] stands in cylinder[0]",
        "note: cylinder[2] stands in the arena's wall",
    ]


@pytest.mark.parametrize(
    ("tokens", "hint"),
    [
        (["send", "version", "--robot", "sim://coridor"], "did you mean corridor? choose one of arena, "),
        (["send", "version", "--robot", "arena"], "write sim://arena\n"),
        (["run", "nothing"], "there are: "),
        (["et", "Perentile"], "did you mean Percentile?"),
        (["world", "check", "nowhere/mine.toml"], f"check its path; it was looked for in {Path.cwd()}\n"),
    ],
)
def test_a_misspelt_word_is_answered_with_a_hint(tokens: list[str], hint: str, refused: Told) -> None:
    assert f"\nhint: {hint}" in refused(*tokens, code=None)


def test_a_drawing_is_a_png_and_nothing_else(gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["world", "show", str(gate), "--png", str(tmp_path / "gate.svg")]) == 2
    assert "does not end in .png" in capsys.readouterr().err
    assert not (tmp_path / "gate.svg").exists()


PLAYGROUND = """<!DOCTYPE aseba-playground>
<aseba-playground>
<world w="100" h="80" groundTexture="floor.png"/>
<wall x="50" y="40" l1="20" l2="2" h="10"/>
<feeder x="10" y="10"/>
<robot type="e-puck" x="30" y="60"/>
</aseba-playground>"""


def test_a_foreign_world_is_imported_and_what_is_left_out_is_named(
    printed: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.playground").write_text(PLAYGROUND)
    Image.new("RGB", (4, 4)).save("floor.png")
    out = printed("world", "import", "mine.playground")
    assert out.splitlines() == [
        "mine.playground: 1 x 0.8 m, 1 box, 1 robot",
        "  line 5  feeder is left out",
        "wrote mine.toml; open it as sim://mine.toml",
    ]
    assert 'file = "floor.png"' in Path("mine.toml").read_text()
    assert "1 x 0.8 m, 1 box, 1 robot" in printed("world", "check", "mine.toml")


def test_an_import_never_replaces_a_file(refused: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.playground").write_text(PLAYGROUND)
    Path("out.toml").write_text("kept")
    assert "out.toml exists already" in refused("world", "import", "mine.playground", "-o", "out.toml")
    assert Path("out.toml").read_text() == "kept"
    assert "must end in .toml" in refused("world", "import", "mine.playground", "-o", "out.txt")
