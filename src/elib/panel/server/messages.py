"""Everything that a page may ask for: one function a message, with its fields, their ranges, and what is done.

A page sends JSON objects like ``{"do": "steer", "robot": "1", "left": 0.5, "right": 0.5}``. msgspec decodes them into
classes that are made from the functions, and that is the check: a missing, unknown or wrong field is refused.
"""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Annotated, Literal, get_type_hints

from msgspec import Meta, Struct

from elib.base.errors import ArgumentError, ElibError, about
from elib.base.files import write_file
from elib.link.protocol.quantities import CameraMode
from elib.panel import console
from elib.panel.behaviours import BehaviourRunner, source_of
from elib.panel.files import LOG, MAP, RECORDING, WORLD
from elib.panel.panel import FileList, check_standing
from elib.panel.server.conversation import Answer, Error, Failure, Message, Table, Told, decoder_of, message_of
from elib.panel.server.page import Hello, OverviewStream, Page, RobotStream, Stream, StudyStream, Update, Wish
from elib.panel.server.world import Change, NewScene, Readings, ReadingsStream, WorldStream
from elib.robot.swarms.fanout import joined
from elib.simulator.emulator.control import ORDERS
from elib.simulator.emulator.control_server import obey
from elib.simulator.physics import Colour
from elib.simulator.physics.geometry import Painted
from elib.simulator.worlds.writer import written_scene
from elib.tools import discovery
from elib.tools.states.drawing import picture_of

Key = Annotated[str, Meta(max_length=12)]
"""A robot of the panel, by its key."""
Keys = Annotated[list[Key], Meta(min_length=1, max_length=64)]
Name = Annotated[str, Meta(max_length=80)]
Text = Annotated[str, Meta(max_length=500)]
Share = Annotated[float, Meta(ge=-1, le=1)]
Pixels = Annotated[int, Meta(ge=1, le=640)]
Channel = Annotated[int, Meta(ge=0, lt=1 << 32)]
"""The page's own number for one of the worlds that it shows."""

MESSAGES = Table()
"""All messages, by their names."""
request = MESSAGES.request


# -- the page --

STREAMS: Mapping[str, Callable[[Page, Wish], Stream]] = {
    "robot": RobotStream,
    "overview": OverviewStream,
    "world": WorldStream,
    "readings": ReadingsStream,
    "study": StudyStream,
}
"""What a page can subscribe to."""


@request()
def subscribe(
    page: Page,
    what: Literal["robot", "overview", "world", "readings", "study"],
    of: Key = "",
    rate: Annotated[float, Meta(ge=0, le=60)] = 10.0,
    channel: Channel = 0,
    *,
    rays: bool = False,
) -> None:
    """Be told so many times a second of a robot or a world by its key, or of a robot of that world by its index there.

    It takes the place of what the page wanted by the same *what* and *channel*; a rate of 0 ends that.
    """
    page.subscribe(Wish(what, of, rate, channel, rays), STREAMS[what])


@request()
def drawn(page: Page, number: Annotated[int, Meta(ge=0, le=1 << 53)]) -> None:
    """Say that the page has drawn an update."""
    page.drawn(number)


@request()
def frames_drawn(
    page: Page, frames: Annotated[list[tuple[Channel, Annotated[int, Meta(ge=0, lt=1 << 32)]]], Meta(max_length=128)]
) -> None:
    """Say which frames of worlds the page has drawn: channel and number of each, the newest of a channel is enough."""
    for channel, number in frames:
        page.drawn(number, channel)


# -- robots --


@request("connect")
async def find(page: Page) -> list[discovery.Found]:
    """Look for robots on this computer's ports, and for virtual ones that run here."""
    return await discovery.find()


@request("connect")
def recents(page: Page) -> list[str]:
    """Name the robots that were used before, the newest first."""
    return page.panel.recents.urls


@request("connect")
def forget(page: Page, url: Text) -> list[str]:
    """Forget a robot that was used before."""
    page.panel.recents.remove(url)
    return page.panel.recents.urls


@request("connect")
def add(page: Page, url: Text) -> list[str]:
    """Take the robots of a URL into the panel, and connect them."""
    keys = page.panel.add_all(url)
    for key in keys:
        page.panel.connect(key)
    return keys


@request("connect")
async def remove(page: Page, robot: Key) -> None:
    """Disconnect a robot and take it out of the panel."""
    slot = page.panel.slot(robot)
    await asyncio.shield(page.panel.remove(robot))  # also when the page is closed meanwhile
    check_standing([slot.name] if slot.drive.may_move else [])  # its event log is out of sight now


@request("connect")
def connect(page: Page, robot: Key) -> None:
    """Connect a robot."""
    page.panel.connect(robot)


@request("connect")
def disconnect(page: Page, robot: Key) -> Awaitable[None]:
    """Stop a robot and close its link."""
    return page.panel.slot(robot).disconnect()


# -- driving --


