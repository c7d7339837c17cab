"""Attacks on the server's port, each over a connection of its own, and each refused."""

from __future__ import annotations

import asyncio
import contextlib
import gzip
import itertools
import json
import logging
import random
import re
import socket as sockets
import struct
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from unittest import mock

import pytest
import pytest_asyncio
from guard_rig import SOCKET, Answer, Rig, guarded, parse
from local_network import LocalLoop
from page_rig import opened
from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed, InvalidStatus

from elib.base.extras import page_folder
from elib.panel.server import access
from elib.panel.server import http as server
from elib.panel.server.conversation import MAX_MESSAGE, MAX_UNREAD
from elib.panel.server.sockets import CLOSING_TIME, HEARTBEAT
from elib.simulator.emulator.control_server import Bucket
from shared import PATIENCE, needs_page, now, until

pytestmark = needs_page

# clock: simulated
LOOP = LocalLoop
TOKEN = "right-token"
SOURCES = Path(__file__).parents[2] / "page"
WITH_TOKEN = pytest.mark.parametrize("token", [TOKEN])


@pytest.fixture(autouse=True)
def nothing_is_said_on_the_terminal(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """Whatever strangers do, it is not worth a line, let alone a traceback."""
    yield
    records = [*caplog.get_records("call"), *caplog.records]
    assert [record.getMessage() for record in records if record.levelno >= logging.ERROR] == []


@pytest.fixture
def token() -> str | None:
    """What the rig's server asks for, unless a test says it."""
    return None


@pytest_asyncio.fixture
async def rig(token: str | None) -> AsyncIterator[Rig]:
    async with guarded(token=token) as rig:
        yield rig


async def refused(rig: Rig, path: str = SOCKET, **how: str | None) -> int:
    """Try to open a WebSocket and return the status of the refusal."""
    with pytest.raises(InvalidStatus) as caught:
        async with rig.socket(path, **how):
            pass
    return caught.value.response.status_code


async def thrown_out(rig: Rig, *said: str | bytes) -> int:
    """Say something on a WebSocket and return the code with which it is closed."""
    with pytest.raises(ConnectionClosed) as caught:
        async with rig.socket() as socket, asyncio.timeout(PATIENCE):
            for message in said:
                await socket.send(message)
            while True:
                await socket.recv()
    await asyncio.wait_for(rig.gone.wait(), PATIENCE)
    rig.gone.clear()
    return caught.value.rcvd.code if caught.value.rcvd else 1006


def script() -> str:
    """Return the path of a script of the page."""
    found = re.search(r'<script[^>]* src="/?([^"]+)"', (page_folder() / "index.html").read_text(encoding="utf-8"))
    assert found is not None
    return f"/{found[1]}"


def shows_nothing(answer: Answer) -> bool:
    """Return whether an answer is a refusal, with nothing of the page in it."""
    return answer.status >= 400 and b"<script" not in answer.body and "set-cookie" not in answer.headers


# -- requests --


async def test_a_page_comes_with_orders_to_the_browser(rig: Rig) -> None:
    answer = await rig.ask()
    assert answer.status == 200
    assert int(answer.headers["content-length"]) == len(answer.body)
    assert answer.headers["content-security-policy"] == (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
        f"font-src 'self'; connect-src 'self' ws://{rig.name}; "
        "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    )
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["x-frame-options"] == "deny"
    assert answer.headers["referrer-policy"] == "same-origin"
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"
    assert "server" not in answer.headers


def test_no_file_of_the_page_has_a_script_or_a_style_in_its_text() -> None:
    for file in itertools.chain(*(SOURCES.joinpath(name).rglob("*.*") for name in ("src", "public"))):
        text = file.read_text(encoding="utf-8")
        if file.suffix in (".html", ".svg"):
            assert re.findall(r"<script(?![^>]* src=)[^>]*>", text) == [], file.name
            assert re.findall(r"(?i)\son\w+\s*=|\sstyle\s*=|<style|javascript:", text) == [], file.name
        elif file.suffix in (".ts", ".tsx"):
            unsafe = r"(?i)(inner|outer|Adjacent)HTML|document\.write|\beval\(|new Function|setAttribute\(.(on|style)"
            assert re.findall(unsafe, text) == [], file.name


async def test_the_page_and_its_parts_come_from_here_and_name_no_other_place(rig: Rig) -> None:
    seen, waiting = set[str](), ["/", "/login.css"]
    while waiting:
        path = waiting.pop()
        seen.add(path)
        answer = await rig.ask(path)
        assert answer.status == 200, path
        assert int(answer.headers["content-length"]) == len(answer.body)
        kinds = ("text/html", "text/css", "text/javascript", "image/svg+xml")
        assert answer.headers["content-type"] in ["font/woff2", *(f"{kind}; charset=utf-8" for kind in kinds)]
        named = re.findall(
            rb'(?:href|src)="/?([^"]+)"|(?:from|import) ?\(?"\./([^"]+)"|url\("?\./([^")]+)', answer.body
        )
        names = {f"/{b''.join(each).decode()}" for each in named} if path.endswith((".js", ".css", "/")) else set()
        waiting += sorted(names - seen - {*waiting})
        assert {url.split(b"/")[2] for url in re.findall(rb"https?://[^\"'` ]+", answer.body)} <= {b"www.w3.org"}, path
    there = {f"/{file.name}" for file in page_folder().iterdir()}
    assert seen == there - {"/index.html", "/login.html", "/licences.txt"} | {"/"}


async def test_a_file_that_the_browser_has_is_not_sent_again(rig: Rig) -> None:
    tag = (await rig.ask(script())).headers["etag"]
    answer = await rig.ask(script(), headers=[("If-None-Match", tag)])
    assert (answer.status, answer.body) == (304, b"")


async def test_a_file_comes_compressed_to_a_browser_that_takes_gzip(rig: Rig) -> None:
    plain = await rig.ask("/login.css")
    assert plain.headers["vary"] == "accept-encoding"
    for taken in ("gzip, deflate, br", "br, gzip;q=0.5", "GZIP"):
        answer = await rig.ask("/login.css", headers=[("Accept-Encoding", taken)])
        assert answer.headers["content-encoding"] == "gzip", taken
        assert gzip.decompress(answer.body) == plain.body
        assert answer.headers["etag"] != plain.headers["etag"]
    for refused in ("", "br", "gzip;q=0, br", "gzip; q=0.0"):
        answer = await rig.ask("/login.css", headers=[("Accept-Encoding", refused)])
        assert answer.body == plain.body, refused


async def test_a_file_whose_name_changes_with_its_content_is_kept_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ("index.html", "main-ABCDEFGH.js", "inter-latin-ABCDEFGH.woff2", "login-page.css", "secrets.py")
    for name in names:
        tmp_path.joinpath(name).write_bytes(b"x")
    monkeypatch.setattr(server, "page_folder", lambda: tmp_path)
    monkeypatch.setattr(server, "_static_files", server._static_files.__wrapped__)  # without its cache
    async with guarded() as rig:
        answers = [await rig.ask(f"/{name}") for name in names]
    kept = "private, max-age=31536000, immutable"
    assert [answer.headers["cache-control"] for answer in answers] == ["no-cache", kept, kept, "no-cache", "no-store"]
    assert [answer.status for answer in answers] == [200, 200, 200, 200, 404]


async def test_the_panel_answers_to_its_own_names_also_at_the_end_of_a_tunnel(rig: Rig) -> None:
    for host in (f"localhost:{rig.port}", "127.0.0.1", "LOCALHOST:9999", f"[::1]:{rig.port}"):
        assert (await rig.ask(host=host)).status == 200, host


async def test_a_name_that_somebody_made_lead_here_is_refused(rig: Rig) -> None:
    hosts = [
        "evil.example",
        "evil.example:{port}",
        "127.0.0.1.evil.example:{port}",
        "localhost.evil.example",
        "evil.example#localhost",
        "localhost@evil.example",
        "127.0.0.1:80:80",
        "2130706433:{port}",
        "0.0.0.0:{port}",
        "[::1",
        "localhost:{port}, evil.example",
        "localhost;script-src *",
        " ",
    ]
    for each in hosts:
        host = each.format(port=rig.port)
        answer = await rig.ask(host=host)
        assert answer.status in (400, 403), host
        assert shows_nothing(answer), host
        request = SOCKET + " HTTP/1.1\r\nHost: " + host
        upgrade = "\r\nOrigin: http://evil.example\r\nUpgrade: websocket\r\nConnection: Upgrade, close\r\n"
        keys = "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        assert b" 101 " not in await rig.raw(f"GET {request}{upgrade}{keys}".encode()), host
        assert rig.pages == [], host


async def test_a_request_without_a_name_or_with_two_is_refused(rig: Rig) -> None:
    for answer in (await rig.ask(host=None), await rig.ask(headers=[("Host", "evil.example")])):
        assert answer.status in (400, 403)
        assert shows_nothing(answer)
    assert (await rig.ask(headers=[("Host", rig.name)])).status in (400, 403)


FOREIGN = {
    "an image": [("Sec-Fetch-Site", "cross-site"), ("Sec-Fetch-Mode", "no-cors"), ("Sec-Fetch-Dest", "image")],
    "a frame": [("Sec-Fetch-Site", "cross-site"), ("Sec-Fetch-Mode", "navigate"), ("Sec-Fetch-Dest", "iframe")],
    "another port's page": [("Sec-Fetch-Site", "same-site"), ("Sec-Fetch-Mode", "cors"), ("Sec-Fetch-Dest", "empty")],
    "a site twice": [("Sec-Fetch-Site", "same-origin"), ("Sec-Fetch-Site", "cross-site")],
    "a script": [("Origin", "http://evil.example")],
    "a hidden page": [("Origin", "null")],
    "a page of the other scheme": [("Origin", "https://127.0.0.1:{port}")],
    "a page of another port": [("Origin", "http://127.0.0.1:1")],
    "a page of another name of ours": [("Origin", "http://localhost:{port}")],
    "two pages": [("Origin", "http://127.0.0.1:{port}"), ("Origin", "http://evil.example")],
}


async def test_another_site_gets_nothing(rig: Rig) -> None:
    for who, headers in FOREIGN.items():
        answer = await rig.ask(headers=[(name, value.format(port=rig.port)) for name, value in headers])
        assert answer.status == 403, who
        assert shows_nothing(answer), who


async def test_a_person_may_follow_a_link_to_the_panel(rig: Rig) -> None:
    visit = [("Sec-Fetch-Site", "cross-site"), ("Sec-Fetch-Mode", "navigate"), ("Sec-Fetch-Dest", "document")]
    assert (await rig.ask(headers=visit)).status == 200
    assert (await rig.ask(headers=[("Origin", f"http://{rig.name}"), ("Sec-Fetch-Site", "same-origin")])).status == 200


async def test_nothing_can_be_sent_to_the_panel_by_a_request(rig: Rig) -> None:
    methods, paths = ("POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT", "MKCOL"), ("/", "/login", "/ws")
    origin = [("Origin", f"http://{rig.name}")]
    for method, path, headers in itertools.product(methods, (*paths, "/worlds/arena.png"), ([], origin)):
        answer = await rig.ask(path, method=method, headers=headers)
        assert answer.status in (400, 403, 404, 405), (method, path, headers)
        assert shows_nothing(answer), (method, path, headers)


async def test_a_request_for_a_page_has_no_body(rig: Rig) -> None:
    assert (await rig.ask(body=b"x")).status == 400
    assert (await rig.ask(headers=[("Transfer-Encoding", "chunked")], body=b"")).status == 400


async def test_a_path_that_no_page_has_is_refused(rig: Rig) -> None:
    paths = [
        "/../../etc/passwd",
        "/worlds/../../../../../../../../etc/passwd",
        "/worlds/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd",
        "/worlds/..%2f..%2f..%2f..%2fetc/passwd",
        "/worlds/..%5c..%5cwindows%5cwin.ini",
        "/worlds/%00.png",
        f"{script()}%00.map",
        "/worlds/..%2fserver.py",
        "/%0d%0aSet-Cookie:%20a=b",
        "/%1b[2J",
        "/\xff",
        "/..%2fserver.py",
        f"/page{script()}",
        "//etc/passwd",
        f"/{script()}",
        f"{script()}/",
        "/login.html",
        "/worlds/..%2f..%2fphysics%2fworlds%2farena.png",
        "/worlds/arena.toml",
        "http://evil.example/",
        "http://{name}/",
        "*",
        "/" + "a" * 2000,
        "/" + "a" * 20_000,
        "/?" + "a" * 20_000,
    ]
    for each in paths:
        path = each.format(name=rig.name)
        answer = await rig.raw(
            f"GET {path} HTTP/1.1\r\nHost: {rig.name}\r\nConnection: close\r\n\r\n".encode("latin-1")
        )
        assert answer == b"" or parse_status(answer) in (400, 404), path[:100]
        assert b"import" not in answer, path[:100]
        assert b"root:" not in answer, path[:100]


def parse_status(answer: bytes) -> int:
    return int(answer.split()[1])


async def test_what_no_page_answers_to_is_not_there(rig: Rig) -> None:
    nowhere = ("/admin", "/docs", "/openapi.json", "/redoc", "/login", "/static", "/metrics", "/favicon.ico")
    for path in (*nowhere, "/worlds/", "/server.py", "/floor.png"):
        answer = await rig.ask(path)
        assert (answer.status, answer.body) == (404, b"There is no such page."), path
        assert answer.headers["content-type"].startswith("text/plain")
    assert (await rig.ask("/ws")).status == 400


@WITH_TOKEN
async def test_what_a_proxy_would_say_is_not_believed(rig: Rig) -> None:
    for number in range(5):
        lies = {
            "X-Forwarded-For": f"192.0.2.{number}",
            "Forwarded": f"for=192.0.2.{number}",
            "X-Real-IP": "1.1.1.1",
        }
        assert await log_in(rig, "wrong", **lies) == (403, "")
    lies = {"X-Forwarded-For": "192.0.2.9", "Forwarded": "for=192.0.2.9", "X-HTTP-Method-Override": "GET"}
    assert await log_in(rig, TOKEN, **lies) == (429, "")
    named = [("X-Forwarded-Host", rig.name), ("X-Forwarded-Proto", "https"), ("X-Forwarded-Prefix", '"><script>')]
    assert (await rig.ask(host="evil.example", headers=named)).status == 403


async def test_what_is_no_request_ends_the_connection(rig: Rig) -> None:
    requests = [
        b"\x00" * 100,
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked, identity\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding : chunked\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\n folded: b\r\n\r\n",
        b"GET / HTTP/1.1\r\n: a\r\n\r\n",
        b"GET / HTTP/1.1\nHost: a\n\n",
        b"GET / HTTP/1.1\r\nX: y\x00z\r\n\r\n",
        b"GET  /  HTTP/1.1\r\nHost: a\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 5000,
        b"GET / HTTP/1.1\r\nX: " + b"y" * 60_000 + b"\r\n\r\n",
        b"GET /" + b"a" * 200_000,
        b"GET / HTTP/1.1\r\nHost: a\r\nX: " + b"y" * 2_000_000,
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    ]
    for data in requests:
        answer = await rig.raw(data)
        assert answer == b"" or parse_status(answer) in (400, 403, 405), data[:100]
        assert b"<script" not in answer, data[:100]
        assert (await rig.ask()).status == 200, data[:100]


async def test_the_refusal_of_what_is_no_request_has_the_headers_of_all_answers_and_repeats_nothing(rig: Rig) -> None:
    answer = parse(await rig.raw(b"GET <script>alert(1)</script>\r\n\r\n"))
    usual = await rig.ask("/missing")
    assert answer.status == 400
    assert b"script" not in answer.body
    for name in server.HEADERS:
        assert answer.headers[name.lower()] == usual.headers[name.lower()]
    assert answer.headers["content-security-policy"].startswith("default-src 'none'")
    assert answer.headers["cache-control"] == "no-store"
    assert "aiohttp" not in answer.headers.get("server", "")


async def test_damaged_requests_are_refused_or_answered_and_nothing_else_happens(
    rig: Rig, caplog: pytest.LogCaptureFixture
) -> None:
    dice = random.Random(11)
    whole = (
        f"GET /ws HTTP/1.1\r\nHost: {rig.name}\r\nOrigin: http://{rig.name}\r\nUpgrade: websocket\r\nConnection: "
        "Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nCookie: a=b\r\n\r\n"
    ).encode()
    for _ in range(300):
        data = bytearray(whole)
        for _ in range(dice.randrange(1, 6)):
            place = dice.randrange(len(data))
            data[place : place + dice.randrange(3)] = dice.randbytes(dice.randrange(4))
        reader, writer = await asyncio.open_connection(rig.host, rig.port)
        writer.write(bytes(data) + b"\r\n\r\n")
        writer.write_eof()
        with contextlib.suppress(ConnectionError):
            async with asyncio.timeout(PATIENCE):
                answer = await reader.read(2000)
            assert answer == b"" or parse_status(answer) in (101, 304, 400, 401, 403, 404, 405, 408, 413, 417, 501)
        writer.close()
    await until(lambda: rig.server.pages == 0)
    assert (await rig.ask()).status == 200


async def test_a_second_request_hidden_in_a_body_is_not_answered(rig: Rig) -> None:
    hidden = f"GET / HTTP/1.1\r\nHost: {rig.name}\r\n\r\n"
    head = f"POST /login HTTP/1.1\r\nHost: {rig.name}\r\nOrigin: http://{rig.name}\r\n"
    for way in (f"Content-Length: {len(hidden)}\r\n", "Transfer-Encoding: chunked\r\nContent-Length: 0\r\n"):
        answer = await rig.raw(f"{head}{way}Connection: close\r\n\r\n{hidden}".encode())
        assert b"<script" not in answer


async def test_a_request_that_does_not_come_is_not_waited_for(rig: Rig) -> None:
    for data in (b"", b"G", b"GET / HTTP/1.1\r\nHost: a\r\n"):
        began = now()
        assert await rig.raw(data, ends=False) == b""
        assert now() - began == pytest.approx(server.REQUEST_TIME, abs=0.1), data


async def test_a_second_request_that_does_not_come_is_not_waited_for_either(rig: Rig) -> None:
    whole = f"GET / HTTP/1.1\r\nHost: {rig.name}\r\n\r\n".encode()
    answer = await rig.raw(whole + b"GET /again HT", ends=False)
    assert answer.count(b"HTTP/1.1 200") == 1


async def test_a_request_that_comes_byte_by_byte_is_not_waited_for(rig: Rig) -> None:
    reader, writer = await asyncio.open_connection(rig.host, rig.port)
    answers = asyncio.ensure_future(reader.read())
    writer.write(b"GET / HTTP/1.1\r\nX: ")
    while not answers.done():
        writer.write(b"X")
        await asyncio.sleep(0.1)
    assert now() < 2 * server.REQUEST_TIME
    assert answers.exception() is not None or answers.result() == b""
    writer.close()


@pytest.mark.parametrize("bound", ["MAX_OF_ONE", "MAX_CONNECTIONS"])
async def test_there_is_a_bound_for_the_connections_of_one_address_and_of_all(
    rig: Rig, bound: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, bound, 3)
    request = f"GET / HTTP/1.0\r\nHost: {rig.name}\r\n\r\n".encode()
    held = [await asyncio.open_connection(rig.host, rig.port) for _ in range(3)]
    assert await rig.raw(request) == b""
    for _, writer in held:
        writer.close()
        await writer.wait_closed()
    assert (await rig.raw(request))[:4] == b"HTTP"


async def test_a_mistake_of_the_program_is_answered_and_written_down_once(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def fail(name: str) -> bytes:
        raise KeyError(name)

    monkeypatch.setattr(server, "world_picture", fail)
    answer = await rig.ask("/worlds/arena.png")
    assert (answer.status, b"KeyError" in answer.body) == (500, False)
    assert [record.getMessage() for record in caplog.records] == ["a request failed"]
    caplog.clear()


# -- WebSockets --


def steer(**changes: object) -> str:
    """Return a message of a page, which no robot is there for."""
    return json.dumps({"do": "steer", "robot": "1", "left": 0.5, "right": 0.5} | changes)


async def test_a_page_talks_with_the_panel(rig: Rig) -> None:
    said = [steer(), json.dumps({"do": "stop"}), json.dumps({"do": "forget", "url": "sim://", "id": 7})]
    async with rig.socket() as socket:
        assert json.loads(await socket.recv())["type"] == "hello"
        for text in said:
            await socket.send(text)
        async with asyncio.timeout(PATIENCE):
            while (found := json.loads(await socket.recv()))["type"] != "answer":
                pass
        assert found == {"type": "answer", "id": 7, "ok": True, "result": []}
    await asyncio.wait_for(rig.gone.wait(), PATIENCE)
    assert rig.heard == said


async def test_no_other_sites_page_opens_a_socket(rig: Rig) -> None:
    origins = [
        None,
        "null",
        "http://evil.example",
        "http://evil.example:{port}",
        "http://127.0.0.1",
        "http://127.0.0.1:1",
        "https://127.0.0.1:{port}",
        "http://localhost:{port}",
        "http://127.0.0.1:{port}.evil.example",
        "http://127.0.0.1:{port}/",
        "file://",
        "chrome-extension://abcdef",
    ]
    for each in origins:
        assert await refused(rig, origin=None if each is None else each.format(port=rig.port)) == 403, each
    assert rig.pages == []


async def test_a_socket_that_no_page_opens_is_refused(rig: Rig) -> None:
    for path in ("/", "/ws/", "/ws/socket", "/ws/%2e%2e/ws", "//ws", "/WS", "/login", script()):
        with pytest.raises((InvalidStatus, ConnectionClosed)):
            async with rig.socket(path):
                pass
    assert rig.pages == []


async def test_half_an_opening_of_a_socket_is_refused(rig: Rig) -> None:
    openings = [
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n",
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n",
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 9\r\nSec-WebSocket-Key: {key}\r\n",
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: short\r\n",
        "Upgrade: h2c\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n",
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
        "Sec-WebSocket-Protocol: \x1b[2J\r\n",
    ]
    for headers in openings:
        request = f"GET /ws HTTP/1.1\r\nHost: {rig.name}\r\nOrigin: http://{rig.name}\r\n"
        whole = request + headers.format(key="dGhlIHNhbXBsZSBub25jZQ==") + "\r\n"
        assert parse_status(await rig.raw(whole.encode())) == 400, headers
    assert rig.pages == []


MALFORMED = {
    "nothing": "",
    "no JSON": "nonsense",
    "half of it": steer()[:-1],
    "more than it": steer() + "{}",
    "a number": "1",
    "no number": '{"do":"drawn","number":NaN}',
    "a list": f"[{steer()}]",
    "nothing to do": "{}",
    "an unknown message": '{"do":"fly"}',
    "nothing to subscribe to": '{"do":"subscribe"}',
    "too many frames a second": '{"do":"subscribe","what":"world","rate":1000}',
    "the base of all": '{"do":"message"}',
    "a class": '{"do":"__class__"}',
    "a list to do": '{"do":["stop"]}',
    "no robot": '{"do":"steer","left":0,"right":0}',
    "a robot by number": steer(robot=1),
    "a robot that is none": steer(robot=None),
    "a long robot": steer(robot="1" * 13),
    "a text for a number": steer(left="0.5"),
    "a truth for a number": steer(left=True),
    "too far": steer(left=1.0001),
    "far too far": steer(left=1e308),
    "a huge number": steer(left=0).replace("0,", "9" * 400 + ","),
    "a huge exponent": '{"do":"steer","robot":"1","left":1e999,"right":0}',
    "an unknown field": steer(more=1),
    "a field of the class": steer(__class__="x"),
    "another page's name": steer(page="page-0"),
    "a number below all": '{"do":"drawn","number":-1}',
    "no time to go back to": '{"do":"go_back","time":NaN}',
    "a time without an end": '{"do":"go_back","time":1e999}',
    "a time before all": '{"do":"go_back","time":-0.1}',
    "a time as a text": '{"do":"go_back","time":"1"}',
    "a world to make instead of a time": '{"do":"go_back","time":1,"robots":[[0,0,0]]}',
    "a number beyond all": '{"do":"drawn","number":9007199254740994}',
    "a number with a point": '{"do":"drawn","number":1.5}',
    "an answer to text": '{"do":"stop","id":"7"}',
    "an answer below all": '{"do":"stop","id":-1}',
    "many robots": json.dumps({"do": "pause_behaviour", "robots": ["1"] * 65}),
    "no robots": '{"do":"pause_behaviour","robots":[]}',
    "many arguments": json.dumps({"do": "command", "robot": "1", "name": "stop", "arguments": [1] * 17}),
    "deep arguments": '{"do":"command","robot":"1","name":"stop","arguments":' + "[" * 4000 + "]" * 4000 + "}",
    "deep brackets": "[" * 8000,
    "a deep message of the world": '{"do":"world","message":' + '{"a":' * 1300 + "1" + "}" * 1301,
    "a long text": json.dumps({"do": "console", "robot": "1", "line": "x" * 501}),
    "half a letter": '{"do":"console","robot":"1","line":"\\ud800"}',
    "a zero byte": "\0",
    "a second of it": '{"do":"stop","do":"fly"}',
}


async def test_a_malformed_message_throws_the_page_out_and_reaches_nobody(rig: Rig) -> None:
    stop = '{"do":"stop"}'
    for what, message in MALFORMED.items():
        rig.heard.clear()
        assert await thrown_out(rig, stop, message, stop) == 1008, what
        assert rig.heard == [stop], what


async def test_bytes_throw_the_page_out_and_reach_nobody(rig: Rig) -> None:
    assert await thrown_out(rig, b"\x00\x00\x00\x01", '{"do":"stop"}') == 1003
    assert rig.heard == []


async def test_an_oversized_message_throws_the_page_out(rig: Rig) -> None:
    for message in ("4" * 8193, ["4" * (MAX_MESSAGE // 3 + 1)] * 3):
        assert await thrown_out(rig, message) == 1009  # type: ignore[arg-type]
    assert rig.heard == []


async def test_a_message_in_fragments_is_one_message(rig: Rig) -> None:
    async with rig.socket() as socket:
        await socket.send(['{"do":', '"st', 'op"}'])
        await until(lambda: rig.heard)
    assert rig.heard == ['{"do":"stop"}']


async def test_a_page_that_sends_too_fast_is_thrown_out(rig: Rig) -> None:
    assert await thrown_out(rig, *[steer()] * 300) == 1008
    assert len(rig.heard) == server.MESSAGES_AT_ONCE


async def test_a_page_that_drives_for_long_is_not_too_fast() -> None:
    bucket = Bucket(server.MESSAGES, server.MESSAGES_AT_ONCE)
    amount = Bucket(server.BYTES, server.BYTES_AT_ONCE)
    for _ in range(60 * 60):  # a hand that drags for a minute, sixty times a second
        await asyncio.sleep(1 / 60)
        assert bucket.take()
        assert amount.take(len(steer()) + 8)


async def test_a_message_for_a_robot_that_is_gone_is_answered_and_the_page_stays() -> None:
    async with guarded() as rig, opened(rig.url) as tab:
        answer = await tab.ask("steer", robot="7", left=1, right=1)
        assert (answer["ok"], answer["error"]["message"]) == (False, "there is no such robot in the panel")
        await tab.tell("beat", robot="7")
        assert (await tab.ask("stop"))["ok"]


async def test_a_page_cannot_act_for_another() -> None:
    async with guarded(urls=["sim://"]) as rig, opened(rig.url) as victim:
        key = await victim.connected()
        async with opened(rig.url) as thief:
            slot = rig.panel.slots[key]
            slot.drive.take(victim.hello["page"])
            assert thief.hello["page"] != victim.hello["page"]
            assert (await thief.ask("beat", robot=key))["result"] is False
            assert (await thief.ask("steer", robot=key, left=1, right=1))["result"] is False
            await thief.ask("leave", robot=key)
            assert slot.drive.driver == victim.hello["page"]
            await thief.tell("beat", robot=key, page=victim.hello["page"])
            await thief.socket.wait_closed()
            assert thief.socket.close_code == 1008


async def test_a_frame_that_is_none_throws_the_page_out(rig: Rig) -> None:
    frames = [
        b"\x81\x02{}",  # without a mask, which every browser has
        b"\xc1\x82\x00\x00\x00\x00{}",  # compressed, which was not agreed on
        b"\x83\x80\x00\x00\x00\x00",  # of no kind that there is
        b"\x80\x80\x00\x00\x00\x00",  # the rest of no message
        b"\x09\x80\x00\x00\x00\x00",  # half a ping
        b"\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff\x00\x00\x00\x00",  # longer than all memory
        b"\x88\x81\x00\x00\x00\x00x",  # a close with half a code
        b"\x81\x82\x00\x00\x00\x00\xff\xfe",  # a text of two wrong bytes
    ]
    for frame in frames:
        async with rig.socket() as socket:
            socket.transport.write(frame)
            await until_closed(socket)
        assert rig.heard == [], frame
        await until(lambda: not rig.server.pages)


async def test_a_flood_of_tiny_frames_throws_the_page_out(rig: Rig) -> None:
    frames = [
        b"\x00\x80\x00\x00\x00\x00",  # a part of a message, with nothing in it
        b"\x89\x80\x00\x00\x00\x00",  # a ping
        b"\x8a\x80\x00\x00\x00\x00",  # an answer to none
        b"\x81\x80\x00\x00\x00\x00",  # an empty message
    ]
    for frame in frames:
        async with rig.socket() as socket:
            first = b"\x01\x80\x00\x00\x00\x00" if frame[0] == 0 else b""
            socket.transport.write(first + frame * (round(server.BYTES_AT_ONCE) // len(frame) + 100))
            await until_closed(socket)
        assert rig.heard == [], frame
    assert (await rig.ask()).status == 200


async def until_closed(socket: ClientConnection) -> int:
    """Wait until a WebSocket was closed, and return with which code."""
    with pytest.raises(ConnectionClosed) as caught:
        async with asyncio.timeout(PATIENCE):
            while True:
                await socket.recv()
    return caught.value.rcvd.code if caught.value.rcvd else 1006


async def test_pings_are_answered_and_count_as_messages() -> None:
    async with guarded() as rig, rig.socket() as socket:
        async with asyncio.timeout(PATIENCE):
            await (await socket.ping())
        for _ in range(300):
            socket.transport.write(b"\x89\x80\x00\x00\x00\x00")
        assert await until_closed(socket) == 1008


async def test_sixty_four_pages_are_served_at_once_and_another_when_they_have_left(rig: Rig) -> None:
    async with contextlib.AsyncExitStack() as stack:
        held = [await stack.enter_async_context(rig.socket()) for _ in range(server.MAX_PAGES)]
        for socket in held:
            assert json.loads(await socket.recv())["type"] == "hello"
        assert await refused(rig) == 503
        assert (await rig.ask(SOCKET)).body == b"64 pages are open. Close some, and try again."
        assert (await rig.ask()).status == 200
    await until(lambda: rig.server.pages == 0)
    async with rig.socket() as socket:
        assert json.loads(await socket.recv())["type"] == "hello"


def unread(rig: Rig, unsent: int = 4096) -> sockets.socket:
    """Open a page as one does who will not read, on a connection that keeps little."""
    raw = connected(rig, unsent)
    raw.sendall(
        f"GET /ws HTTP/1.1\r\nHost: {rig.name}\r\nOrigin: http://{rig.name}\r\nUpgrade: websocket\r\nConnection: "
        "Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
    )
    return raw


def connected(rig: Rig, unsent: int) -> sockets.socket:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, LocalLoop)
    return loop.connected(rig.port, unsent=unsent)


def masked(text: str) -> bytes:
    data = text.encode()
    length = bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + struct.pack(">H", len(data))
    return b"\x81" + length + bytes(4) + data


async def test_a_page_that_reads_nothing_is_not_sent_ever_more() -> None:
    async with guarded(urls=["sim://"]) as rig, opened(rig.url) as other:
        await other.connected()
        with unread(rig) as raw:
            await until(lambda: len(rig.pages) == 2)
            mute, loop = rig.pages[1], asyncio.get_running_loop()
            # It draws all at once, so that it is sent the next, but reads nothing.
            asked = masked('{"do":"drawn","number":1000000000}') + masked('{"do":"source","name":"avoid","id":1}') * 20
            most = 0
            while rig.server.pages == 2:
                with contextlib.suppress(ConnectionError):
                    await loop.sock_sendall(raw, asked)
                await asyncio.sleep(0.3)
                most = max(most, mute.unread)
            assert most <= 2 * MAX_UNREAD
        assert now() < 3 * server.READING_TIME
        assert (await other.ask("stop"))["ok"]
        before = len(other.of("update"))
        await until(lambda: len(other.of("update")) > before)


async def test_a_browser_that_leaves_unread_what_it_asked_for_is_left(rig: Rig) -> None:
    asked = f"GET /arena.js HTTP/1.1\r\nHost: {rig.name}\r\n\r\n".encode() * 30
    with connected(rig, 4096) as raw, pytest.raises(ConnectionError):
        while True:
            await asyncio.get_running_loop().sock_sendall(raw, asked)
            await asyncio.sleep(0.5)
    assert now() < 2 * server.READING_TIME


async def test_a_page_that_is_silent_is_asked_and_then_left(rig: Rig) -> None:
    with unread(rig):
        await until(lambda: rig.pages)
        await until(lambda: rig.server.pages == 0)
    assert now() < 2 * HEARTBEAT


async def test_the_end_of_the_server_is_told_to_its_pages_and_waits_for_none() -> None:
    async with contextlib.AsyncExitStack() as stack:
        rig = await stack.enter_async_context(guarded())
        told, mute, half = rig.socket(), unread(rig), await asyncio.open_connection(rig.host, rig.port)
        socket = await told.__aenter__()
        half[1].write(b"GET / HT")
        await until(lambda: rig.server.pages == 2)
        began = now()
        await stack.aclose()
        assert now() - began < 2 * CLOSING_TIME + 0.1
        assert await until_closed(socket) == 1001
        with pytest.raises(ConnectionRefusedError):
            await asyncio.open_connection(rig.host, rig.port)
        mute.close()
        half[1].close()
        await told.__aexit__(None, None, None)


# -- the token --


def form(token: str) -> bytes:
    return f"token={token}".encode()


async def log_in(rig: Rig, token: str, **headers: str) -> tuple[int, str]:
    """Send the login form as a browser does, and return the status and the cookie."""
    sent = {"Origin": f"http://{rig.name}", "Content-Type": "application/x-www-form-urlencoded"} | headers
    answer = await rig.ask("/login", method="POST", body=form(token), headers=sent.items())
    return answer.status, answer.headers.get("set-cookie", "")


@WITH_TOKEN
async def test_who_has_shown_no_token_sees_nothing_but_the_question_for_it(rig: Rig) -> None:
    for path in ("/", "/login", script(), "/worlds/arena.png", f"/?token={TOKEN}", f"/login?token={TOKEN}"):
        answer = await rig.ask(path)
        assert answer.status == (200 if path.startswith("/login") else 401)
        assert b'name="token"' in answer.body
        assert "set-cookie" not in answer.headers
        assert TOKEN.encode() not in answer.body
    assert await refused(rig) == 401
    assert await refused(rig, f"{SOCKET}?token={TOKEN}") == 401
    assert rig.pages == []


@WITH_TOKEN
async def test_the_right_token_opens_the_panel_and_its_socket(rig: Rig) -> None:
    status, cookie = await log_in(rig, TOKEN)
    assert status == 303
    assert sorted(cookie.split("; ")[1:]) == ["HttpOnly", "Path=/", "SameSite=Strict"]
    assert TOKEN not in cookie
    shown = cookie.partition(";")[0]
    assert (await rig.ask(headers=[("Cookie", f"other=1; {shown}")])).status == 200
    async with rig.socket(cookie=shown) as socket:
        assert json.loads(await socket.recv())["type"] == "hello"


@WITH_TOKEN
async def test_a_wrong_token_opens_nothing_and_many_of_them_are_not_even_read(rig: Rig) -> None:
    wrong = ["", TOKEN[:-1], TOKEN + "x", f"{TOKEN}&token={TOKEN}", "%ff%00"]
    assert [await log_in(rig, token) for token in wrong] == [(403, "")] * 5
    assert await log_in(rig, TOKEN) == (429, "")
    assert (await rig.ask()).status == 401


@WITH_TOKEN
async def test_a_made_up_cookie_opens_nothing(rig: Rig) -> None:
    own = (await log_in(rig, TOKEN))[1].partition(";")[0]
    name, _, value = own.partition("=")
    for made_up in (f"{name}=", f"{name}=x", f"{name}={TOKEN}", name, f"{own}; {own}", f"a={value}"):
        assert (await rig.ask(headers=[("Cookie", made_up)])).status == 401, made_up
        assert await refused(rig, cookie=made_up) == 401, made_up


@WITH_TOKEN
async def test_another_sites_page_cannot_log_in_nor_use_that_somebody_has(rig: Rig) -> None:
    for origin in ("http://evil.example", "null", f"http://localhost:{rig.port}"):
        assert await log_in(rig, TOKEN, Origin=origin) == (403, "")
    own = (await log_in(rig, TOKEN))[1].partition(";")[0]
    assert await refused(rig, origin="http://evil.example", cookie=own) == 403
    answer = await rig.ask(headers=[("Cookie", own), ("Origin", "http://evil.example")])
    assert answer.status == 403
    assert rig.pages == []


@WITH_TOKEN
async def test_a_login_form_is_short_and_comes_soon(rig: Rig) -> None:
    assert (await log_in(rig, TOKEN + "&a=" + "a" * 1000))[0] in (403, 413)
    head = f"POST /login HTTP/1.1\r\nHost: {rig.name}\r\nOrigin: http://{rig.name}\r\nContent-Length: 99\r\n\r\n"
    began = now()
    assert parse_status(await rig.raw(head.encode() + b"token=")) in (400, 403)
    assert now() - began < server.FORM_TIME + 0.1


@WITH_TOKEN
async def test_secrets_are_compared_in_constant_time(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[bytes] = []

    def compare(shown: bytes, secret: bytes) -> bool:
        compared.append(shown)
        return shown == secret

    monkeypatch.setattr(access, "compare_digest", compare)
    await log_in(rig, "guess")
    cookie = (await log_in(rig, TOKEN))[1].partition(";")[0]
    await rig.ask(headers=[("Cookie", cookie)])
    assert compared == [b"guess", TOKEN.encode(), cookie.partition("=")[2].encode()]


async def test_a_shared_panel_answers_to_the_address_at_which_it_is_reached_and_to_no_name_of_somebody() -> None:
    from aiohttp.test_utils import make_mocked_request

    rules = access.Access("0.0.0.0", 8700, TOKEN)

    def called(name: str, *, token: str | None = TOKEN) -> str | None:
        rules.token = token
        transport = mock.Mock()
        transport.get_extra_info.return_value = ("192.168.1.5", 8700)
        return rules.host_of(make_mocked_request("GET", "/", headers={"Host": name}, transport=transport))

    assert called("192.168.1.5:8700") == "192.168.1.5:8700"
    assert called("localhost:8700") is not None
    for name in ("192.168.1.6:8700", "evil.example", "0.0.0.0:8700", "192.168.1.5.evil.example", "3232235781"):
        assert called(name) is None
    assert called("192.168.1.5:8700", token=None) is None


async def test_what_was_refused_is_said_in_json_to_nobody(rig: Rig) -> None:
    """A script cannot read why: the reasons are short, plain, and name nothing that was sent."""
    answer = await rig.ask("/<script>alert(1)</script>", headers=[("Origin", "http://<script>.example")])
    assert answer.headers["content-type"].startswith("text/plain")
    assert b"<script>" not in answer.body
    with pytest.raises(ValueError, match="Expecting value"):
        json.loads(answer.body)
