"""Build the studio, a folder for any web server: ``make studio`` runs it.

In it are Python for browsers (Pyodide) from npm, msgspec built for it from the package index, elib without what a page
cannot use, and the page. Wheels of other packages for Pyodide, such as NumPy, are put beside them if a folder with
them is given; nothing is loaded from anywhere else.
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
STUDIO = ROOT / "build/studio"
sys.path[:0] = [str(ROOT), str(ROOT / "docs"), str(ROOT / ".node")]

import hatch_build  # noqa: E402
from generator.studio import known  # noqa: E402

PLATFORM, PYTHON = "pyemscripten_2026_0_wasm32", "3.14"
"""What Pyodide 314 calls itself in the names of wheels."""
LEFT_OUT = ("cli", "doors", "learn", "guides", "panel/page", "records/et", "tools/flash")
"""Parts of elib that nothing in a page uses: they need a terminal, a network, processes or ports."""
PATIENCE = 600.0
"""s that a step may take."""


def build(target: Path, wheels: Path | None = None) -> None:
    """Build the studio into a folder, in place of what is there.

    Args:
        target: The folder.
        wheels: A folder with wheels for Pyodide, which are loaded too.

    Raises:
        NoPage: Node, or what npm or the package index have, is not to be had here and now.
    """
    node = hatch_build.fetch(ROOT / "page")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "studio"
        folder.mkdir()
        add_elib(folder, Path(name))
        add_msgspec(folder, Path(name))
        for wheel in sorted(wheels.glob("*.whl")) if wheels else ():
            shutil.copy(wheel, folder)
        (folder / "known.json").write_text(json.dumps(known(), ensure_ascii=False), encoding="utf-8")
        run(node, str(ROOT / "page/build.mjs"), "--studio", str(folder))
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(folder, target)


def add_elib(folder: Path, work: Path) -> None:
    """Put elib's wheel into the studio, without the parts that are left out."""
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(work), ELIB_NO_PAGE="1")
    built = next(work.glob("elib_epuck-*.whl"))
    left_out = tuple(f"elib/{part}/" for part in LEFT_OUT)
    with zipfile.ZipFile(built) as whole, zipfile.ZipFile(folder / built.name, "w", zipfile.ZIP_DEFLATED) as part:
        for info in whole.infolist():
            if not info.filename.startswith(left_out):
                part.writestr(info, whole.read(info))


def add_msgspec(folder: Path, work: Path) -> None:
    """Fetch msgspec for Pyodide, of the version and with the checksum that everybody has."""
    locked = (ROOT / "requirements/core.txt").read_text(encoding="utf-8")
    pinned = re.search(r"^msgspec==(?:.*\\\n)*.*", locked, re.MULTILINE)
    assert pinned is not None
    (work / "msgspec.txt").write_text(pinned[0] + "\n", encoding="utf-8")
    kind = ("--only-binary", ":all:", "--platform", PLATFORM, "--python-version", PYTHON)
    pip = (
        sys.executable,
        "-m",
        "pip",
        "--disable-pip-version-check",
        "download",
        "--retries=1",
        "--quiet",
        "--no-deps",
    )
    done = tried(*pip, "--require-hashes", *kind, "--dest", str(folder), "-r", str(work / "msgspec.txt"))
    if done.returncode:
        raise hatch_build.NoPage(f"The studio is not built: msgspec for browsers cannot be fetched.\n{done.stderr}")


def run(*command: str, **environment: str) -> None:
    """Run a command in the project's folder; end with what it wrote if it fails."""
    done = tried(*command, **environment)
    if done.returncode:
        sys.exit(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")


def tried(*command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a command in the project's folder, and return how it ended."""
    env = {**os.environ, **environment}
    return subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, timeout=PATIENCE, check=False)


def sizes(folder: Path) -> str:
    """Return how big the studio is, and how much of it goes over the line where the server compresses."""
    files = [path.read_bytes() for path in folder.iterdir()]
    packed = sum(len(gzip.compress(each, 6)) for each in files)
    return f"{len(files)} files, {sum(map(len, files)) / 1e6:.1f} MB, compressed {packed / 1e6:.1f} MB"


def main() -> None:
    """Read the command line and build."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--to", type=Path, default=STUDIO, help="the folder to write, in place of what is there")
    parser.add_argument("--wheels", type=Path, help="a folder with wheels for Pyodide, which are loaded too")
    given = parser.parse_args()
    try:
        build(given.to, given.wheels)
    except hatch_build.NoPage as error:
        print(error, file=sys.stderr)
        sys.exit(hatch_build.NOT_BUILT)
    print(f"{given.to}: {sizes(given.to)}. To open it: elib studio, or any web server.")


if __name__ == "__main__":
    main()
