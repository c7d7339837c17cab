"""The panel: its robots, the files and the world that belong to it. It lives on the server's event loop."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Protocol

from msgspec import Struct

from elib.base.errors import ArgumentError, ElibError, LinkLost
from elib.base.tasks import Tasks
from elib.link.transport import robots_of
from elib.link.transport.url import parse_url
from elib.panel.files import LOG, RECORDING, Folder
from elib.panel.recents import RecentRobots, check_url
from elib.panel.slot import Phase, Slot
from elib.robot.aio import Epuck
from elib.simulator.emulator.control import Control
from elib.simulator.worlds.files import gallery

MAX_ROBOTS = 64
"""Robots that the panel has room for: two classes full."""
MAX_LABEL = 28
"""Characters of a name that fit on a tab."""
MAX_FILES = 50
"""Recordings that are offered."""
PARTING = 3.0
"""s that a robot may take to confirm its last stop when the panel ends."""


class Can(Struct, frozen=True):
    """What the pages of a panel can do.

    :data:`REFUSALS` says of each what it is.
    """

    drive: bool = False
    edit: bool = False
    speed: bool = False
    save: bool = False
    connect: bool = False
    files: bool = False
    program: bool = False


REFUSALS = {
    "drive": "drive robots, nor send them commands",
    "edit": "change the world",
    "speed": "pause the world, nor set its speed",
    "save": "save the world",
    "connect": "connect robots",
    "files": "read or write files of the computer that serves it",
    "program": "start programs",
}
"""What a page cannot do, in the words of a refusal."""
ALL = Can(drive=True, edit=True, speed=True, save=True, connect=True, files=True, program=True)
"""Of a person at a panel of robots."""
WORLD = Can(edit=True, speed=True, save=True)
"""Of a page that shows a world, whose robots belong to other programs."""
TEACHER = Can(edit=True, speed=True)
"""Of the page of a whole class."""
STUDENT = Can(edit=True)
"""Of a page that shows a world to somebody who may use this world and nothing else of this computer: its speed is
fixed, because the computer has others to simulate, too."""


class Reachable(Struct, frozen=True):
    """A robot of a world that programs can open: its name there, and its URL."""

    name: str
    url: str


class Listed(Struct, frozen=True):
    """A robot of the panel: its key, its name as a tab shows it, and its URL."""

    key: str
    label: str
    url: str
    world: str = ""  # the key of its world; empty where it has none that can be looked at
    index: int | None = None  # its index in that world


class FileList(Struct):
    """The recordings of the folder, the newest first, and free names for a new log and recording.

    A recording is its name, when it was last written (s, as Unix counts), and its bytes.
    """

    recordings: list[tuple[str, float, int]]
    log: str
    recording: str


Generation = tuple[float, float, float, float, float]
"""Fitness of a generation: best, upper quarter, mean, lower quarter, lowest."""


class StudyAbout(Struct):
    """A study: its task, how many generations it is to have, and s that a robot has."""

    task: str
    summary: str
    count: int
    seconds: float
    settings: dict[str, str]


class StudyState(Struct):
    """How far a study is."""

    # the best controllers so far: the generation, counted from 1, and the fitness of each
    bests: list[tuple[int, float]]
    left: float  # s until its end, if it goes on as it did
    outcome: str  # how it ended; empty while it goes on
    chosen: int | None  # which of the best is to drive; None for the newest at any time
    shown: int | None  # the generation of the one that drives; None if none does


class Study(Protocol):
    """A study whose evolution the pages show; what they show in the world is one of its controllers."""

    def about(self) -> StudyAbout:
        """Return what does not change."""

    def generations(self, first: int) -> Sequence[Generation]:
        """Return the fitness of each generation from *first* on, counted from 0."""

    def state(self) -> StudyState:
        """Return how far it is."""

    def choose(self, number: int | None) -> None:
        """Let one of the best controllers drive, counted from 0; None for the newest at any time."""


class Panel:
    """The robots of one panel."""

    def __init__(
        self,
        *,
        is_shared: bool = False,
        can: Can = ALL,
        worlds: Mapping[str, Control] | None = None,
        reachable: Sequence[tuple[str, str]] = (),
        study: Study | None = None,
        folder: Path | None = None,
        recents: RecentRobots | None = None,
    ) -> None:
        self.is_shared = is_shared  # whether other computers reach it. Then a page may not name files of this computer.
        self.can = can  # what its pages can do
        # controls of simulations that are shown beside those of the robots, by any keys that no robot has. They may
        # change.
        self.worlds = dict(worlds or {})
        self.reachable = [Reachable(*each) for each in reachable]  # how programs open the robots of these worlds
        self.study = study  # the study to which the pages belong, if they belong to one
        # where logs, recordings and pictures go; the current folder if None
        self.folder = Folder(Path.cwd() if folder is None else folder)
        # the robots that were used before; those of this user if None
        self.recents = RecentRobots() if recents is None else recents
        # whether the program ends. Then pages are still told what happens, but what they ask for is not done.
        self.is_ending = False
        self.on_empty: Callable[[], object] = lambda: None  # called when the last page was closed
        self.on_visit: Callable[[], object] = lambda: None  # called when a page was opened
        self._slots: dict[str, Slot] = {}
        self._asked: dict[str, str] = {}
        self._parting: set[Slot] = set()
        self._number = 0
        self._tasks = Tasks()

    @property
    def slots(self) -> Mapping[str, Slot]:
        """The robots by key, in the order they came; read only."""
        return MappingProxyType(self._slots)

    def slot(self, key: object) -> Slot:
        """Return the robot with a key; an ArgumentError says that there is none, or that it was taken out."""
        found = self._slots.get(key) if isinstance(key, str) else None
        if found is None:
            raise ArgumentError("there is no such robot in the panel", hint="it may have been taken out meanwhile")
        return found

    def all_worlds(self) -> dict[str, Control]:
        """Return every world once: by its own key, or by that of the first robot in it."""
        found = {id(control.simulation): (key, control) for key, control in self.worlds.items()}
        for key, slot in self._slots.items():
            if (control := slot.control) is not None:
                found.setdefault(id(control.simulation), (key, control))
        return dict(found.values())

    def world(self, key: str) -> Control | None:
        """Return the control of a world by its key, or by the key of a robot; for "" that of the first world."""
        if not key:
            return next(iter(self.all_worlds().values()), None)
        slot = self._slots.get(key)
        return self.worlds.get(key) if slot is None else slot.control

    def add(self, url: str, *, is_trusted: bool = False) -> str:
        """Make a place for a robot, not yet connected, and return its key."""
        return self._put(self._checked(url, is_trusted)).key

    def _put(self, url: str, name: str = "") -> Slot:
        """Make a place for a robot whose URL needs no check."""
        if len(self._slots) >= MAX_ROBOTS:
            raise ArgumentError(f"the panel has {MAX_ROBOTS} robots, and room for no more")
        slot = Slot(url, name=name, key=str(self._number + 1))
        self._number += 1
        self._slots[slot.key] = slot
        return slot

    def add_all(self, url: str, *, is_trusted: bool = False) -> list[str]:
        """Make a place for each robot of a URL, as :meth:`add` does for one: a URL of a world may have several robots.

        LinkNotFound says that there is no such world.
        """
        text = self._checked(url, is_trusted)
        urls = [text] if parse_url(text).scheme != "sim" else [str(each) for each in robots_of(text)]
        if len(self._slots) + len(urls) > MAX_ROBOTS:
            raise ArgumentError(f"{text} has {len(urls)} robots; the panel has room for {MAX_ROBOTS} in all")
        keys = [self.add(text if len(urls) == 1 else each, is_trusted=is_trusted) for each in urls]
        self._asked |= dict.fromkeys(keys, text)
        return keys

    def _checked(self, url: str, is_trusted: bool) -> str:
        """Return a URL that was typed; an ArgumentError says what is wrong with it."""
        text = url.strip()
        check_url(text)
        if self.is_shared and not is_trusted:
            _refuse_files(text)
        return text

    def add_recording(self, name: str) -> str:
        """Make a place for a recording of the folder, and return its key; an ArgumentError says that there is none."""
        path = self.folder.file(name, RECORDING)
        if not path.exists():
            raise ArgumentError(f"there is no recording {path.name!r} in the folder")
        return self._put(f"replay://{path}", path.name).key

    def watch(self, robot: Epuck) -> Slot | None:
        """Make a place for a robot that a program has opened, and show what it tells the program; return the place.

        It takes the place of those that the program has closed; None says that there is no room.
        """
        self.forget_watched()
        if len(self._slots) >= MAX_ROBOTS:
            return None
        slot = self._put(robot.url, robot.name)
        slot.watch(robot)
        return slot

    def forget_watched(self) -> None:
        """Take out every robot that a program had opened, and has closed."""
        for key in [key for key, slot in self._slots.items() if slot.phase is Phase.DISCONNECTED]:
            del self._slots[key]

    def remove(self, key: object) -> asyncio.Task[None]:
        """Take a robot out of the panel; the returned task stops and disconnects it."""
        slot = self.slot(key)
        del self._slots[slot.key]
        self._parting.add(slot)
        task = self._tasks.begin(_part(slot), "elib panel disconnects")
        task.add_done_callback(lambda _: self._parting.discard(slot))
        return task

    def connect(self, key: object) -> None:
        """Begin to connect a robot; :attr:`Slot.phase` says how far it is."""
        self._tasks.begin(self._connect(self.slot(key)), "elib panel connects")

    async def _connect(self, slot: Slot) -> None:
        """Connect a robot; what was asked for is remembered as soon as one of its robots answers."""
        if await slot.connect() and slot.is_connected:
            self.recents.add(self._asked.get(slot.key, slot.url))

    def labels(self) -> list[Listed]:
        """Return every robot, in order; no label stands twice."""
        found: list[str] = []
        for slot in self._slots.values():
            name = short(slot.url) if slot.name == slot.url else slot.name
            name = name if len(name) <= MAX_LABEL else f"{name[: MAX_LABEL - 1]}…"
            same = sum(each == name or each.startswith(f"{name} (") for each in found)
            found.append(f"{name} ({same + 1})" if same else name)
        worlds = {id(control.simulation): key for key, control in self.all_worlds().items()}
        listed = []
        for (key, slot), label in zip(self._slots.items(), found, strict=True):
            place = ("", None) if slot.control is None else (worlds[id(slot.control.simulation)], slot.index)
            listed.append(Listed(key, label, slot.url, *place))
        return listed

    def files(self) -> FileList:
        """Return what the folder has; recordings that could not be opened by their names are left out."""
        found = []
        for path in self.folder.path.glob(f"*{RECORDING}"):
            with contextlib.suppress(ArgumentError, OSError):
                stat = self.folder.file(path.name, RECORDING).stat()
                found.append((path.name, stat.st_mtime, stat.st_size))
        recordings = sorted(found, key=lambda each: -each[1])[:MAX_FILES]
        return FileList(recordings, self.folder.free("run", LOG), self.folder.free("run", RECORDING))

    def stop_all(self) -> None:
        """Stop every robot, past all that waits."""
        for slot in self._slots.values():
            if slot.is_connected:
                slot.stop()

    async def go_back(self, control: Control, time: float) -> None:
        """Let a world go on from a moment of its last minute, once all its robots of this panel are stopped.

        What drives these robots ends; the wheels of robots that other programs have go on turning.

        Raises:
            ArgumentError: The world does not know that moment, or shows a study; nothing was done.
            LinkLost: A robot did not confirm that it stands; it was stopped, and the world is as it was.
        """
        if self.study is not None:
            raise ArgumentError("the world of a study does not go back", hint="choose a generation to see it again")
        simulation = control.simulation
        moment, is_paused = simulation.past.at(time), simulation.clock.is_paused
        slots = [each for each in self._slots.values() if each.control and each.control.simulation is simulation]
        control.resume()  # in a paused world no robot could confirm anything
        try:
            for slot in slots:
                slot.stop()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(PARTING):
                    for slot in slots:
                        await slot.drive.wait_until_stopped()
        finally:
            if is_paused:
                control.pause()
        moving = [slot.name for slot in slots if slot.drive.may_move]
        if moving:
            raise LinkLost(
                f"the world did not go back: {', '.join(moving)} did not confirm that it stands",
                hint="let its link and the speed of the world be as usual, and try again",
            )
        control.world.go_back(moment)

    async def close(self) -> list[str]:
        """Stop and disconnect every robot at once, within a bound; return the names of those that may still move."""
        slots = [*self._slots.values(), *self._parting]
        for slot in slots:
            if slot.control is not None:
                slot.control.resume()  # in a paused world no robot could confirm anything
        self.stop_all()
        await self._tasks.end()
        await asyncio.gather(*map(_part, slots))
        self._slots.clear()
        return [slot.name for slot in slots if slot.drive.may_move]


@lru_cache(256)
def short(url: str) -> str:
    """Return a robot's URL in short: ``rfcomm0``, ``192.168.1.20:1000``; a virtual robot by its name in its world.

    The only robot of a world has the world's name beside its own: ``epuck-1 (arena)``.
    """
    try:
        found = parse_url(url)
    except ElibError:
        return url
    last = found.target.rstrip("/").rpartition("/")[2]
    if found.scheme != "sim":
        return last or found.scheme
    return f"epuck-{found.keys['robot']}" if "robot" in found.keys else f"epuck-1 ({last or 'arena'})"


def check_standing(moving: Sequence[str]) -> None:
    """Raise LinkLost if there are robots, named here, that did not confirm their last stop."""
    if moving:
        raise LinkLost(
            f"{', '.join(moving)} did not confirm that it stands: it may still be moving",
            hint="switch it off, or hold it",
        )


async def _part(slot: Slot) -> None:
    """Stop a robot, disconnect it, and end what drove it."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(PARTING):
            await slot.disconnect()
    await slot.drive.close()


def _refuse_files(text: str) -> None:
    """Refuse a URL by which a page on another computer would read files of this one, by an ArgumentError."""
    url = parse_url(text)
    names_file = url.scheme == "replay" or (url.scheme == "sim" and url.target not in ("", *gallery()))
    names_file = names_file or any(url.keys.get(key) for key in ("hardware", "profile"))
    fault = url.keys.get("fault", "")
    if names_file or os.sep in fault or "/" in fault or fault.endswith(".toml"):
        raise ArgumentError(
            "a page of a shared panel may not open files of the computer it runs on",
            hint="name the file on the command line: elib joystick URL",
        )
