"""What the page of the studio may ask for beside what every page may: its program, and the world in which it runs."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Annotated, Literal, get_type_hints

from msgspec import Meta

from elib.panel.server import messages as panel
from elib.panel.server.conversation import Connection, Message, Table, decoder_of, message_of
from elib.panel.server.page import Page
from elib.studio.labs import LabNews, Report
from elib.studio.program import Output, ProgramNews
from elib.studio.studio import Studio
from elib.tools.states.edits import EDITS, Splice
from elib.tools.states.picture import MachineNews, changes, machine_news
from elib.tools.states.text import MachineText
from elib.tools.states.words import Forms, forms

Text = Annotated[str, Meta(max_length=1_000_000)]
Programs = Annotated[dict[str, Text], Meta(max_length=100)]
Zipped = Annotated[bytes, Meta(max_length=20_000_000)]
Url = Annotated[str, Meta(max_length=500)]
Lines = Annotated[list[Annotated[int, Meta(ge=1, le=1_000_000)]], Meta(max_length=1000)]
Places = Annotated[dict[str, tuple[float, float]], Meta(max_length=1000)]
Speed = Annotated[float, Meta(ge=0, le=100)]


class StudioPage(Page):
    """The page of the studio.

    Args:
        studio: What it works with.
        connection: What carries messages to it.
    """

    def __init__(self, studio: Studio, connection: Connection) -> None:
        self.studio = studio
        super().__init__(studio.panel, decode, connection)


MESSAGES = Table()
"""What only this page may ask for, by name."""
request = MESSAGES.request


@request()
def run_program(
    page: StudioPage,
    text: Text,
    name: str,
    imported: Programs,
    robot: Url,
    speed: Speed,
    breakpoints: Lines,
    lab: str = "",
) -> None:
    """Begin to run a program, on the robot of a URL if there is one, at a speed; 0 is as fast as possible."""
    page.studio.run(text, name, imported, robot, breakpoints, factor(speed), lab)


@request()
def stop_program(page: StudioPage) -> None:
    """End the program, as Ctrl-C does."""
    page.studio.program.stop()


@request()
def pause_program(page: StudioPage) -> None:
    """Let the program and its robots stand still."""
    page.studio.program.pause()


@request()
def go_on(page: StudioPage, how: Literal["on", "over", "into", "out"]) -> None:
    """Let a program that stands still go on: to its next breakpoint, or by a step."""
    page.studio.program.debugger.go(how)


@request()
def set_breakpoints(page: StudioPage, lines: Lines) -> None:
    """Let the program stand still before these lines."""
    page.studio.program.debugger.breakpoints = set(lines)


@request()
def set_pace(page: StudioPage, speed: Speed) -> None:
    """Let the robots of the program live so many times faster than the clock; 0 is as fast as possible."""
    page.studio.program.place.speed = factor(speed)


@request()
def show_world(page: StudioPage, robot: Url, lab: str = "") -> None:
    """Show the world of a virtual robot, or of a lab, before a program runs in it."""
    page.studio.show(robot, lab)


@request()
def labs(page: StudioPage) -> list[LabNews]:
    """Tell of all labs."""
    return page.studio.labs.all()


@request()
async def check_lab(page: StudioPage, lab: str, text: Text) -> Report:
    """Run a program in all variants of a lab, hidden ones too, and tell what became of it."""
    return await page.studio.check(lab, text)


@request()
def open_lab_folder(page: StudioPage, zip: Zipped) -> LabNews:  # noqa: A002  # the word of the page
    """Take a lab from a zipped folder, as base64."""
    return page.studio.labs.open(zip)


@request()
def read_states(page: StudioPage, text: Text, places: Places) -> MachineNews:
    """Return the state machine of a program; *places* says where a hand has put states."""
    return machine_news(text, places)


@request()
def state_forms(page: StudioPage) -> Forms:
    """Return what the forms of a picture offer."""
    return forms()


def _edit(act: Callable[..., list[Splice]]) -> type[Message]:
    """Return the message of an edit of states: it holds the program, and is answered with what changes in its text."""

    def edit(page: StudioPage, text: str, **given: object) -> list[Splice]:
        program = MachineText(text)
        return changes(program, act(program, **given))

    hints = get_type_hints(act, include_extras=True)
    _, *parameters = inspect.signature(act).parameters.values()
    program = inspect.Parameter("text", inspect.Parameter.KEYWORD_ONLY, annotation=Text)
    fields = [program, *(each.replace(annotation=hints[each.name]) for each in parameters)]
    return message_of(edit, act.__name__, fields, act.__doc__, answers=list[Splice])


for each in EDITS.values():
    MESSAGES.put(_edit(each))

TOLD = (Output, ProgramNews)
"""What only this page is told."""

decode = decoder_of((*panel.MESSAGES.values(), *MESSAGES.values()))


def factor(speed: float) -> float:
    """Return how many times faster than the clock a speed is."""
    return speed or math.inf