@request("drive")
def steer(page: Page, robot: Key, left: Share, right: Share) -> bool:
    """Turn the wheels, as shares of the fastest that is allowed."""
    return page.panel.slot(robot).drive.steer(page.key, left, right)


@request("drive")
def beat(page: Page, robot: Key) -> bool:
    """Say that the page is still there, and drives."""
    return page.panel.slot(robot).drive.beat(page.key)


@request("drive")
def leave(page: Page, robot: Key) -> None:
    """Drive no more: the page is hidden, or shows something else."""
    page.panel.slot(robot).drive.leave(page.key)


@request("drive")
def take_over(page: Page, robot: Key) -> None:
    """Drive a robot that another page drives; the person was asked."""
    page.panel.slot(robot).drive.take(page.key, by_force=True)


@request("drive")
def limit(page: Page, robot: Key, share: Annotated[float, Meta(ge=0, le=1)]) -> None:
    """Set the fastest wheel, as a share of what the robot can do."""
    page.panel.slot(robot).drive.limit_to(share)


@request()
def stop(page: Page, robot: Key = "") -> None:
    """Stop one robot, or all of them."""
    if robot:
        page.panel.slot(robot).stop()
    else:
        page.panel.stop_all()


# -- commands --


@request("drive")
async def command(
    page: Page, robot: Key, name: Name, arguments: Annotated[tuple[int | float | Text, ...], Meta(max_length=16)] = ()
) -> str:
    """Send one command of the table."""
    slot = page.panel.slot(robot)
    value = await slot.command(name, *arguments, page=page.key)
    return console.result_text(value)


@request("drive", name="console")
def carry_out_line(page: Page, robot: Key, line: Text) -> Awaitable[console.ConsoleAnswer]:
    """Send a line that a person typed."""
    return console.answer(page.panel.slot(robot), line, page.key)


class Completions(Struct):
    """What a line may become, and what it means."""

    choices: list[str]
    help: str


@request("drive")
def complete(page: Page, robot: Key, line: Text) -> Completions:
    """Ask what a line that a person types may become, and what it means."""
    firmware = page.panel.slot(robot).firmware
    if not line.strip():
        return Completions([], "")
    try:
        words = console.help_line(line, firmware)
    except ArgumentError:
        words = ""
    return Completions(console.complete(line, firmware), words)


@request("drive")
def blink(page: Page, robot: Key) -> Awaitable[None]:
    """Let all LEDs of a robot blink for a moment, so that a person finds it."""
    return page.panel.slot(robot).blink()


# -- the camera --


@request("drive")
async def set_camera(
    page: Page,
    robot: Key,
    width: Pixels,
    height: Pixels,
    zoom: Annotated[int, Meta(ge=1, le=64)],
    mode: Literal["GREY", "COLOUR"],
) -> None:
    """Set the camera and take a picture."""
    slot = page.panel.slot(robot)
    await slot.set_camera(width, height, zoom, CameraMode[mode])
    await slot.take_picture()


@request("drive")
async def picture(page: Page, robot: Key) -> None:
    """Take one picture."""
    await page.panel.slot(robot).take_picture()


@request("drive")
def live(page: Page, robot: Key, seconds: float | None) -> None:
    """Take a picture every so many seconds; null takes no more."""
    page.panel.slot(robot).watch_camera(seconds)


# -- behaviours --


def _each(page: Page, robots: Sequence[str], act: Callable[[BehaviourRunner], object]) -> None:
    """Act on the behaviours of all robots, also after one that refuses; then say which did, and why the first."""
    errors: dict[str, ElibError] = {}
    for key in robots:
        try:
            act(page.panel.slot(key).runner)
        except ElibError as error:
            errors[key] = error
    if not errors:
        return
    first, *others = errors
    if len(robots) == 1:
        raise errors[first]
    labels = {each.key: each.label for each in page.panel.labels()}
    also = f" ({joined([labels.get(key, key) for key in others])} failed too)" if others else ""
    raise about(f"{labels.get(first, first)}{also}", errors[first])


@request("program")
def behave(
    page: Page, robots: Keys, name: Name, options: Mapping[Name, bool | int | float | Text] | None = None
) -> None:
    """Start a behaviour on some robots."""
    _each(page, robots, lambda runner: runner.start(name, options))


@request("program")
def pause_behaviour(page: Page, robots: Keys) -> None:
    """Let the behaviour of some robots wait."""
    _each(page, robots, lambda runner: runner.pause())


@request("program")
def resume_behaviour(page: Page, robots: Keys) -> None:
    """Let the behaviour of some robots go on."""
    _each(page, robots, lambda runner: runner.resume())


@request("program")
def end_behaviour(page: Page, robots: Keys) -> None:
    """End the behaviour of some robots."""
    _each(page, robots, lambda runner: runner.halt())


@request("program")
def source(page: Page, name: Name) -> str:
    """Ask for the source text of a behaviour."""
    return source_of(name)


