"""A bare WebSocket server of aiohttp: the floor of what serves pages and programs."""

from __future__ import annotations

import asyncio
import time

from aiohttp import web

PAGE = """<canvas style="width:300px;height:300px" class="pad"></canvas><script>
const ws = new WebSocket(`ws://${location.host}/ws`);
addEventListener("pointerdown", (e) => ws.send(String(performance.timeOrigin + e.timeStamp)));
</script>"""


def echo(rate: str = "0", size: str = "0") -> None:
    """Send back what comes.

    With a *rate*, send messages of *size* bytes so often instead, and print how late each press on the page came, ms.
    """

    async def page(request: web.Request) -> web.Response:
        return web.Response(text=PAGE, content_type="text/html")

    async def socket(request: web.Request) -> web.WebSocketResponse:
        ws = web.WebSocketResponse(compress=False)
        await ws.prepare(request)

        async def send() -> None:
            while True:
                await asyncio.sleep(1 / float(rate))
                await ws.send_str("x" * int(size))

        sending = asyncio.create_task(send()) if float(rate) else None
        async for message in ws:
            if sending is None:
                await ws.send_str(message.data)
            else:
                print(1000 * time.time() - float(message.data), flush=True)
        if sending is not None:
            sending.cancel()
        return ws

    async def main() -> None:
        app = web.Application()
        app.add_routes([web.get("/", page), web.get("/ws", socket)])
        runner = web.AppRunner(app)
        await runner.setup()
        await web.TCPSite(runner, "127.0.0.1", 0).start()
        print(f"http://127.0.0.1:{runner.addresses[0][1]}/", flush=True)
        await asyncio.Event().wait()

    asyncio.run(main())
