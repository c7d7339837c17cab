"""The MCP server of an agent: its tools by stdio, or by HTTP for programs of this computer."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import socket
import sys
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from typing import Any, TextIO, cast

import mcp_types as types
import uvicorn
from mcp.server.context import ServerRequestContext
from mcp.server.lowlevel.server import Server
from mcp.server.stdio import stdio_server
from mcp.server.transport_security import TransportSecuritySettings
from mcp_types import CallToolResult

from elib import __version__
from elib.base.browser import show_page
from elib.base.errors import ArgumentError
from elib.base.tasks import Tasks
from elib.doors.agent.limits import Limits
from elib.doors.agent.pipes import MAX_LINE, Complaints, Pipes
from elib.doors.agent.results import answer, refused, text_of
from elib.doors.agent.tools import Tools
from elib.doors.robots import connected
from elib.panel.server.listening import listen

MAX_LOGGED = 300
"""Characters of arguments and results that a line of the log keeps."""
MAX_CALLS = 32
"""Calls that may be under way at once; more are refused."""
PERIOD = 0.05
"""s from one look at whether the caller over HTTP is still there to the next."""
IDLE_TIME = 600.0
"""s without a request over HTTP after which a session ends."""
MAX_SESSIONS, MAX_CONNECTIONS = 16, 64
INSTRUCTIONS = """\
You drive e-puck robots: small two-wheeled robots, 7 cm wide, with eight infrared sensors that see about 5 cm far, a
camera and LEDs. Every tool is a complete action: when it returns, the wheels stand, and the result says what happened
and what is seen now. Units are metres, seconds and degrees; positive angles turn to the left; places are measured from
where the robot started, x ahead and y to the left. Look before you drive, drive short ways, and read the field `ended`
of each result. A fence, a speed limit and a budget hold, whatever you ask for; `status` tells what they leave. A person
may stop the robot at any time; then ask the person, and do not try to go on."""


class Journal:
    """Writes every call and its result: to the robot's event log, to the error output, and to a file."""

    def __init__(self, tools: Tools, complaints: Complaints, file: TextIO | None) -> None:
        self._tools, self._complaints, self._file = tools, complaints, file
        self._loop = asyncio.get_running_loop()
        self._began = self._loop.time()

    def write(self, name: str, arguments: Mapping[str, object], result: CallToolResult, seconds: float) -> None:
        """Write one call."""
        asked = json.dumps(arguments, ensure_ascii=False, default=str)[:MAX_LOGGED]
        said = text_of(result).partition("\n")[0][:MAX_LOGGED]
        line = f"{name[:80]} {asked}: {said}"
        driver = self._tools.drivers.get(str(arguments.get("robot", next(iter(self._tools.drivers)))))
        if driver is not None:
            driver.slot.log.note(line, "agent", is_bad=result.is_error)
        self._complaints.say(f"elib agent: {line}")
        if self._file is None:
            return
        entry = {
            "time": round(self._loop.time() - self._began, 3),
            "seconds": round(seconds, 3),
            "tool": name[:80],
            # As text if they are long, or hold NaN or an infinity, which a reader of JSON refuses.
            "arguments": arguments if len(asked) < MAX_LOGGED and _is_strict(arguments) else asked,
            "is_error": result.is_error,
            "result": result.structured_content,
        }
        try:
            self._file.write(json.dumps(entry, ensure_ascii=False, default=str) + "\n")
            self._file.flush()
        except OSError as error:
            self._complaints.say(f"elib agent: the log cannot be written, and ends here: {error}")
            self._file = None


