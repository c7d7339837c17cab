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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Annotated, cast

from elib.base.errors import ArgumentError, ElibError, SimulationError
from elib.base.files import LABS, read_file
from elib.base.rules import Choice, Delay, Mistake, Number, Probability, Text, Whole, nearest
from elib.base.tables import MAX_FILE, Key, Pair, Source, Table, keys_of, read_toml
from elib.lab.goal import Goal, Name, Zone
from elib.lab.goals import KINDS, EndsAt
from elib.link.protocol.profiles import FIRMWARES
from elib.simulator.emulator.faultscript import load as load_script
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.physics import Scene
from elib.simulator.physics.geometry import Place

FILE = "lab.toml"
HIDDEN = "teacher/hidden.toml"
MAX_TIME = 600
"""s. The most robot time of a run: half a minute of computing, and longer than anybody waits for a mark."""

TimeLimit = Annotated[float, Number(1, MAX_TIME, "s", example="60")]
Robots = Annotated[int, Whole(1, 100, example="4", otherwise="as many as the world names")]


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
    """

    title: Annotated[str, Text(example='"Go 10 cm"')]
    summary: Annotated[str, Text(example='"Drive 10 cm straight ahead and stop."')]
    time: TimeLimit
    firmware: Annotated[str, Choice(tuple(FIRMWARES), example='"epuck2"')] = "asercom-1.2.2"
    robots: Robots | None = None
    number: Annotated[int, Whole(1, 1000, example="3", otherwise="none")] | None = None


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


KIND = Key("kind", Choice(tuple(KINDS), example='"reach"'), ("kind",), meaning="what the goal is about")
MIDDLE = Pair("position", ("x", "y"), "its middle", "[0.5, 0.5]")
TOP = Table("", "What stands above all tables.", Top, keys_of(Top), is_array=False)
ZONES = Table(
    "zone",
    "Parts of the floor, for goals. They are drawn into the picture of the path.",
    zone,
    keys_of(zone, MIDDLE, Pair("size", ("width", "depth"), "of a rectangle: along x and along y", "[0.1, 0.2]")),
)
VARIANTS = Table(
    "variant", "Worlds in which the program runs, one after the other.", Variant, keys_of(Variant), is_required=True
)
GOALS = {
    name: Table(
        "goal",
        kind.__doc__ or "",
        kind,
        keys_of(kind, Pair("position", ("x", "y"), "the place", "[0.5, 0.5]")) if kind is EndsAt else keys_of(kind),
    )
    for name, kind in KINDS.items()
}
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
    """

    folder: Path
    title: str
    summary: str
    goals: tuple[Goal, ...]
    variants: tuple[Variant, ...]
    zones: tuple[Zone, ...]

    @property
    def name(self) -> str:
        """The name of its folder."""
        return self.folder.name

    @property
    def points(self) -> float:
        """What all goals are worth together."""
        return sum(goal.points for goal in self.goals)

    def zones_of(self, variant: Variant) -> dict[str, Zone]:
        """Return the zones of one variant, by their names."""
        general = {zone.name: zone for zone in self.zones if not zone.variant}
        return general | {zone.name: zone for zone in self.zones if zone.variant == variant.name}

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
    source, parts = _read(path / FILE, TOP, [ZONES, VARIANTS, ANY_GOAL], "the lab")
    [top] = cast("list[Top]", parts[""])
    goals = cast("list[Goal]", parts["goal"])
    given = _Part(source, cast("list[Zone]", parts["zone"]), cast("list[Variant]", parts["variant"]))
    given.settle(top)
    both = [given]
    if hidden and (path / HIDDEN).is_file():
        more, parts = _read(path / HIDDEN, NOTHING, [ZONES, VARIANTS], "the hidden variants")
        both.append(_Part(more, cast("list[Zone]", parts["zone"]), cast("list[Variant]", parts["variant"])))
        both[1].settle(top)
    variants = tuple(variant for part in both for variant in part.variants)
    lab = Lab(
        path.resolve(),
        top.title,
        top.summary,
        tuple(goals),
        variants,
        tuple(zone for part in both for zone in part.zones),
    )
    _check_names(source, goals)
    names = [variant.name for variant in variants]
    for part, before in zip(both, (0, len(given.variants)), strict=False):
        part.check(lab, names, before, source)
    return lab


