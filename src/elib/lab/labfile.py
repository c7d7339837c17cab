"""Labs as folders with a file ``lab.toml``.

::

    title = "Go 10 cm"
    summary = "Drive 10 cm straight ahead and stop."
    time = 20                     # s of robot time; then the goals are judged

    [[zone]]                      # a part of the floor, for goals
    name = "target"
    position = [0.5, 0.5]         # its middle
    radius = 0.05                 # or size = [0.1, 0.2]

    [[variant]]                   # a world in which the program runs
    name = "given"
    world = "worlds/room.toml"    # or the name of a world that comes with elib
    seed = 1
    fault = "flaky-bluetooth"

    [[goal]]
    name = "arrive"
    kind = "reach"
    zone = "target"
    points = 2

Lengths are metres, angles degrees, times seconds of robot time.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

from elib.base.errors import ArgumentError, ElibError
from elib.base.files import LABS, read_file
from elib.base.plaintext import counted
from elib.base.rules import Choice, Delay, Mistake, Number, Probability, Text, Whole, nearest
from elib.base.tables import MAX_FILE, Key, Pair, Source, Table, keys_of, read_toml
from elib.lab.goal import Goal, Name, Zone
from elib.lab.goals import KINDS
from elib.link.protocol.profiles import FIRMWARES
from elib.simulator.emulator.faultscript import load as load_script
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.physics import Scene, Snapshot, Stripe
from elib.simulator.physics.geometry import Box, Cylinder, Place

FILE = "lab.toml"
HIDDEN = "teacher/hidden.toml"
MAX_TIME = 600
"""s. The most robot time of a run: half a minute of computing, and longer than anybody waits for a mark."""

EXTRAS = {"vision": "cv2"}
"""Extras that programs of a lab may need, each with a module of it."""


@dataclass(frozen=True, slots=True)
class Variant:
    """A world in which the program runs.

    Attributes:
        name: Its name, unique in the lab.
        world: A .toml file, its path as seen from this file, or the name of a world that comes with elib.
        seed: The seed of everything random.
        fault: A fault script: the name of one that comes with elib, or a .toml file; None for none.
        firmware: What runs on the robots.
        robots: How many robots there are.
        time: How much time the program has.
        latency: Delay of the link each way, s.
        jitter: Standard deviation of that delay, s.
        loss: Probability that a whole answer is lost.
    """

    name: Annotated[str, Text(example='"given"')]
    world: Annotated[str, Text(example='"worlds/room.toml"')]
    seed: Annotated[int, Whole(0, 2**64 - 1, example="1", otherwise="the world's")] | None = None
    fault: Annotated[str, Text(example='"flaky-bluetooth"', otherwise="none")] | None = None
    firmware: Annotated[str, Choice(tuple(FIRMWARES), example='"epuck2"', otherwise="the lab's")] | None = None
    robots: Annotated[int, Whole(1, 100, example="4", otherwise="the lab's")] | None = None
    time: Annotated[float, Number(1, MAX_TIME, "s", example="60", otherwise="the lab's")] | None = None
    latency: Delay = 0.0
    jitter: Delay = 0.0
    loss: Probability = 0.0


@dataclass(frozen=True, slots=True)
class Top:
    """What stands above all tables.

    Attributes:
        title: What the lab is called.
        summary: What the program should do, in a sentence.
        time: How much robot time the program has; then its link is lost and the goals are judged.
        firmware: What runs on the robots.
        robots: How many robots there are.
        number: Its place in a course; ``elib lab list`` has this order.
        extra: The extra of elib that its programs need; where that is not installed, nothing is checked.
        opponent: A program that drives the second half of the robots: the lab is a game of two programs.
    """

    title: Annotated[str, Text(example='"Go 10 cm"')]
    summary: Annotated[str, Text(example='"Drive 10 cm straight ahead and stop."')]
    time: Annotated[float, Number(1, MAX_TIME, "s", example="60")]
    firmware: Annotated[str, Choice(tuple(FIRMWARES), example='"epuck2"')] = "asercom-1.2.2"
    robots: Annotated[int, Whole(1, 100, example="4", otherwise="as many as the world names")] | None = None
    number: Annotated[int, Whole(1, 1000, example="3", otherwise="none")] | None = None
    extra: Annotated[str, Choice(tuple(EXTRAS), otherwise="none")] | None = None
    opponent: Annotated[str, Text(example='"opponent.py"', otherwise="none")] | None = None


def zone(
    name: Name,
    x: Place,
    y: Place,
    radius: Annotated[float, Number(0.001, 1000, "m", example="0.05", otherwise="it is a rectangle")] | None = None,
    width: Annotated[float, Number(0.001, 1000, "m", otherwise="it is a circle")] | None = None,
    depth: Annotated[float, Number(0.001, 1000, "m", otherwise="it is a circle")] | None = None,
    variant: Annotated[str, Text(example='"given"', otherwise="every variant")] = "",
) -> Zone:
    """Return a zone.

    Args:
        name: Its name in goals.
        x: Its middle, m.
        y: Its middle, m.
        radius: The radius of a circle, m.
        width: Of a rectangle, m.
        depth: Of a rectangle, m.
        variant: The only variant in which it is there, instead of the zone of this name.
    """
    if (radius is None) == (width is None):
        raise ArgumentError("needs a radius or a size, one of them", hint="write radius = 0.05, or size = [0.1, 0.2]")
    return Zone(name, x, y, radius or 0.0, width or 0.0, depth or 0.0, variant)


class GoalTable(Table):
    """The table of goals, whose keys depend on the kind."""

    def read(self, table: Mapping[str, object], what: str) -> object:
        """Return the goal that *table* describes.

        Raises:
            Mistake: A key is missing, unknown or wrong.
        """
        rest = dict(table)
        kind = str(self.values({"kind": rest.pop("kind")} if "kind" in rest else {}, what)["kind"])
        return GOALS[kind].read(rest, f'a goal of the kind "{kind}"')


def _goal(kind: type[Goal]) -> Table:
    place = [Pair("position", ("x", "y"), "the place", "[0.5, 0.5]")] if hasattr(kind, "x") else []
    return Table("goal", kind.__doc__ or "", kind, keys_of(kind, *place))


KIND = Key("kind", Choice(tuple(KINDS), example='"reach"'), ("kind",), meaning="what the goal is about")
TOP = Table("", "What stands above all tables.", Top, keys_of(Top), is_array=False)
ZONES = Table(
    "zone",
    "Parts of the floor, for goals, which may also name the discs and rectangles among the zones of the world. They are"
    " drawn into the picture of the path.",
    zone,
    keys_of(
        zone,
        Pair("position", ("x", "y"), "its middle", "[0.5, 0.5]"),
        Pair("size", ("width", "depth"), "of a rectangle: along x and along y", "[0.1, 0.2]"),
    ),
)
VARIANTS = Table(
    "variant", "Worlds in which the program runs, one after the other.", Variant, keys_of(Variant), is_required=True
)
GOALS = {name: _goal(kind) for name, kind in KINDS.items()}
ANY_GOAL = GoalTable("goal", "What the program should reach.", Goal, (KIND,), is_required=True)
NOTHING = Table("", "", dict, (), is_array=False)


@dataclass(frozen=True, slots=True)
class Lab:
    """A task with goals.

    Attributes:
        folder: Where its files are.
        title: What it is called.
        summary: What the program should do, in a sentence.
        goals: What the program should reach.
        variants: Where it runs, with all that the lab says for all of them.
        zones: Parts of the floor.
        extra: The extra of elib that its programs need, or None.
        opponent: In a game of two programs the one that a program plays against, or None.
    """

    folder: Path
    title: str
    summary: str
    goals: tuple[Goal, ...]
    variants: tuple[Variant, ...]
    zones: tuple[Zone, ...]
    extra: str | None = None
    opponent: Path | None = None

    @property
    def lacks(self) -> str:
        """The extra that its programs need and that is not installed here, or an empty string."""
        return self.extra if self.extra is not None and find_spec(EXTRAS[self.extra]) is None else ""

    @property
    def name(self) -> str:
        """The name of its folder."""
        return self.folder.name

    @property
    def points(self) -> float:
        """What all goals are worth together."""
        return sum(goal.points for goal in self.goals)

    def share(self, robots: int, player: int = 0) -> slice:
        """Return which of so many robots a program drives: all, or in a game the first or the second half."""
        half = robots if self.opponent is None else robots // 2
        return slice(player * half, (player + 1) * half)

    def zones_of(self, variant: Variant, world: Scene | None = None) -> dict[str, Zone]:
        """Return the zones of one variant by their names; with its world its discs and rectangles, too."""
        plain = [each for each in world.zones if each.x is not None and not each.file] if world else []
        found = {
            each.name: Zone(each.name, each.x or 0, each.y or 0, each.radius or 0, each.width or 0, each.depth or 0)
            for each in plain
        }
        found |= {zone.name: zone for zone in self.zones if not zone.variant}
        return found | {zone.name: zone for zone in self.zones if zone.variant == variant.name}

    def variant(self, name: str) -> Variant:
        """Return a variant by its name.

        Raises:
            ArgumentError: There is no such variant.
        """
        found = next((each for each in self.variants if each.name == name), None)
        if found is None:
            raise ArgumentError(
                f"the lab has no variant {name!r}", hint=nearest(name, [each.name for each in self.variants])
            )
        return found


def load_lab(folder: str | Path, *, hidden: bool = False) -> Lab:
    """Read a lab.

    Args:
        folder: The folder, or the name of a lab that comes with elib.
        hidden: Also read the variants of its file ``teacher/hidden.toml``, if there is one.

    Raises:
        ArgumentError: There is no such lab.
        SimulationError: A file breaks a rule; the message names the file, the line and the key.
    """
    path = Path(folder)
    if not path.is_dir() and str(folder) in shipped_labs():
        path = Path(str(files("elib").joinpath(LABS, str(folder))))
    if not path.exists():
        raise ArgumentError(
            f"there is no lab {str(folder)!r}",
            hint=f"name a folder with a lab.toml, or a lab of elib: {nearest(str(folder), shipped_labs())}",
        )
    parts = [_read(path / FILE, TOP, [ZONES, VARIANTS, ANY_GOAL], "the lab")]
    if hidden and (path / HIDDEN).is_file():
        parts.append(_read(path / HIDDEN, NOTHING, [ZONES, VARIANTS], "the hidden variants"))
    first, given = parts[0]
    [top] = given[""]
    zones = [((source, index), each) for source, part in parts for index, each in enumerate(part["zone"])]
    variants = [
        ((source, index), _settled(each, top, os.path.dirname(source.filename)))
        for source, part in parts
        for index, each in enumerate(part["variant"])
    ]
    lab = Lab(
        path.resolve(),
        top.title,
        top.summary,
        tuple(given["goal"]),
        tuple(each for _, each in variants),
        tuple(each for _, each in zones),
        top.extra,
        None if top.opponent is None else path.resolve() / top.opponent,
    )
    if lab.opponent is not None and not lab.opponent.is_file():
        with first.at("", 0):
            raise Mistake(f'is "{top.opponent}", and there is no such file in the folder', path=("opponent",))
    _check_goals(lab, first)
    names = [each.name for each in lab.variants]
    for (source, index), zone in zones:
        with source.at("zone", index):
            if zone.variant and zone.variant not in names:
                raise Mistake(f'is "{zone.variant}"', path=("variant",), hint=nearest(zone.variant, names))
    for number, ((source, index), variant) in enumerate(variants):
        with source.at("variant", index):
            if variant.name in names[:number]:
                raise Mistake("is there twice", path=("name",))
            with _named("world", variant.world):
                scene = Scene.load(variant.world, robots=variant.robots)
            with _named("fault", variant.fault):
                if variant.fault is not None:
                    load_script(variant.fault)
            robots = variant.robots or len(scene.starts)
            if not robots:
                raise Mistake("has no robot", path=("world",))
            if lab.opponent is not None and robots % 2:
                raise Mistake(f"has {counted(robots, 'robot')}, which two programs cannot share", path=("world",))
        for place, goal in enumerate(lab.goals):
            with first.at("goal", place), _in(variant):
                there = lab.zones_of(variant, scene)
                goal.check(there, lab.share(robots).stop, things_of(scene), len(stripes_of(scene)))
    return lab


def things_of(world: Scene | Snapshot) -> dict[str, tuple[float, float]]:
    """Return the places of the boxes and cylinders that have a name, m."""
    things: list[Box | Cylinder] = [*world.boxes, *world.cylinders]
    return {each.name: (each.x, each.y) for each in things if each.name}


def stripes_of(scene: Scene) -> list[Sequence[tuple[float, float]]]:
    """Return the courses of the stripes on a world's floor, in the order of its file."""
    return [paint.points for paint in scene.paint if isinstance(paint, Stripe)]


