"""``elib simulate --class``: a robot and a page to watch it for every student of a class."""

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
from elib.panel.panel import STUDENT, Panel
from elib.panel.server.http import served
from elib.panel.server.listening import listen
from elib.records.et.table import Header, Table, aligned
from elib.robot.substitute import VARIABLE
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.loopback import LOOPBACK, joined
from elib.simulator.emulator.server import Served, serve
from elib.simulator.emulator.settings import SimulationSettings

FIRST_ROBOT, FIRST_PAGE = 4001, 8601
"""The ports of student 1; those of the next ones count up, so that the number of a student is at their end."""
LAST_PORT = 65535
LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"
"""What a token is made of: nothing that is easily mistaken on paper."""
TOKEN_LENGTH = 8
"""Half a million million tokens; after five wrong ones, an address may try one every ten seconds."""


@dataclass(frozen=True, slots=True)
class Student:
    """What one student gets.

    Attributes:
        number: Number of the student, from 1; 0 for the teacher.
        robots: The robots' names and URLs; one, unless the world has more.
        page: URL of the page to watch; empty where the page is not the student's.
        token: What the page asks for once; empty if it asks for nothing.
    """

    number: int
    robots: Sequence[Served]
    page: str = ""
    token: str = ""

    @property
    def urls(self) -> str:
        """The URLs of the robots, as the variable ELIB_ROBOT takes them."""
        return " ".join(robot.url for robot in self.robots)


@dataclass(frozen=True, slots=True)
class Classroom:
    """A class.

    Attributes:
        students: How many.
        host: Address at which the robots and pages are offered.
        is_shared: Whether all robots are in one world; otherwise each student has one of his own.
        robot_port: Port of the first robot; 0 takes free ones.
        page_port: Port of the first page; 0 takes free ones.
    """

    students: int
    host: str = LOOPBACK
    is_shared: bool = False
    robot_port: int = FIRST_ROBOT
    page_port: int = FIRST_PAGE

    @contextlib.asynccontextmanager
    async def open(self, settings: SimulationSettings) -> AsyncIterator[list[Student]]:
        """Offer robots and pages until the block is left.

        Args:
            settings: The world of each student, or the one of all.

        Yields:
            The students; in a shared world the page belongs to the teacher, who comes last and has the number 0.

        Raises:
            ArgumentError: A setting is wrong, or there are not enough ports.
            LinkError: A port is taken, or cannot be had.
        """
        if self.is_shared and settings.robots is not None:
            raise ArgumentError("--shared has a robot for each student", hint="leave --robots out")
        async with contextlib.AsyncExitStack() as stack:
            if self.is_shared:
                settings = dataclasses.replace(settings, robots=self.students)
                world = await self._open_world(stack, settings, 0, self.robot_port, self.page_port)
                students = [Student(number, [robot]) for number, robot in enumerate(world.robots, 1)]
                yield [*students, dataclasses.replace(world, robots=())]
                return
            students = []
            robot_port, page_port = self.robot_port, self.page_port
            for number in range(1, self.students + 1):
                student = await self._open_world(stack, settings, number, robot_port, page_port)
                students.append(student)
                robot_port += len(student.robots) if robot_port else 0
                page_port += 1 if page_port else 0
            yield students

    async def _open_world(
        self,
        stack: contextlib.AsyncExitStack,
        settings: SimulationSettings,
        number: int,
        robot_port: int,
        page_port: int,
    ) -> Student:
        """Open one world with its robots and its page."""
        for option, port in (("--tcp", robot_port), ("--view", page_port)):
            if port > LAST_PORT:
                raise ArgumentError(
                    f"student {number} would get the port {port}, but {LAST_PORT} is the last one",
                    hint=f"begin lower with {option}, or take free ones with {option} 0",
                )
        controls: list[Control] = []
        address = listen(self.host, page_port, "--view")  # first, because its errors say what to do
        stack.callback(address.socket.close)
        place = joined(self.host, robot_port)
        on_wifi = settings.firmware == EPUCK2_WIFI.name
        tcp, wifi = (None, place) if on_wifi else (place, None)
        serving = serve(settings, pty=False, tcp=tcp, wifi=wifi, control=controls.append)
        robots = await stack.enter_async_context(serving)
        token = "".join(secrets.choice(LETTERS) for _ in range(TOKEN_LENGTH)) if address.is_shared else ""
        urls = [(robot.name, robot.url) for robot in robots]
        panel = Panel(is_shared=True, can=STUDENT, worlds={"": controls[0]}, reachable=urls)
        server = await stack.enter_async_context(served(panel, address, token or None))
        return Student(number, robots, server.url, token)


def listed(students: Sequence[Student]) -> str:
    """Return a table of what each student gets."""
    rows = [(str(each.number), each.urls, each.page, each.token) for each in students]
    headers = ("number", "robot", "page", "token")
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
        + (f"<p>Watch it in the browser</p><code>{escape(student.page)}</code>" if student.page else "")
        + (f"<p>The token that this page asks for</p><code>{escape(student.token)}</code>" if student.token else "")
        + "</section>"
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