def settings_of(variant: Variant) -> SimulationSettings:
    """Return the simulation of a variant."""
    assert variant.firmware is not None
    return SimulationSettings(
        variant.world,
        firmware=variant.firmware,
        seed=variant.seed,
        robots=variant.robots,
        speed="max",
        latency=variant.latency,
        jitter=variant.jitter,
        loss=variant.loss,
        fault=variant.fault,
    )


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


def _read(path: Path, top: Table, tables: Sequence[Table], what: str) -> tuple[Source, dict[str, list[object]]]:
    hint = "name a folder with a lab.toml; elib lab list names those that come with elib"
    content = read_file(str(path), what, largest=MAX_FILE, hint=hint, error=ArgumentError)
    source, document = read_toml(content, str(path), "a lab")
    return source, source.read_all(document, top, tables)


def _check_names(source: Source, goals: Sequence[Goal]) -> None:
    names = [goal.name for goal in goals]
    for index, goal in enumerate(goals):
        if goal.name in names[:index]:
            raise source.error(("goal", index), Mistake(f'is "{goal.name}" again', path=("name",)))
        for needed in goal.needs:
            if needed not in names or needed == goal.name:
                mistake = Mistake(f'names "{needed}", which is not another goal', path=("needs",))
                raise source.error(("goal", index), Mistake(mistake.what, path=("needs",), hint=nearest(needed, names)))


@dataclass(slots=True)
class _Part:
    """What one of the two files says."""

    source: Source
    zones: list[Zone]
    variants: list[Variant]

    def settle(self, top: Top) -> None:
        """Put into each variant what holds for all, and the paths of its files as they are from here."""
        self.variants = [
            replace(
                each,
                world=self._path(each.world),
                fault=None if each.fault is None else self._path(each.fault),
                firmware=each.firmware or top.firmware,
                robots=each.robots or top.robots,
                time=each.time or top.time,
            )
            for each in self.variants
        ]

    def check(self, lab: Lab, names: Sequence[str], before: int, goals: Source) -> None:
        """Check what no table can know alone.

        Args:
            lab: The lab.
            names: The names of all its variants.
            before: How many of them are in the other file, which comes first.
            goals: The file with the goals.
        """
        for index, zone in enumerate(self.zones):
            if zone.variant and zone.variant not in names:
                mistake = Mistake(f'is "{zone.variant}"', path=("variant",), hint=nearest(zone.variant, names))
                raise self.source.error(("zone", index), mistake)
        for index, variant in enumerate(self.variants):
            if variant.name in names[: before + index]:
                raise self.source.error(("variant", index), Mistake("is there twice", path=("name",)))
            try:
                scene = Scene.load(variant.world, robots=variant.robots)
            except ElibError as error:
                raise self._about(index, "world", error) from error
            try:
                if variant.fault is not None:
                    load_script(variant.fault)
            except ElibError as error:
                raise self._about(index, "fault", error) from error
            robots = variant.robots or len(scene.starts)
            if not robots:
                raise self.source.error(("variant", index), Mistake("has no robot", path=("world",)))
            for number, goal in enumerate(lab.goals):
                try:
                    goal.check(lab.zones_of(variant), robots, scene)
                except Mistake as mistake:
                    what = f"{mistake.what}, in the variant {variant.name!r}"
                    raise goals.error(("goal", number), Mistake(what, path=mistake.path, hint=mistake.hint)) from None

    def _about(self, index: int, key: str, error: ElibError) -> SimulationError:
        """Return the error of a file that a variant names."""
        value = getattr(self.variants[index], key)
        return self.source.error(
            ("variant", index), Mistake(f'is "{value}": {error.message}', path=(key,), hint=error.hint)
        )

    def _path(self, name: str) -> str:
        is_file = name.endswith(".toml") or "/" in name or os.sep in name
        return os.path.join(os.path.dirname(self.source.filename), name) if is_file else name
