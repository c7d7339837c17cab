"""The labs of the studio: what the page is told of them, the check of a program, and a teacher's lab as a zip file."""

from __future__ import annotations

import io
import time
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path, PurePosixPath
from tempfile import mkdtemp

from msgspec import Struct

from elib.base.errors import ArgumentError
from elib.base.files import reason_of
from elib.base.rules import nearest
from elib.lab import GoalResult, Lab, load_lab
from elib.lab.goal import points
from elib.lab.labfile import FILE, settings_of, shipped_labs
from elib.lab.result import result_of
from elib.lab.submissions import MAX_BYTES, MAX_FILES
from elib.lab.tracer import Tracer
from elib.link.transport.url import Url
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.simulation import Simulation
from elib.studio.inplace import InPlace, Run

DEFAULTS = SimulationSettings()
SPARED = 10
"""How many times longer than the judging of a program that runs it goes on before it is judged again."""


class LabGoal(Struct):
    """A goal of a lab."""

    name: str
    points: float
    sentence: str


class LabNews(Struct):
    """A lab: its instructions are Markdown; *missing* says why its program cannot run here, if it cannot."""

    name: str
    title: str
    summary: str
    text: str
    start: str
    goals: list[LabGoal]
    missing: str = ""


class GoalNews(Struct):
    """Whether a goal is reached, and in words."""

    name: str
    holds: bool
    text: str


class Judged(Struct):
    """One variant of a lab."""

    name: str
    is_hidden: bool
    passed: bool
    goals: list[GoalNews]
    ending: str
    why: str
    time: float


class Report(Struct):
    """What became of a check, and the text of the file to hand in."""

    variants: list[Judged]
    points: float
    most: float
    file: str


class Labs:
    """The labs that come with elib, and those that were opened.

    Args:
        folder: Where opened labs are put.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._opened: dict[str, Path] = {}

    def all(self) -> list[LabNews]:
        """Return what the page is told of all labs."""
        return [_news(self.lab(name)) for name in (*shipped_labs(), *self._opened)]

    def lab(self, name: str, *, hidden: bool = False) -> Lab:
        """Return a lab by its name.

        Raises:
            ArgumentError: There is no such lab.
        """
        names = [*shipped_labs(), *self._opened]
        if name not in names:
            raise ArgumentError(f"there is no lab {name!r}", hint=nearest(name, names))
        return load_lab(self._opened.get(name, name), hidden=hidden)

    def robot(self, name: str) -> str:
        """Return the URL of the robots in the first variant of a lab."""
        keys = asdict(settings_of(self.lab(name).variants[0])) | {"speed": "real"}
        query = ((key, str(value)) for key, value in keys.items() if value not in (None, False, getattr(DEFAULTS, key)))
        return str(Url("sim", keys["world"], tuple(each for each in query if each[0] != "world")))

    def watch(self, name: str, simulation: Simulation) -> Watch:
        """Watch the world of a program that begins to run in the first variant of a lab."""
        lab = self.lab(name)
        return Watch(Tracer(lab, lab.variants[0], simulation))

    def check(self, name: str, text: str, run: Run) -> Report:
        """Run a program in all variants of a lab, hidden ones too, and return what became of it."""
        lab, given = self.lab(name, hidden=True), len(self.lab(name).variants)
        runs = [InPlace(lab, variant).result(text, run) for variant in lab.variants]
        held = Counter(each.goal.name for run in runs for each in run.goals if each.holds)
        told = [
            Judged(
                run.variant.name, place >= given, run.passed, _goals(run.goals), run.ending, run.why, round(run.time, 3)
            )
            for place, run in enumerate(runs)
        ]
        return Report(told, points(lab.goals, held, len(runs)), lab.points, result_of(lab, text, runs))

    def open(self, content: bytes) -> LabNews:
        """Take a lab from a zipped folder.

        Raises:
            ArgumentError: It is not a zip file, is too large, or has no lab in it.
            SimulationError: A file of the lab breaks a rule.
        """
        files = _unpacked(content)
        homes = sorted((path.parent for path in files if path.name == FILE), key=lambda path: len(path.parts))
        if not homes:
            raise ArgumentError(f"there is no {FILE} in the zip file", hint="zip the whole folder of the lab")
        name = homes[0].name or "lab"
        name = f"my-{name}" if name in shipped_labs() else name
        target = Path(mkdtemp(dir=self._folder)) / name
        try:
            for path, data in files.items():
                if path.is_relative_to(homes[0]):
                    file = target / path.relative_to(homes[0])
                    file.parent.mkdir(parents=True, exist_ok=True)
                    file.write_bytes(data)
        except OSError as error:
            raise ArgumentError(f"the zip file cannot be unpacked: {reason_of(error)}") from None
        load_lab(target, hidden=True)
        self._opened[name] = target
        return _news(self.lab(name))


class Watch:
    """Says which goals hold so far in a world.

    Args:
        tracer: Notes what happens there.
    """

    def __init__(self, tracer: Tracer) -> None:
        self._tracer = tracer
        self._goals: list[GoalNews] = []
        self._due = 0.0

    def goals(self, code: int | None) -> list[GoalNews]:
        """Return what was found last; the goals are judged again only if that takes a tenth of the time.

        Args:
            code: The exit code of the program, if it has ended.
        """
        now = time.perf_counter()
        if code is not None:
            self._goals = _goals(self._tracer.over(code))
        elif now >= self._due:
            self._goals = _goals(self._tracer.so_far())
            self._due = now + SPARED * (time.perf_counter() - now)
        return self._goals


def _news(lab: Lab) -> LabNews:
    def text(name: str) -> str:
        file = lab.folder / name
        return file.read_text("utf-8", "replace") if file.is_file() else ""

    start = text("start.py")
    goals = [LabGoal(goal.name, goal.points, goal.sentence) for goal in lab.goals]
    needs_numpy = ("image()" in start or "Grid(" in start) and find_spec("numpy") is None
    missing = f"Not here: it needs the extra {lab.lacks}, which this studio does not have." if lab.lacks else ""
    if needs_numpy:
        missing = "Not here: pictures and maps need NumPy, which this studio was built without."
    return LabNews(lab.name, lab.title, lab.summary, text("README.md"), start, goals, missing)


def _goals(found: Iterable[GoalResult]) -> list[GoalNews]:
    return [GoalNews(each.goal.name, each.holds, each.text) for each in found]


def _unpacked(content: bytes) -> dict[PurePosixPath, bytes]:
    """Return the files in a zip file by their paths, none of which leads out of it."""
    files: dict[PurePosixPath, bytes] = {}
    room = MAX_BYTES
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for entry in archive.infolist():
                path = PurePosixPath(entry.filename)
                if path.is_absolute() or ".." in path.parts or "\\" in entry.filename:
                    raise ArgumentError(f"the zip file has a file outside of its folder: {entry.filename!r}")
                if entry.is_dir():
                    continue
                with archive.open(entry) as stream:
                    files[path] = stream.read(room + 1)  # what the file says of its size is not believed
                room -= len(files[path])
                if room < 0 or len(files) > MAX_FILES:
                    raise ArgumentError(f"a lab has at most {MAX_FILES} files and {MAX_BYTES >> 20} MB")
    # The last ones: a compression or a password that Python does not know, and a file that ends too early.
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
        raise ArgumentError(f"this is not a zip file that can be read: {error}") from None
    return files
