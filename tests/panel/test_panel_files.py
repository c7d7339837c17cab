"""Names of files from a page: one folder, and no way out of it."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError
from elib.panel.files import LOG, RECORDING, Folder


def test_a_plain_name_is_a_file_of_the_folder(tmp_path: Path) -> None:
    for name, file in (
        ("run", "run.log"),
        ("run.log", "run.log"),
        (" Lauf 2 ", "Lauf 2.log"),
        ("Übung_1-a.LOG", "Übung_1-a.LOG"),
    ):
        assert Folder(tmp_path).file(name, LOG) == tmp_path.resolve() / file


def test_what_leads_elsewhere_or_is_no_name_is_refused(tmp_path: Path) -> None:
    names = [
        "",
        "   ",
        ".",
        "..",
        "../run.log",
        "..\\run.log",
        "a/b.log",
        "/etc/passwd",
        "C:run.log",
        "C:\\run.log",
        "run.log:stream",
        "\\\\host\\share",
        "~/run.log",
        "~root",
        "%2e%2e%2frun.log",
        "run.log\0.png",
        "run\n.log",
        "\u202erun.log",
        ".hidden.log",
        "-rf.log",
        "run.txt",
        "run.log.",
        "con.log",
        "NUL",
        "com1.log",
        "aux.1.log",
        "$HOME.log",
        "`id`.log",
        "a" * 200,
    ]
    for name in names:
        with pytest.raises(ArgumentError):
            raise AssertionError(f"{name!r} is {Folder(tmp_path).file(name, LOG)}")
    assert list(tmp_path.iterdir()) == []


def test_a_recording_is_new_and_a_log_may_go_on(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    (tmp_path / "run.mcap").touch()
    (tmp_path / "run.log").touch()
    assert folder.file("run", LOG).exists()
    with pytest.raises(ArgumentError, match="exists") as refused:
        folder.new_file("run", RECORDING)
    assert "run-2.mcap" in str(refused.value)
    assert folder.new_file("other", RECORDING).name == "other.mcap"


@pytest.mark.skipif(sys.platform == "win32", reason="links and pipes need rights there")
def test_links_pipes_and_folders_are_no_files(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "outside.log").touch()
    (inside / "link.log").symlink_to(tmp_path / "outside.log")
    (inside / "dangling.log").symlink_to(tmp_path / "not-there.log")
    os.mkfifo(inside / "pipe.log")
    (inside / "folder.log").mkdir()
    for name in ("link", "dangling", "pipe", "folder"):
        with pytest.raises(ArgumentError, match="not a plain file"):
            Folder(inside).file(name, LOG)


def test_a_free_name_is_offered_and_is_one_that_will_be_taken(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    (tmp_path / "taken.log").touch()
    (tmp_path / "taken-2.log").touch()
    for stem, name in (
        ("epuck-1", "epuck-1.log"),
        ("sim://square?speed=max", "sim-square-speed-max.log"),
        ("../..", "run.log"),
        ("con", "con-1.log"),
        ("taken", "taken-3.log"),
        ("<script>", "script.log"),
    ):
        assert folder.free(stem, ".log") == name
        assert folder.file(folder.free(stem * 50, LOG), LOG)


def test_a_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="is not a folder"):
        Folder(tmp_path / "nowhere")
