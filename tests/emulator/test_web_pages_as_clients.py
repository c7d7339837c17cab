"""A web page from elsewhere that sends requests to a robot that is served on TCP: the robot does not move."""

from __future__ import annotations

import asyncio
import contextlib

import pytest
from browser import browser, needs_browser

from elib.base.errors import LinkLost
from elib.link.transport import open_transport
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import until

PAGE = """<!doctype html><title>cats</title><script>
window.done = 0;
const body = "\\rD,300,300\\r", robot = "//127.0.0.1:PORT/";
const over = () => { done += 1; };
addEventListener("DOMContentLoaded", async () => {
  for (const method of ["POST", "GET", "HEAD", "PUT", "DELETE", "PATCH"])
    for (const mode of ["no-cors", "cors"])
      await fetch("http:" + robot, {method, mode, body: method == "GET" || method == "HEAD" ? undefined : body})
        .then(over, over);
  await fetch("https:" + robot, {method: "POST", mode: "no-cors", body}).then(over, over);
  const socket = new WebSocket("ws:" + robot);
  socket.onerror = over;
  socket.onopen = () => { socket.send(body); over(); };
});
</script><body></body>"""


@needs_browser
@pytest.mark.long
async def test_no_request_of_a_foreign_page_reaches_a_served_robot() -> None:
    async with serve(SimulationSettings(world="square"), tcp="0") as served:
        url = served[0].url
        page = PAGE.replace("PORT", url.rpartition(":")[2]).encode()

        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            with contextlib.closing(writer), contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
                await reader.readuntil(b"\r\n\r\n")
                writer.write(b"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nConnection: close\r\n\r\n" + page)
                await writer.drain()

        async with await asyncio.start_server(answer, "127.0.0.1", 0) as site, browser() as open_page:
            tab = await open_page(f"http://127.0.0.1:{site.sockets[0].getsockname()[1]}/")
            await tab.until("window.done == 14")

        async def asked() -> bytes:
            robot, heard = await open_transport(url), b""
            try:
                await robot.write(b"E\rQ\r")
                while heard.count(b"\n") < 2:
                    heard += await robot.read()
            except LinkLost:  # the browser had it still, by a connection to spare
                return b""
            finally:
                await robot.close()
            return heard

        assert await until(asked) == b"e,0,0\r\nq,0,0\r\n"