@request()
def states(page: Page, robot: Key) -> str:
    """Ask for the picture of the states of a robot, an SVG document; an empty text without a machine of states."""
    return picture_of(page.panel.slot(robot).machine.program)


# -- files --


@request("files")
def files(page: Page) -> FileList:
    """Ask which logs and recordings the folder has, and for free names of new ones."""
    return page.panel.files()


@request("files")
def start_log(page: Page, robot: Key, name: Name) -> None:
    """Write a log; if the robot is not connected yet, from the moment it is."""
    page.panel.slot(robot).records.log.start(str(page.panel.folder.file(name, LOG)))


@request("files")
def stop_log(page: Page, robot: Key) -> None:
    """Write the log no more."""
    page.panel.slot(robot).records.log.stop()


@request("files")
def start_recording(page: Page, robot: Key, name: Name) -> None:
    """Record everything; if the robot is not connected yet, from the moment it is."""
    page.panel.slot(robot).records.recording.start(str(page.panel.folder.new_file(name, RECORDING)))


@request("files")
def stop_recording(page: Page, robot: Key) -> None:
    """Record no more."""
    page.panel.slot(robot).records.recording.stop()


class Saved(Struct):
    """A file that was saved, and the URL that opens its world."""

    name: str
    url: str


@request("files")
async def save_map(page: Page, robot: Key, name: Name) -> Saved:
    """Save what a robot's infrared sensors have met: as a picture, its TOML file, and a world."""
    grid = page.panel.slot(robot).watcher.map
    if grid is None or not grid.occupied.any():
        raise ArgumentError("there is no wall on the map yet", hint="let the robot drive along one")
    folder = page.panel.folder
    picture = folder.new_file(name, MAP)
    folder.new_file(picture.stem, WORLD)  # where the picture's places are
    world = folder.new_file(f"{picture.stem}-world", WORLD)
    grid = grid.copy()  # the robot drives on
    await asyncio.to_thread(grid.save, picture)
    await asyncio.to_thread(grid.to_world, world)
    return Saved(picture.name, f"sim://{world}")


@request("files")
def open_recording(page: Page, name: Name) -> list[str]:
    """Play a recording of the folder as a robot of the panel."""
    key = page.panel.add_recording(name)
    page.panel.connect(key)
    return [key]


@request("files")
def seek(page: Page, robot: Key, seconds: Annotated[float, Meta(ge=0, le=1e9)]) -> None:
    """Go on with a recording from another moment of it."""
    page.panel.slot(robot).playback.seek(seconds)


@request("files")
def pause_playback(page: Page, robot: Key, *, on: bool) -> None:
    """Hold a recording, or let it go on."""
    page.panel.slot(robot).playback.pause(on=on)


# -- the world --


@request()
def choose_controller(page: Page, number: Annotated[int, Meta(ge=0)] | None) -> None:
    """Let one of the best controllers of the study drive in the world; null for the newest at any time."""
    page.study().choose(number)


@request("save")
def save_world(page: Page, name: Name, about: Text = "", channel: Channel = 0) -> Saved:
    """Save the world of a channel, as it is now, as a world file of the folder."""
    path = page.panel.folder.new_file(name, WORLD)
    write_file(path, written_scene(page.control(channel).scene(), about).encode())
    return Saved(path.name, f"sim://{path}")


@request("edit")
def go_back(page: Page, time: Annotated[float, Meta(ge=0, le=1e9)], channel: Channel = 0) -> Awaitable[None]:
    """Let the world of a channel go on from a moment of its last minute, s; its robots of this panel are stopped first.

    Robots, things, lamps, sounds and the room's light are put back; time, counters, batteries and programs are not.
    """
    return page.panel.go_back(page.control(channel), time)


def _order(name: str) -> type[Message]:
    """Return the class of the messages that give an order to the world of a channel."""

    def act(page: Page, channel: int, **values: object) -> object:
        return obey(page.control(channel), {"do": name, **values})

    hints = get_type_hints(ORDERS[name], include_extras=True)
    _, *fields = inspect.signature(ORDERS[name]).parameters.values()
    typed = [
        each.replace(
            annotation=str if hints[each.name] == Painted else hints[each.name],
            default=str(each.default) if isinstance(each.default, Colour) else each.default,
        )
        for each in fields
    ]
    channel = inspect.Parameter("channel", inspect.Parameter.KEYWORD_ONLY, default=0, annotation=Channel)
    needs = "speed" if name in CLOCK else "edit"
    return message_of(act, name, [*typed, channel], ORDERS[name].__doc__, needs=needs, answers=hints["return"])


CLOCK = ("pause", "resume", "step", "set_speed")
"""Orders that concern the clock of the world alone."""
for order in ORDERS:
    MESSAGES.put(_order(order))

TOLD: tuple[type[Told], ...] = (Hello, Update, NewScene, Change, Readings, Answer, Failure, Error)
"""What a page is told."""

decode = decoder_of(MESSAGES.values())
