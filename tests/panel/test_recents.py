"""Recent robots: remembered for the next time, and never a reason to fail."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError
from elib.panel.recents import MAX_KEPT, RecentRobots, state_folder


def test_robots_are_remembered_the_newest_first_and_once(tmp_path: Path) -> None:
    path = tmp_path / "state" / "robots.json"
    for url in ("sim://", "serial:///dev/rfcomm0", "sim://maze", "sim://"):
        assert RecentRobots(path).add(url)
    assert RecentRobots(path).urls == ["sim://", "sim://maze", "serial:///dev/rfcomm0"]
    assert RecentRobots(path).remove("sim://maze")
    assert RecentRobots(path).urls == ["sim://", "serial:///dev/rfcomm0"]
    assert [each.name for each in path.parent.iterdir()] == ["robots.json"]


def test_only_so_many_are_remembered(tmp_path: Path) -> None:
    recents = RecentRobots(tmp_path / "robots.json")
    for number in range(MAX_KEPT + 5):
        recents.add(f"tcp://127.0.0.1:{4000 + number}")
    assert len(recents.urls) == MAX_KEPT
    assert recents.urls[0] == f"tcp://127.0.0.1:{4000 + MAX_KEPT + 4}"


def test_a_damaged_file_counts_as_none_and_is_kept_beside(tmp_path: Path) -> None:
    texts = [b"", b"{", b"\xff\xfe", b"[]", b'{"robots": 7}', b"null", b"[" * 100_000, b'"' + b"a" * 100_000]
    texts.append(b'{"robots": ["\xff"]}')
    for number, text in enumerate(texts):
        path = tmp_path / f"{number}.json"
        path.write_bytes(text)
        recents = RecentRobots(path)
        assert recents.urls == [], text[:20]
        assert recents.add("sim://")
        assert recents.urls == ["sim://"]
        assert path.with_suffix(".damaged").read_bytes() == text


def test_what_is_no_url_in_the_file_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "robots.json"
    path.write_text(json.dumps({"robots": [7, None, "no://such", "sim://", "a" * 9999, "sim://", "sim://a\nb"]}))
    assert RecentRobots(path).urls == ["sim://"]


def test_what_is_no_url_is_not_remembered(tmp_path: Path) -> None:
    recents = RecentRobots(tmp_path / "robots.json")
    for url in ("", "no://such", 7, None, "sim://" + "a" * 999, "sim://a\nb"):
        with pytest.raises(ArgumentError):
            recents.add(url)  # type: ignore[arg-type]
        assert not recents.path.exists(), url


def test_where_nothing_can_be_written_nothing_fails(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    recents = RecentRobots(tmp_path / "file" / "robots.json")
    assert recents.urls == []
    assert not recents.add("sim://")


def test_the_folder_is_the_one_the_system_has_for_that(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert state_folder() == tmp_path / "elib"
    monkeypatch.setenv("XDG_STATE_HOME", "relative")
    assert state_folder() == Path.home() / ".local/state/elib"
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setenv("APPDATA", str(tmp_path))
    assert state_folder() == tmp_path / "elib"
    monkeypatch.setattr("sys.platform", "darwin")
    assert state_folder() == Path.home() / "Library/Application Support/elib"