class AgentDoor:
    """The MCP server of one agent."""

    def __init__(self, tools: Tools, journal: Journal) -> None:
        self._tools, self._journal = tools, journal
        self._loop = asyncio.get_running_loop()
        self._calls = Tasks()
        self.server: Server[Any] = Server(
            "elib",
            version=__version__,
            title="elib: e-puck robots",
            instructions=INSTRUCTIONS,
            on_list_tools=self._list,
            on_call_tool=self._call,
        )

    async def _list(
        self, context: ServerRequestContext[Any], params: types.PaginatedRequestParams | None
    ) -> types.ListToolsResult:
        return types.ListToolsResult(
            tools=[
                types.Tool(
                    name=tool.name,
                    title=tool.title,
                    description=tool.description,
                    input_schema=tool.parameters,
                    annotations=tool.annotations,
                )
                for tool in self._tools.tools.values()
            ]
        )

    async def _call(self, context: ServerRequestContext[Any], params: types.CallToolRequestParams) -> CallToolResult:
        began = self._loop.time()
        arguments = params.arguments or {}
        if len(self._calls) >= MAX_CALLS and params.name != "stop":
            result = refused(ArgumentError(f"{MAX_CALLS} calls are under way", hint="wait for their results"))
        else:
            result = await self._carried_out(params.name, arguments, context.request)
        self._journal.write(params.name, arguments, result, self._loop.time() - began)
        return result

    async def _carried_out(self, name: str, arguments: Mapping[str, Any], request: Any) -> CallToolResult:
        """Carry out a call in a task of its own; when its caller cancels it or is gone, its robot stops at once.

        A *request* over HTTP knows whether its connection is closed; over stdio there is none.
        """
        task = self._calls.begin(self._tools.call(name, arguments), f"elib agent calls {name[:80]}")
        # A caller that is gone does not ask for the error any more.
        task.add_done_callback(lambda task: task.cancelled() or task.exception())
        try:
            while request is not None and not (await asyncio.wait([task], timeout=PERIOD))[0]:
                if await request.is_disconnected():
                    self._cancel(name, arguments, task)
                    break
            return await asyncio.shield(task)
        except asyncio.CancelledError:
            self._cancel(name, arguments, task)
            raise

    def _cancel(self, name: str, arguments: Mapping[str, Any], task: asyncio.Task[CallToolResult]) -> None:
        """Stop the robot that a call moves; a call that moves none goes on to its end."""
        for driver in self._tools.drivers.values():
            if driver.mover is task:
                driver.end("cancelled")
                cancelled = answer({"ended": "cancelled"}, "the caller cancelled the call, or is gone", is_error=True)
                self._journal.write(name, arguments, cancelled, 0.0)


def _is_strict(arguments: Mapping[str, object]) -> bool:
    """Return whether arguments are JSON for every reader: without NaN and infinities."""
    try:
        json.dumps(arguments, allow_nan=False)
    except ValueError:
        return False
    return True


@contextlib.asynccontextmanager
async def opened(urls: Sequence[str], limits: Limits, *, file: TextIO | None, view: bool) -> AsyncIterator[AgentDoor]:
    """Connect the robots of an agent; stop and disconnect them when the block is left."""
    # The SDK's own log stays off the error output, which a client may not read: a write to it could block.
    for name in ("mcp", "uvicorn", "sse_starlette"):
        logger = logging.getLogger(name)
        logger.handlers[:] = [logging.NullHandler()]
        logger.propagate = False
    with contextlib.ExitStack() as stack:
        page = listen() if view else None
        if page is not None:
            stack.enter_context(contextlib.closing(page.socket))
        async with connected(urls, page=page) as panel:
            if page is not None:
                print(f"watch and stop the robots: {page.url}", file=sys.stderr, flush=True)
                show_page(page.url)
            tools = Tools(panel, limits)
            yield AgentDoor(tools, Journal(tools, Complaints(), file))


async def serve_pipes(door: AgentDoor, source: int, target: int) -> None:
    """Serve one client on two file descriptors, until it closes its end, or sends much and reads nothing."""
    pipes = Pipes(source, target)
    stdin, stdout = cast("Any", pipes.lines()), cast("Any", pipes)
    try:
        async with stdio_server(stdin, stdout) as (messages, answers):
            await door.server.run(messages, answers, door.server.create_initialization_options())
            pipes.end_soon()
    except* OSError:
        pass  # the client closed its end while it was answered


class _Uvicorn(uvicorn.Server):
    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the program."""
        yield


@contextlib.asynccontextmanager
async def served(door: AgentDoor, sock: socket.socket) -> AsyncIterator[None]:
    """Serve programs of this computer over HTTP until the block is left.

    A request that names an Origin comes from a page in a browser and is refused, and so is one for another host: a name
    of a stranger's that leads here.

    Args:
        door: The server.
        sock: A socket that listens at a port of this computer: a client that reads the address connects at once.
    """
    port = sock.getsockname()[1]
    application = door.server.streamable_http_app(
        transport_security=TransportSecuritySettings(
            enable_dns_rebinding_protection=True,
            allowed_hosts=[f"127.0.0.1:{port}", f"localhost:{port}"],
            allowed_origins=[],
        ),
        max_request_body_size=MAX_LINE,
        session_idle_timeout=IDLE_TIME,
        max_sessions=MAX_SESSIONS,
    )
    config = uvicorn.Config(
        application,
        log_config=None,
        access_log=False,
        lifespan="on",
        limit_concurrency=MAX_CONNECTIONS,
        timeout_graceful_shutdown=1,
        ws="none",
    )
    server = _Uvicorn(config)
    serving = asyncio.get_running_loop().create_task(server.serve([sock]), name="elib agent serves")
    print(f"http://127.0.0.1:{port}/mcp", flush=True)
    try:
        yield
    finally:
        server.should_exit = True
        await serving