def settings_of(variant: Variant) -> SimulationSettings:
    """Return the simulation of a variant."""
    own = {name: value for name, value in asdict(variant).items() if name not in ("name", "time")}
    return SimulationSettings(speed="max", **own)


def find_lab(program: str | Path) -> Path:
    """Return the folder of the lab that a program belongs to: the nearest one above the file with a ``lab.toml``.

    Raises:
        ArgumentError: There is none.
    """
    above = Path(program).resolve().parents
    for folder in above:
        if (folder / FILE).is_file():
            return folder
    raise ArgumentError(
        f"there is no {FILE} in {above[0]} or above it", hint="name the lab: --lab FOLDER, or --lab go-10-cm"
    )


def shipped_labs() -> list[str]:
    """Return the names of the labs that come with elib, in the order of a course."""
    folder = files("elib").joinpath(LABS)
    labs = [each for each in folder.iterdir() if each.joinpath(FILE).is_file()] if folder.is_dir() else []
    numbers = {each.name: tomllib.loads(each.joinpath(FILE).read_text(encoding="utf-8"))["number"] for each in labs}
    return sorted(numbers, key=numbers.__getitem__)


def _read(path: Path, top: Table, tables: Sequence[Table], what: str) -> tuple[Source, dict[str, list[Any]]]:
    hint = "name a folder with a lab.toml; elib lab list names those that come with elib"
    content = read_file(str(path), what, largest=MAX_FILE, hint=hint, error=ArgumentError)
    source, document = read_toml(content, str(path), "a lab")
    return source, source.read_all(document, top, tables)


