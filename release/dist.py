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
PATIENCE = 300.0
"""s that a command may take on a busy machine before it counts as hanging."""


def main() -> None:
    """Build, check and install."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        tracked = export(work / "commit")
        version, extras = read_project(work / "commit")
        source, wheel = build(work / "commit", work / "first", "sdist"), build(work / "commit", work / "first", "wheel")
        built = work / "commit" / PAGE
        if not built.exists():
            sys.exit("The page was not built: that needs npm and its registry.")
        page = {f"{PAGE}/{file.name}" for file in built.iterdir()}
        shutil.rmtree(built)  # it is built a second time too
        is_same("a second source archive", build(work / "commit", work / "second", "sdist"), source)
        with tarfile.open(source) as archive:
            archive.extractall(work / "unpacked", filter="data")
        unpacked = work / "unpacked" / f"elib_epuck-{version}"
        is_same("the wheel of the source archive", build(unpacked, work / "third", "wheel"), wheel)
        check_files(tracked | page, unpacked, wheel)
        print(f"{source.name}: {len(tracked)} files, {wheel.name}: version {version}; both the same when built again")
        for extra in ("", *extras):
            install(wheel, extra, work / "environment", version)
        DIST.mkdir(exist_ok=True)
        for file in (source, wheel):
            shutil.copy(file, DIST)
            print(f"dist/{file.name}  {file.stat().st_size / 1e6:.1f} MB")


def export(folder: Path) -> set[str]:
    """Write the last commit to *folder*; return the names of its files."""
    if run("git", "status", "--porcelain", where=ROOT):
        print("There are changes that are not committed; they are not part of what is built.", file=sys.stderr)
    done = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True)
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        archive.extractall(folder, filter="data")
    # The files in the archives get the time of the commit; without this they would all be of 2020.
    os.environ["SOURCE_DATE_EPOCH"] = run("git", "log", "-1", "--format=%ct", where=ROOT).strip()
    return set(run("git", "ls-tree", "-r", "--name-only", "-z", "HEAD", where=ROOT).strip("\0").split("\0"))


def read_project(folder: Path) -> tuple[str, list[str]]:
    """Return the version and the names of the extras."""
    project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    version = run(sys.executable, "-m", "hatchling", "version", where=folder).strip()
    return version, list(project["optional-dependencies"])


def build(folder: Path, into: Path, kind: str) -> Path:
    """Build an archive of *folder* and return its path."""
    run(sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(into), where=folder)
    return next(into.glob("*.whl" if kind == "wheel" else "*.tar.gz"))


def is_same(what: str, built: Path, first: Path) -> None:
    """Check that two archives are the same to the last byte."""
    if built.read_bytes() != first.read_bytes():
        sys.exit(f"{what} is not the same as {first.name}")


def check_files(files: set[str], unpacked: Path, wheel: Path) -> None:
    """Check that the archives hold the files of the commit and the page, and nothing else."""
    in_source = {path.relative_to(unpacked).as_posix() for path in unpacked.rglob("*") if path.is_file()}
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
    uv = shutil.which("uv") or str(ROOT / ".uv/bin/uv")
    seed = () if extra else ("--seed",)  # with pip
    run(uv, "venv", "--quiet", *seed, "--python", sys.executable, str(folder), where=ROOT)
    what = f"{wheel}[{extra}]" if extra else str(wheel)
    constraints = str(ROOT / "requirements/dev.txt")
    run(uv, "pip", "install", "--quiet", "--python", str(folder), "--constraints", constraints, what, where=ROOT)
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
    (folder / "empty.hex").write_text(EMPTY_HEX)
    asked = [str(programs / "elib"), "flash", "--dry-run", "empty.hex"]
    done = subprocess.run(asked, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False)
    hint = done.stderr.partition("install the extra flash: ")[2].strip()
    if not hint:
        sys.exit(f"elib flash said, without its extra:\n{done.stdout}{done.stderr}")
    subprocess.run(hint, cwd=folder, shell=True, check=True, capture_output=True, timeout=PATIENCE)
    flash(programs, folder)


def parquet(programs: Path, folder: Path) -> None:
    """Write the rows of a log as Parquet."""
    run(str(programs / "elib"), "run", "avoid", *FAST, "--log", "run.log", where=folder)
    writes("calls.parquet", "et", "Join", "-s", "run.log", "-d", "calls.parquet")(programs, folder)


def web(programs: Path, folder: Path) -> None:
    """Start the joystick, and end it by Ctrl-C."""
    command = [str(programs / "elib"), "joystick", "--port", "0", "--no-browser", "sim://"]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        rest = process.communicate(timeout=PATIENCE)[0]
    if "http://127.0.0.1:" not in first + rest:
        sys.exit(f"elib joystick said:\n{first}{rest}")


def flash(programs: Path, folder: Path) -> None:
    """Read an Intel HEX file: the smallest one, of which elib says that it holds no program."""
    (folder / "empty.hex").write_text(EMPTY_HEX)
    command = [str(programs / "elib"), "flash", "--dry-run", "empty.hex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False)
    if "empty.hex" not in done.stderr or "intelhex" in done.stderr:
        sys.exit(f"elib flash said:\n{done.stdout}{done.stderr}")


def compiled(programs: Path, folder: Path) -> None:
    """Move a world by the compiled engine."""
    text = "import elib; elib.World.load('arena', engine='compiled').step()"
    run(str(programs / "python"), "-c", text, where=folder)


def everything(programs: Path, folder: Path) -> None:
    """Try all extras in one environment."""
    for extra, trial in TRIALS.items():
        if extra not in ("", "all"):
            trial(programs, folder)


EMPTY_HEX = ":00000001FF\n"
FAST: Sequence[str] = ("--robot", "sim://?speed=max", "--for", "2")
TRIALS: dict[str, Callable[[Path, Path], None]] = {
    "": core,
    "plot": writes("run.png", "elib", "run", "avoid", *FAST, "--plot", "run.png"),
    "record": writes("run.mcap", "elib", "record", "run.mcap", *FAST),
    "parquet": parquet,
    "web": web,
    "flash": flash,
    "compiled": compiled,
    "all": everything,
}
"""What is tried with each extra; a new extra needs its line here."""

if __name__ == "__main__":
    main()
