"""Everything that a page may ask for: one class a message, with its fields, their ranges, and what is done.

A page sends JSON objects like ``{"do": "steer", "robot": "1", "left": 0.5, "right": 0.5}``. msgspec decodes them into
these classes, and that is the check: a missing, unknown or wrong field is refused.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from typing import Annotated, Any, Literal, Union

from msgspec import Meta, Struct
from msgspec.json import Decoder

from elib.base.errors import ArgumentError
from elib.base.files import write_file
from elib.link.protocol.quantities import CameraMode
from elib.panel import console
from elib.panel.behaviours import source_of
from elib.panel.panel import FileList
from elib.panel.server.conversation import Answer, Decoded, Error, Failure, Message, Told, decoded
from elib.panel.server.page import Hello, Page, Update
from elib.panel.server.world import Change, NewScene, Readings
from elib.simulator.emulator.control_server import answer
from elib.simulator.worlds.writer import written_scene
from elib.tools import discovery

Key = Annotated[str, Meta(max_length=12)]
"""A robot of the panel, by its key."""
Keys = Annotated[list[Key], Meta(min_length=1, max_length=64)]
Name = Annotated[str, Meta(max_length=80)]
Text = Annotated[str, Meta(max_length=500)]
Share = Annotated[float, Meta(ge=-1, le=1)]


def _snake(name: str) -> str:
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name).lstrip("_")


class PageMessage(Message, tag=_snake):
    """What a page says."""


# -- the page --


class Show(PageMessage):
    """Show one robot, all robots (``overview``), or the start page (``start``)."""

    is_of_world = True

    place: Key

    def carry_out(self, page: Page) -> None:
        page.show(self.place)


class Drawn(PageMessage):
    """The page has drawn an update."""

    is_of_world = True

    number: Annotated[int, Meta(ge=0, le=1 << 53)]

    def carry_out(self, page: Page) -> None:
        page.drawn(self.number)


class FrameDrawn(PageMessage):
    """The page has drawn a frame of the world."""

    is_of_world = True

    number: Annotated[int, Meta(ge=0, le=1 << 32)]

    def carry_out(self, page: Page) -> None:
        page.world_updates.drawn(self.number)


class Find(PageMessage):
    """Look for robots on this computer's ports, and for virtual ones that run here."""

    async def carry_out(self, page: Page) -> list[discovery.Found]:
        return await discovery.find()


class Recents(PageMessage):
    """Name the robots that were used before, the newest first."""

    def carry_out(self, page: Page) -> list[str]:
        return page.panel.recents.urls


class Forget(PageMessage):
    """Forget a robot that was used before."""

    url: Text

    def carry_out(self, page: Page) -> list[str]:
        page.panel.recents.remove(self.url)
        return page.panel.recents.urls


# -- robots --


class Add(PageMessage):
    """Take the robots of a URL into the panel, and connect them."""

    url: Text

    def carry_out(self, page: Page) -> list[str]:
        keys = page.panel.add_all(self.url)
        for key in keys:
            page.panel.connect(key)
        return keys


class AboutRobot(PageMessage):
    """Says something of one robot."""

    robot: Key


class Remove(AboutRobot):
    """Disconnect a robot and take it out of the panel."""

    async def carry_out(self, page: Page) -> None:
        await asyncio.shield(page.panel.remove(self.robot))  # also when the page is closed meanwhile


class Connect(AboutRobot):
    """Connect a robot."""

    def carry_out(self, page: Page) -> None:
        page.panel.connect(self.robot)


class Disconnect(AboutRobot):
    """Stop a robot and close its link."""

    def carry_out(self, page: Page) -> Awaitable[None]:
        return page.panel.slot(self.robot).disconnect()


# -- driving --


class Steer(AboutRobot):
    """Turn the wheels, as shares of the fastest that is allowed."""

    left: Share
    right: Share

    def carry_out(self, page: Page) -> bool:
        return page.panel.slot(self.robot).drive.steer(page.key, self.left, self.right)


class Beat(AboutRobot):
    """Say that the page is still there, and drives."""

    def carry_out(self, page: Page) -> bool:
        return page.panel.slot(self.robot).drive.beat(page.key)


class Leave(AboutRobot):
    """Drive no more: the page is hidden, or shows something else."""

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).drive.leave(page.key)