def _settled(variant: Variant, top: Top, folder: str) -> Variant:
    """Return a variant with what holds for all of them, and with the paths of its files as they are from here."""

    def path(name: str) -> str:
        return os.path.join(folder, name) if name.endswith(".toml") or "/" in name or os.sep in name else name

    return replace(
        variant,
        world=path(variant.world),
        fault=None if variant.fault is None else path(variant.fault),
        firmware=variant.firmware or top.firmware,
        robots=variant.robots or top.robots,
        time=variant.time or top.time,
    )


def _check_goals(lab: Lab, source: Source) -> None:
    names = [goal.name for goal in lab.goals]
    for index, goal in enumerate(lab.goals):
        with source.at("goal", index):
            if goal.name in names[:index]:
                raise Mistake(f'is "{goal.name}" again', path=("name",))
            for needed in goal.needs:
                if needed not in names or needed == goal.name:
                    what = f'names "{needed}", which is not another goal'
                    raise Mistake(what, path=("needs",), hint=nearest(needed, names))


@contextmanager
def _named(key: str, value: str | None) -> Iterator[None]:
    """Let the error of a file that a variant names begin with the key and the name."""
    try:
        yield
    except ElibError as error:
        raise Mistake(f'is "{value}": {error.message}', path=(key,), hint=error.hint) from error


@contextmanager
def _in(variant: Variant) -> Iterator[None]:
    """Let a mistake name the variant."""
    try:
        yield
    except Mistake as mistake:
        what = f"{mistake.what}, in the variant {variant.name!r}"
        raise Mistake(what, path=mistake.path, hint=mistake.hint) from None
