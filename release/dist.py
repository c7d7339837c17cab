"""Build the source archive and the wheel of the last commit into dist/, and check them; ``make dist`` runs it.

Both hold what the commit holds and the page that is built from it, and are the same to the last byte each time. The
wheel is installed into a fresh environment, alone and with each extra in turn, and a command that needs the extra is
run there.
"""

from __future__ import annotations

import io
import os
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

ROOT = Path(__file__).parent.parent
DIST = ROOT / "dist"
PAGE = "src/elib/panel/page"
UV = shutil.which("uv") or str(ROOT / ".uv/bin/uv")
PATIENCE = 300.0
"""s that a command may take on a busy machine before it counts as hanging."""


def main() -> None:
    """Build, check and install."""
    with tempfile.TemporaryDirectory() as folder:
        work, commit = Path(folder), Path(folder) / "commit"
        tracked = export(commit)
        first = source, wheel = build(commit, work / "first")  # the wheel is built from the source archive
        built = commit / PAGE
        if not built.exists():
            sys.exit("The page was not built: that needs npm and its registry.")
        page = {f"{PAGE}/{file.name}" for file in built.iterdir()}
        shutil.rmtree(built)  # it is built a second time too
        for archive, again in zip(first, build(commit, work / "second", "--sdist", "--wheel"), strict=True):
            if archive.read_bytes() != again.read_bytes():
                sys.exit(f"a second {archive.name} is not the same")
        check_files(tracked | page, source, wheel)
        version = wheel.name.split("-")[1]
        print(f"{source.name}: {len(tracked)} files, {wheel.name}: version {version}; both the same when built again")
        project = tomllib.loads((commit / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        for extra in ("", *project["optional-dependencies"]):
            install(wheel, extra, work / "environment", version)
        DIST.mkdir(exist_ok=True)
        for file in first:
            shutil.copy(file, DIST)
            print(f"dist/{file.name}  {file.stat().st_size / 1e6:.1f} MB")


def export(folder: Path) -> set[str]:
    """Write the last commit to *folder*; return the names of its files."""
    if run("git", "status", "--porcelain", where=ROOT):
        print("There are changes that are not committed; they are not part of what is built.", file=sys.stderr)
    done = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True)
    # The files in the archives get the time of the commit; without this they would all be of 2020.
    os.environ["SOURCE_DATE_EPOCH"] = run("git", "log", "-1", "--format=%ct", where=ROOT).strip()
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        archive.extractall(folder, filter="data")
        return {each.name for each in archive if not each.isdir()}


def build(folder: Path, into: Path, *kinds: str) -> tuple[Path, Path]:
    """Build the source archive and the wheel of *folder*, and return their paths."""
    here = ("--no-build-isolation", "--python", sys.executable)  # with the hatchling that is installed
    run(UV, "build", *here, *kinds, "--out-dir", str(into), where=folder)
    return next(into.glob("*.tar.gz")), next(into.glob("*.whl"))


def check_files(files: set[str], source: Path, wheel: Path) -> None:
    """Check that the archives hold the files of the commit and the page, and nothing else."""
    with tarfile.open(source) as archive:
        in_source = {each.name.partition("/")[2] for each in archive if not each.isdir()}
    in_wheel = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    wanted = {name.removeprefix("src/") for name in files if name.startswith("src/")}
    wanted |= {name.replace("docs/", "elib/", 1) for name in files if name.startswith("docs/guides/")}
    for what, found, expected in (
        ("the source archive", in_source, files | {"PKG-INFO"}),
        ("the wheel", in_wheel, wanted),
    ):
        if found != expected:
            sys.exit(f"{what}: missing {sorted(expected - found)}, too many {sorted(found - expected)}")


def install(wheel: Path, extra: str, folder: Path, version: str) -> None:
    """Install the wheel into a fresh environment, and run a program there."""
    shutil.rmtree(folder, ignore_errors=True)
    seed = () if extra else ("--seed",)  # with pip
    run(UV, "venv", "--quiet", *seed, "--python", sys.executable, str(folder), where=ROOT)
    what = f"{wheel}[{extra}]" if extra else str(wheel)
    constraints = str(ROOT / "requirements/dev.txt")
    run(UV, "pip", "install", "--quiet", "--python", str(folder), "--constraints", constraints, what, where=ROOT)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    trial = folder / "trial"
    trial.mkdir()
    if run(str(programs / "elib"), "--version", where=trial).strip() != f"elib {version}":
        sys.exit(f"elib --version does not say {version}")
    TRIALS[extra](programs, trial)
    print(f"installed with {extra or 'no extra'}, and tried", flush=True)


def run(*command: str, where: Path) -> str:
    """Run a command and return what it printed; end with its output if it fails."""
    done = subprocess.run(command, cwd=where, capture_output=True, text=True, timeout=PATIENCE, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\nended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def writes(file: str, *arguments: str) -> Callable[[Path, Path], None]:
    """Return the trial that a command writes a file."""

    def trial(programs: Path, folder: Path) -> None:
        run(str(programs / arguments[0]), *arguments[1:], where=folder)
        if not (folder / file).stat().st_size:
            sys.exit(f"{' '.join(arguments)} wrote nothing into {file}")

    return trial


def core(programs: Path, folder: Path) -> None:
    """Run the demo; then ask for what needs an extra, and install it by the command that the hint gives."""
    writes("elib-demo.png", "elib", "demo", "--for", "2")(programs, folder)
    for listed in ("world", "lab"):
        run(str(programs / "elib"), listed, "list", where=folder)
    said = flash_said(programs, folder)
    hint = said.partition("install the extra flash: ")[2].strip()
    if not hint:
        sys.exit(f"elib flash said, without its extra:\n{said}")
    subprocess.run(hint, cwd=folder, shell=True, check=True, capture_output=True, timeout=PATIENCE)
    flash(programs, folder)


def parquet(programs: Path, folder: Path) -> None:
    """Write the rows of a log as Parquet."""
    run(str(programs / "elib"), "run", "avoid", *FAST, "--log", "run.log", where=folder)
    writes("calls.parquet", "et", "Join", "-s", "run.log", "-d", "calls.parquet")(programs, folder)


def serves(says: str, *arguments: str) -> Callable[[Path, Path], None]:
    """Return the trial that a command serves, says where, and ends by Ctrl-C."""

    def trial(programs: Path, folder: Path) -> None:
        command = [str(programs / "elib"), *arguments, "--port", "0", "sim://"]
        with subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as served:
            assert served.stdout is not None
            first = served.stdout.readline()
            served.send_signal(signal.SIGINT)
            rest = served.communicate(timeout=PATIENCE)[0]
        if says not in first + rest:
            sys.exit(f"{' '.join(command)} said:\n{first}{rest}")

    return trial


def flash(programs: Path, folder: Path) -> None:
    """Read an Intel HEX file: the smallest one, of which elib says that it holds no program."""
    said = flash_said(programs, folder)
    if "empty.hex" not in said or "intelhex" in said:
        sys.exit(f"elib flash said:\n{said}")


def flash_said(programs: Path, folder: Path) -> str:
    """Return what ``elib flash`` says about an empty file."""
    (folder / "empty.hex").write_text(":00000001FF\n")
    command = [str(programs / "elib"), "flash", "--dry-run", "empty.hex"]
    return subprocess.run(command, cwd=folder, stderr=subprocess.PIPE, text=True, timeout=PATIENCE, check=False).stderr


def compiled(programs: Path, folder: Path) -> None:
    """Move a world by the compiled engine."""
    text = "import elib; elib.World.load('arena', engine='compiled').step()"
    run(str(programs / "python"), "-c", text, where=folder)


def everything(programs: Path, folder: Path) -> None:
    """Try all extras in one environment."""
    for extra, trial in TRIALS.items():
        if extra not in ("", "all"):
            trial(programs, folder)


FAST: Sequence[str] = ("--robot", "sim://?speed=max", "--for", "2")
EVOLVED: Sequence[str] = ("avoid", "--population", "4", "--generations", "1", "--seconds", "1", "--out", "study")
TRIALS: dict[str, Callable[[Path, Path], None]] = {
    "": core,
    "plot": writes("run.png", "elib", "run", "avoid", *FAST, "--plot", "run.png"),
    "record": writes("run.mcap", "elib", "record", "run.mcap", *FAST),
    "parquet": parquet,
    "web": serves("http://127.0.0.1:", "joystick", "--no-browser"),
    "flash": flash,
    "compiled": compiled,
    "learn": writes("study/best.toml", "elib", "evolve", *EVOLVED),
    "foxglove": serves("ws://127.", "foxglove"),
    "agent": serves("http://127.0.0.1:", "agent", "--http"),
    "all": everything,
}
"""What is tried with each extra; a new extra needs its line here."""

if __name__ == "__main__":
    main()