class TakeOver(AboutRobot):
    """Drive a robot that another page drives; the person was asked."""

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).drive.take(page.key, by_force=True)


class Limit(AboutRobot):
    """Set the fastest wheel, as a share of what the robot can do."""

    share: Annotated[float, Meta(ge=0, le=1)]

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).drive.limit_to(self.share)


class Stop(PageMessage):
    """Stop one robot, or all of them."""

    robot: Key = ""

    def carry_out(self, page: Page) -> None:
        if self.robot:
            page.panel.slot(self.robot).stop()
        else:
            page.panel.stop_all()


# -- commands --


class Command(AboutRobot):
    """Send one command of the table."""

    name: Name
    arguments: Annotated[list[int | float | Text], Meta(max_length=16)] = []

    async def carry_out(self, page: Page) -> str:
        slot = page.panel.slot(self.robot)
        value = await slot.command(self.name, *self.arguments, page=page.key)
        return console.result_text(value, slot.firmware)[: console.MAX_SHOWN]


class Console(AboutRobot):
    """Send a line that a person typed."""

    line: Text

    def carry_out(self, page: Page) -> Awaitable[console.ConsoleAnswer]:
        return console.answer(page.panel.slot(self.robot), self.line, page.key)


class Completions(Struct):
    """What a line may become, and what it means."""

    choices: list[str]
    help: str


class Complete(AboutRobot):
    """Ask what a line that a person types may become, and what it means."""

    line: Text

    def carry_out(self, page: Page) -> Completions:
        firmware = page.panel.slot(self.robot).firmware
        choices = console.complete(self.line, firmware) if self.line.strip() else []
        try:
            words = console.help_line(self.line, firmware) if self.line.strip() else ""
        except ArgumentError:
            words = ""
        return Completions(choices, words)


class Blink(AboutRobot):
    """Let all LEDs of a robot blink for a moment, so that a person finds it."""

    def carry_out(self, page: Page) -> Awaitable[None]:
        return page.panel.slot(self.robot).blink()


# -- the camera --


class SetCamera(AboutRobot):
    """Set the camera and take a picture."""

    width: Annotated[int, Meta(ge=1, le=640)]
    height: Annotated[int, Meta(ge=1, le=640)]
    zoom: Annotated[int, Meta(ge=1, le=64)]
    mode: Literal["GREY", "COLOUR"]

    async def carry_out(self, page: Page) -> None:
        slot = page.panel.slot(self.robot)
        await slot.set_camera(self.width, self.height, self.zoom, CameraMode[self.mode])
        await slot.take_picture()


class TakePicture(AboutRobot, tag="picture"):
    """Take one picture."""

    async def carry_out(self, page: Page) -> None:
        await page.panel.slot(self.robot).take_picture()


class Live(AboutRobot):
    """Take a picture every so many seconds; null takes no more."""

    seconds: float | None

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).watch_camera(self.seconds)


# -- behaviours --


class Behave(PageMessage):
    """Start a behaviour on some robots."""

    robots: Keys
    name: Name
    options: dict[Name, bool | int | float | Text] = {}

    def carry_out(self, page: Page) -> None:
        for key in self.robots:
            page.panel.slot(key).runner.start(self.name, self.options)


class PauseBehaviour(PageMessage):
    """Let the behaviour of some robots wait."""

    robots: Keys

    def carry_out(self, page: Page) -> None:
        for key in self.robots:
            page.panel.slot(key).runner.pause()


class ResumeBehaviour(PageMessage):
    """Let the behaviour of some robots go on."""

    robots: Keys

    def carry_out(self, page: Page) -> None:
        for key in self.robots:
            page.panel.slot(key).runner.resume()


class EndBehaviour(PageMessage):
    """End the behaviour of some robots."""

    robots: Keys

    def carry_out(self, page: Page) -> None:
        for key in self.robots:
            page.panel.slot(key).runner.halt()


class Source(PageMessage):
    """Ask for the source text of a behaviour."""

    name: Name

    def carry_out(self, page: Page) -> str:
        return source_of(self.name)


# -- files --


class Files(PageMessage):
    """Ask which logs and recordings the folder has, and for free names of new ones."""

    def carry_out(self, page: Page) -> FileList:
        return page.panel.files()


class StartLog(AboutRobot):
    """Write a log; if the robot is not connected yet, from the moment it is."""

    name: Name

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).start_log(str(page.panel.folder.log(self.name)))


