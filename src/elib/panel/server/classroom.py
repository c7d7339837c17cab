"""A class: a robot and a page to watch it for every student, and a page of all for the teacher."""

from __future__ import annotations

import contextlib
import dataclasses
import secrets
import shlex
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from html import escape

from elib.base.errors import ArgumentError
from elib.link.protocol.profiles import EPUCK2_WIFI
from elib.panel.panel import STUDENT, TEACHER, Can, Panel
from elib.panel.server.http import served
from elib.panel.server.listening import listen
from elib.records.et.table import Header, Table, aligned
from elib.robot.substitute import VARIABLE
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.loopback import LOOPBACK, joined
from elib.simulator.emulator.server import Served, serve
from elib.simulator.emulator.settings import SimulationSettings

FIRST_ROBOT, PAGE = 4001, 8600
"""The ports of the robot of student 1 and of the pages. Robots count up, so that a number is at the end of its port."""
LAST_PORT = 65535
LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"
"""What a token is made of: nothing that is easily mistaken on paper."""
TOKEN_LENGTH = 8
"""Half a million million tokens; after five wrong ones, an address may try one every ten seconds."""


@dataclass(frozen=True, slots=True)
class Student:
    """What one student gets."""

    number: int
    robots: Sequence[Served]  # the robots' names and URLs; one, unless the world has more
    page: str  # URL of the page to watch
    token: str = ""  # what the teacher's page asks for once; empty if it asks for nothing

    @property
    def urls(self) -> str:
        """The URLs of the robots, as the variable ELIB_ROBOT takes them."""
        return " ".join(robot.url for robot in self.robots)


@dataclass(frozen=True, slots=True)
class Classroom:
    """A class."""

    students: int  # how many
    host: str = LOOPBACK  # address at which the robots and pages are offered
    is_shared: bool = False  # whether all robots are in one world; otherwise each student has one of his own
    robot_port: int = FIRST_ROBOT  # port of the first robot; 0 takes free ones
    page_port: int = PAGE  # port of the pages; 0 takes a free one

    @contextlib.asynccontextmanager
    async def open(self, settings: SimulationSettings) -> AsyncIterator[list[Student]]:
        """Offer robots and pages until the block is left.

        Yields:
            The students, and the teacher last, with the number 0.
        """
        if self.is_shared and settings.robots is not None:
            raise ArgumentError("--shared has a robot for each student", hint="leave --robots out")
        async with contextlib.AsyncExitStack() as stack:
            address = listen(self.host, self.page_port, "--view")  # first, because its errors say what to do
            stack.callback(address.socket.close)
            robots: dict[str, list[Served]] = {}
            worlds: dict[str, Control] = {}
            if self.is_shared:
                settings = dataclasses.replace(settings, robots=self.students)
                shared, worlds[""] = await self._open_world(stack, settings, 1, self.robot_port)
                robots = {str(number): [robot] for number, robot in enumerate(shared, 1)}
            else:
                port = self.robot_port
                for number in range(1, self.students + 1):
                    own, worlds[str(number)] = await self._open_world(stack, settings, number, port)
                    robots[str(number)] = own
                    port += len(own) if port else 0
            can = Can() if self.is_shared else STUDENT  # in a shared world he would move the robots of others
            pages = {
                key: Panel(is_shared=True, can=can, worlds={"": worlds.get(key) or worlds[""]}, reachable=_named(own))
                for key, own in robots.items()
            }
            everybody = [(f"{key} {name}", url) for key, own in robots.items() for name, url in _named(own)]
            teacher = Panel(is_shared=True, can=TEACHER, worlds=worlds, reachable=everybody)
            token = "".join(secrets.choice(LETTERS) for _ in range(TOKEN_LENGTH)) if address.is_shared else ""
            server = await stack.enter_async_context(served(teacher, address, token or None, students=pages))
            students = [Student(int(key), own, f"{server.url}student/{key}") for key, own in robots.items()]
            yield [*students, Student(0, (), server.url, token)]

    async def _open_world(
        self, stack: contextlib.AsyncExitStack, settings: SimulationSettings, number: int, port: int
    ) -> tuple[list[Served], Control]:
        """Open the world of a student, or that of all, from a port on."""
        if port > LAST_PORT:
            raise ArgumentError(
                f"student {number} would get the port {port}, but {LAST_PORT} is the last one",
                hint="begin lower with --tcp, or take free ones with --tcp 0",
            )
        controls: list[Control] = []
        place = joined(self.host, port)
        on_wifi = settings.firmware == EPUCK2_WIFI.name
        tcp, wifi = (None, place) if on_wifi else (place, None)
        serving = serve(settings, pty=False, tcp=tcp, wifi=wifi, control=controls.append)
        return list(await stack.enter_async_context(serving)), controls[0]


def _named(robots: Sequence[Served]) -> list[tuple[str, str]]:
    return [(robot.name, robot.url) for robot in robots]


def listed(students: Sequence[Student]) -> str:
    """Return a table of what each student and the teacher get."""
    rows = [(str(each.number or "teacher"), each.urls, each.page, each.token) for each in students]
    headers = ("student", "robot", "page", "token")
    used = [place for place in range(len(headers)) if any(row[place] for row in rows)]
    return aligned(
        Table([Header(headers[place], "text") for place in used], [[row[place] for place in used] for row in rows])
    )


def named(urls: str) -> dict[str, str]:
    """Return the line that names robots for the programs that a shell starts, by shells."""
    return {
        "Linux, macOS": f"export {VARIABLE}={shlex.quote(urls)}",
        "Windows, PowerShell": f'$env:{VARIABLE} = "{urls}"',
        "Windows, cmd": f"set {VARIABLE}={urls}",
    }


def sheet(students: Sequence[Student], title: str) -> str:
    """Return a web page to print: a piece for each student, to be cut out."""
    pieces = "\n".join(
        f"<section><h2>{student.number}</h2><p>Your robot: type one of these lines once</p>"
        + "".join(f"<p>{escape(shell)}</p><code>{escape(line)}</code>" for shell, line in named(student.urls).items())
        + f"<p>Watch it in the browser</p><code>{escape(student.page)}</code></section>"
        for student in students
        if student.number
    )
    return SHEET.format(title=escape(title), pieces=pieces)


SHEET = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
body {{ font: 11pt sans-serif; margin: 0; display: grid; grid-template-columns: 1fr 1fr }}
section {{ border: 1px dashed #888; padding: 4mm 6mm; break-inside: avoid }}
h2 {{ float: right; margin: 0; font-size: 24pt }} p {{ margin: 2mm 0 0; color: #555 }}
</style></head><body>
{pieces}
</body></html>
"""
