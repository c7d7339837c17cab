"""The pictures of the tutorial are what its programs do, and every picture is shown somewhere and is small."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from pages import PAGES, ROOT
from PIL import Image, ImageChops, ImageStat

from shared import PATIENCE

IMAGES = ROOT / "docs/images"
MADE = sorted(path.name for path in IMAGES.glob("tutorial-*"))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pictures")
    script = ROOT / "docs/make_pictures.py"
    done = subprocess.run(
        [sys.executable, script, "--to", folder], capture_output=True, text=True, timeout=4 * PATIENCE
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.long
def test_the_script_makes_all_pictures_of_the_tutorial(made: Path) -> None:
    assert sorted(path.name for path in made.iterdir()) == MADE


@pytest.mark.long
def test_each_picture_is_what_the_script_makes(made: Path) -> None:
    assert [name for name in MADE if not is_alike(IMAGES / name, made / name)] == [], "renew them with: make pictures"


def is_alike(one: Path, other: Path) -> bool:
    if one.suffix == ".svg":
        return one.read_text() == other.read_text()
    with Image.open(one) as first, Image.open(other) as second:
        difference = ImageChops.difference(first.convert("RGB"), second.convert("RGB"))
    return max(ImageStat.Stat(difference).mean) < 2  # another version of Pillow may choose other shades


def test_every_picture_is_shown_and_is_small() -> None:
    shown = {name for page in PAGES for name in re.findall(r"images/([\w./-]+)\)", page.read_text(encoding="utf-8"))}
    files = {path.relative_to(IMAGES).as_posix(): path.stat().st_size for path in IMAGES.rglob("*.*")}
    assert set(files) - shown == {"favicon.svg"}
    assert {name: size for name, size in files.items() if size > (1_500_000 if name == "panel.webp" else 300_000)} == {}