class StopLog(AboutRobot):
    """Write the log no more."""

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).records.stop_log()


class StartRecording(AboutRobot):
    """Record everything; if the robot is not connected yet, from the moment it is."""

    name: Name

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).start_recorder(str(page.panel.folder.recording(self.name)))


class StopRecording(AboutRobot):
    """Record no more."""

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).records.stop_recorder()


class OpenRecording(PageMessage):
    """Play a recording of the folder as a robot of the panel."""

    name: Name

    def carry_out(self, page: Page) -> list[str]:
        key = page.panel.add_recording(self.name)
        page.panel.connect(key)
        return [key]


class Seek(AboutRobot):
    """Go on with a recording from another moment of it."""

    seconds: Annotated[float, Meta(ge=0, le=1e9)]

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).playback.seek(self.seconds)


class PausePlayback(AboutRobot):
    """Hold a recording, or let it go on."""

    on: bool

    def carry_out(self, page: Page) -> None:
        page.panel.slot(self.robot).playback.pause(on=self.on)


# -- the world --


class ChooseWorld(AboutRobot):
    """Show the world of one robot where the page shows all robots."""

    is_of_world = True

    def carry_out(self, page: Page) -> None:
        page.world_of = self.robot


class Rays(PageMessage):
    """Show the rays of the infrared sensors, or not."""

    is_of_world = True

    on: bool

    def carry_out(self, page: Page) -> None:
        page.wants_rays = self.on


class Watch(PageMessage):
    """Tell what one robot of the world perceives, by its index there; null for none."""

    is_of_world = True

    index: Annotated[int, Meta(ge=0, le=1 << 20)] | None

    def carry_out(self, page: Page) -> None:
        page.watched = self.index


class ChooseController(PageMessage):
    """Let one of the best controllers of the study drive in the world; null for the newest at any time."""

    number: Annotated[int, Meta(ge=0)] | None

    def carry_out(self, page: Page) -> None:
        if page.panel.study is None:
            raise ArgumentError("this page does not belong to a study", hint="elib evolve TASK --view opens one")
        page.panel.study.choose(self.number)


class OpenRobot(PageMessage):
    """Show the robot of the panel that has an index in the world that the page shows."""

    is_of_world = True

    index: Annotated[int, Meta(ge=0, le=1 << 20)]

    def carry_out(self, page: Page) -> None:
        simulation = page.control.simulation
        for key, slot in page.panel.slots.items():
            if slot.control is not None and slot.control.simulation is simulation and slot.index == self.index:
                page.show(key)
                return
        raise ArgumentError("this robot is not one of the panel", hint="add it by its URL")


class SavedWorld(Struct):
    """The file of a world, and the URL that opens it."""

    name: str
    url: str


class SaveWorld(PageMessage):
    """Save the world that the page shows, as it is now, as a world file of the folder."""

    name: Name
    about: Text = ""

    def carry_out(self, page: Page) -> SavedWorld:
        path = page.panel.folder.world(self.name)
        write_file(path, written_scene(page.control.scene(), self.about).encode())
        return SavedWorld(path.name, f"sim://{path}")


class World(PageMessage):
    """Control the world that the page shows: a message of the control server."""

    is_of_world = True

    message: dict[str, Any]

    def carry_out(self, page: Page) -> dict[str, Any]:
        if page.panel.is_closed and self.message.get("do") == "set_speed":
            raise ArgumentError("this world keeps its speed: the computer that simulates it has others to simulate too")
        return answer(page.control, self.message)


def _concrete(kind: type[PageMessage]) -> list[type[PageMessage]]:
    return [each for sub in kind.__subclasses__() for each in (sub, *_concrete(sub))]


MESSAGES: tuple[type[PageMessage], ...] = tuple(kind for kind in _concrete(PageMessage) if "carry_out" in vars(kind))
"""All of them."""

TOLD: tuple[type[Told], ...] = (Hello, Update, NewScene, Change, Readings, Answer, Failure, Error)
"""What a page is told."""

_DECODER: Decoder[PageMessage] = Decoder(Union[MESSAGES])  # noqa: UP007  # a tuple of types has no |


def decode(text: str) -> Decoded:
    """Return the number of a message, and what a page said; of a wrong message, what is wrong with it."""
    return decoded(_DECODER, text)
