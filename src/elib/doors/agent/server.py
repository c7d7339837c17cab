"""The MCP server of an agent: its tools by stdio, or by HTTP for programs of this computer."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
from collections.abc import Mapping
from typing import Any, TextIO, cast

import mcp_types as types
from mcp.server.context import ServerRequestContext
from mcp.server.lowlevel.server import Server
from mcp.server.stdio import stdio_server

from elib import __version__
from elib.base.errors import ArgumentError
from elib.doors.agent.pipes import LAST_WORDS, Complaints, Lines, Output
from elib.doors.agent.tool import Result, Tool
from elib.doors.agent.tools import Tools, wrong

MAX_LOGGED = 300
"""Characters of arguments and results that a line of the log keeps."""
MAX_CALLS = 32
"""Calls that may be under way at once; more are refused."""
INSTRUCTIONS = """\
You drive e-puck robots: small two-wheeled robots, 7 cm wide, with eight infrared sensors that see about 5 cm far, a
camera and LEDs. Every tool is a complete action: when it returns, the wheels stand, and the result says what happened
and what is seen now. Units are metres, seconds and degrees; positive angles turn to the left; places are measured from
where the robot started, x ahead and y to the left. Look before you drive, drive short ways, and read the field `ended`
of each result. A fence, a speed limit and a budget hold, whatever you ask for; `status` tells what they leave. A person
may stop the robot at any time; then ask the person, and do not try to go on."""


class Journal:
    """Writes every call and its result: to the robot's event log, to the error output, and to a file.

    Args:
        tools: The agent's tools.
        complaints: The error output.
        file: Takes a line of JSON for each call; None for no file.
    """

    def __init__(self, tools: Tools, complaints: Complaints, file: TextIO | None) -> None:
        self._tools, self._complaints, self._file = tools, complaints, file
        self._loop = asyncio.get_running_loop()
        self._began = self._loop.time()

    def write(self, name: str, arguments: Mapping[str, object], result: Result, seconds: float) -> None:
        """Write one call."""
        asked = json.dumps(arguments, ensure_ascii=False, default=str)[:MAX_LOGGED]
        said = result.text.partition("\n")[0][:MAX_LOGGED]
        line = f"{name[:80]} {asked}: {said}"
        driver = self._tools.drivers.get(str(arguments.get("robot", next(iter(self._tools.drivers)))))
        if driver is not None:
            driver.slot.note(line, kind="agent", is_bad=result.is_error)
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
            "result": result.data,
        }
        try:
            self._file.write(json.dumps(entry, ensure_ascii=False, default=str) + "\n")
            self._file.flush()
        except OSError as error:
            self._complaints.say(f"elib agent: the log cannot be written, and ends here: {error}")
            self._file = None


class AgentDoor:
    """The MCP server of one agent.

    Args:
        tools: Its tools.
        journal: Where calls are written.
    """

    def __init__(self, tools: Tools, journal: Journal) -> None:
        self._tools, self._journal = tools, journal
        self._loop = asyncio.get_running_loop()
        self._calls: set[asyncio.Task[Result]] = set()
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
        return types.ListToolsResult(tools=[_described(tool) for tool in self._tools.tools.values()])

    async def _call(
        self, context: ServerRequestContext[Any], params: types.CallToolRequestParams
    ) -> types.CallToolResult:
        began = self._loop.time()
        arguments = params.arguments or {}
        try:
            checked = self._checked(params.name, arguments)
        except ArgumentError as error:
            result = wrong(error)
        else:
            result = await self._carried_out(self._tools.tools[params.name], checked, gone(context))
        self._journal.write(params.name, arguments, result, self._loop.time() - began)
        return _answer(result)

    def _checked(self, name: str, arguments: Mapping[str, object]) -> dict[str, object]:
        tool = self._tools.tools.get(name)
        if tool is None:
            raise ArgumentError(f"there is no tool {name[:80]!r}", hint=f"choose one of {', '.join(self._tools.tools)}")
        if len(self._calls) >= MAX_CALLS and name != "stop":
            raise ArgumentError(f"{MAX_CALLS} calls are under way", hint="wait for their results")
        return tool.check(arguments)

    async def _carried_out(self, tool: Tool, arguments: Mapping[str, object], is_gone: asyncio.Event | None) -> Result:
        """Carry out a call in a task of its own; when its caller cancels it or is gone, its robot stops at once."""
        task = self._loop.create_task(self._tools.call(tool, arguments), name=f"elib agent calls {tool.name}")
        self._calls.add(task)
        task.add_done_callback(self._ended)
        leaving = None if is_gone is None else self._loop.create_task(is_gone.wait())
        try:
            if leaving is not None:
                await asyncio.wait([task, leaving], return_when=asyncio.FIRST_COMPLETED)
                if not task.done():
                    self._cancel(tool, arguments, task)
            return await asyncio.shield(task)
        except asyncio.CancelledError:
            self._cancel(tool, arguments, task)
            raise
        finally:
            if leaving is not None:
                leaving.cancel()

    def _cancel(self, tool: Tool, arguments: Mapping[str, object], task: asyncio.Task[Result]) -> None:
        if task.done() or tool.is_reading or tool.name == "stop":
            return
        self._tools.cancel(arguments, task)
        cancelled = Result({"ended": "cancelled"}, "the caller cancelled the call, or is gone", is_error=True)
        self._journal.write(tool.name, arguments, cancelled, 0.0)

    def _ended(self, task: asyncio.Task[Result]) -> None:
        self._calls.discard(task)
        if not task.cancelled():
            task.exception()  # a caller that is gone does not ask for it any more


def gone(context: ServerRequestContext[Any]) -> asyncio.Event | None:
    """Return the event that is set when the connection of a request over HTTP is closed; None for stdio."""
    scope = getattr(context.request, "scope", None)
    return None if scope is None else scope.get("elib.gone")


def _is_strict(arguments: Mapping[str, object]) -> bool:
    """Return whether arguments are JSON for every reader: without NaN and infinities."""
    try:
        json.dumps(arguments, allow_nan=False)
    except ValueError:
        return False
    return True


def _described(tool: Tool) -> types.Tool:
    hints = types.ToolAnnotations(
        title=tool.title,
        read_only_hint=tool.is_reading,
        destructive_hint=False,
        idempotent_hint=tool.is_reading or tool.name in ("stop", "set_leds", "go_to"),
        open_world_hint=False,
    )
    return types.Tool(
        name=tool.name, title=tool.title, description=tool.about, input_schema=tool.schema(), annotations=hints
    )


def _answer(result: Result) -> types.CallToolResult:
    content: list[types.ContentBlock] = [types.TextContent(text=result.text)]
    if result.picture:
        content.append(types.ImageContent(data=result.picture, mime_type="image/png"))
    return types.CallToolResult(content=content, structured_content=result.data, is_error=result.is_error)


def quiet() -> None:
    """Keep the SDK's own log off the error output, which a client may not read: a write to it could block."""
    for name in ("mcp", "uvicorn", "sse_starlette"):
        logger = logging.getLogger(name)
        logger.handlers[:] = [logging.NullHandler()]
        logger.propagate = False


async def serve_pipes(door: AgentDoor, source: int, target: int) -> None:
    """Serve one client on two file descriptors, until it closes its end, or sends much and reads nothing.

    Args:
        door: The server.
        source: Descriptor from which messages are read.
        target: Descriptor to which answers are written.
    """
    output = Output(target)
    stdin, stdout = cast("Any", Lines(source, output)), cast("Any", output)
    with contextlib.suppress(BaseExceptionGroup):  # the client closed its end while it was answered
        async with stdio_server(stdin, stdout) as (messages, answers):
            await door.server.run(messages, answers, door.server.create_initialization_options())
            asyncio.get_running_loop().call_later(LAST_WORDS, output.end)
