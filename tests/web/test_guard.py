"""Attacks on the panel's port, each over a socket of its own, and each refused."""

from __future__ import annotations

import asyncio
import json
import logging
import re
from collections.abc import Iterator

import pytest

pytest.importorskip("nicegui", reason="the extra web is not installed: pip install '.[web]'")

from elib.web.guard import Surroundings
from guard_rig import DOCUMENT, PAGE, PATIENCE, SOCKET, Rig, click, guarded
from websockets.exceptions import ConnectionClosed, InvalidStatus

from elib.web import access, bounded, guard, packets

TOKEN = "right-token"


@pytest.fixture(autouse=True)
def nothing_is_said_on_the_terminal(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """Whatever strangers do, it is not worth a line, let alone a traceback."""
    yield
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.ERROR] == []


async def refused(rig: Rig, path: str = SOCKET, **how: str | None) -> int:
    """Try to open a WebSocket and return the status of the refusal."""
    with pytest.raises(InvalidStatus) as caught:
        async with rig.socket(path, **how):
            pass
    return caught.value.response.status_code


async def thrown_out(rig: Rig, *messages: str | bytes, entering: bool = True) -> int:
    """Say something on a WebSocket and return the code with which it is closed."""
    with pytest.raises(ConnectionClosed) as caught:
        async with rig.socket() as socket, asyncio.timeout(PATIENCE):
            for message in ("40", *messages) if entering else messages:
                await socket.send(message)
            await socket.recv()
    await asyncio.wait_for(rig.behind.gone.wait(), PATIENCE)
    return caught.value.rcvd.code if caught.value.rcvd else 1006


# -- requests --


async def test_a_page_comes_with_orders_to_the_browser_and_its_own_scripts_marked() -> None:
    async with guarded() as rig:
        first, second = await rig.ask(), await rig.ask()
    marks = re.findall(rb'<script nonce="([\w-]{20,})"', first.body)
    assert len(marks) == 2
    assert re.sub(rb' nonce="[^"]*"', b"", first.body) == DOCUMENT
    assert int(first.headers["content-length"]) == len(first.body)
    policy = first.headers["content-security-policy"]
    assert f"script-src 'self' 'nonce-{marks[0].decode().lower()}' 'unsafe-eval';" in policy
    assert f"connect-src 'self' ws://{rig.name};" in policy
    for order in ("default-src 'self'", "object-src 'none'", "base-uri 'none'", "frame-ancestors 'none'"):
        assert order in policy
    assert "unsafe-inline" not in policy.partition("script-src")[2].partition(";")[0]
    assert first.headers["x-content-type-options"] == "nosniff"
    assert first.headers["x-frame-options"] == "deny"
    assert "server" not in first.headers
    assert marks[0] not in second.body


@pytest.mark.parametrize("host", ["localhost:{port}", "127.0.0.1", "LOCALHOST:9999", "[::1]:{port}"])
async def test_the_panel_answers_to_its_own_names_also_at_the_end_of_a_tunnel(host: str) -> None:
    async with guarded() as rig:
        assert (await rig.ask(host=host.format(port=rig.port))).status == 200


@pytest.mark.parametrize(
    "host",
    [
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
    ],
)
async def test_a_name_that_somebody_made_lead_here_is_refused(host: str) -> None:
    async with guarded() as rig:
        assert (await rig.ask(host=host.format(port=rig.port))).status in (400, 403)
        request = SOCKET + " HTTP/1.1\r\nHost: " + host.format(port=rig.port)
        upgrade = "\r\nOrigin: http://evil.example\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        keys = "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        assert b" 101 " not in await rig.raw(f"GET {request}{upgrade}{keys}".encode())
        assert rig.behind.seen == []


async def test_a_request_without_a_name_or_with_two_is_refused() -> None:
    async with guarded() as rig:
        assert (await rig.ask(host=None)).status == 400
        assert (await rig.ask(headers=[("Host", "evil.example")])).status == 400
        assert rig.behind.seen == []


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


@pytest.mark.parametrize("headers", FOREIGN.values(), ids=FOREIGN.keys())
async def test_another_site_gets_nothing(headers: list[tuple[str, str]]) -> None:
    async with guarded() as rig:
        headers = [(name, value.format(port=rig.port)) for name, value in headers]
        assert (await rig.ask(headers=headers)).status == 403
        assert rig.behind.seen == []


async def test_a_person_may_follow_a_link_to_the_panel() -> None:
    visit = [("Sec-Fetch-Site", "cross-site"), ("Sec-Fetch-Mode", "navigate"), ("Sec-Fetch-Dest", "document")]
    async with guarded() as rig:
        assert (await rig.ask(headers=visit)).status == 200
        assert (
            await rig.ask(headers=[("Origin", f"http://{rig.name}"), ("Sec-Fetch-Site", "same-origin")])
        ).status == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT", "MKCOL"])
async def test_nothing_can_be_sent_to_the_panel_by_a_request(method: str) -> None:
    async with guarded() as rig:
        for headers in ([], [("Origin", f"http://{rig.name}")]):
            assert (await rig.ask(method=method, headers=headers)).status in (403, 405)
        assert rig.behind.seen == []


async def test_a_request_for_a_page_has_no_body() -> None:
    async with guarded() as rig:
        assert (await rig.ask(body=b"x")).status == 400
        assert (await rig.ask(headers=[("Transfer-Encoding", "chunked")])).status == 400
        assert rig.behind.seen == []


@pytest.mark.parametrize(
    "path",
    [
        "/../../etc/passwd",
        "/_nicegui/3.18.0/static/../../../../../../../../etc/passwd",
        "/_nicegui/3.18.0/static/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd",
        "/_nicegui/3.18.0/static/..%2f..%2f..%2f..%2fetc/passwd",
        "/_nicegui/3.18.0/static/..%5c..%5cwindows%5cwin.ini",
        "/_nicegui/3.18.0/static/%00",
        "/_nicegui/3.18.0/libraries/nicegui.js%00.map",
        "/_nicegui/3.18.0/static/./nicegui.js",
        "/%0d%0aSet-Cookie:%20a=b",
        "/%1b[2J",
        "/\xff",
        "http://evil.example/",
        "*",
        "/" + "a" * 2000,
        "/?" + "a" * 2000,
    ],
)
async def test_a_path_that_no_page_has_is_refused(path: str) -> None:
    async with guarded() as rig:
        answer = await rig.raw(f"GET {path} HTTP/1.1\r\nHost: {rig.name}\r\n\r\n".encode("latin-1"))
        assert answer == b"" or parse_status(answer) == 400
        assert rig.behind.seen == []


def parse_status(answer: bytes) -> int:
    return int(answer.split()[1])


async def test_what_no_page_answers_to_is_not_asked() -> None:
    async with guarded(around=Surroundings(is_route=lambda scope: scope["path"] == "/")) as rig:
        assert (await rig.ask("/admin")).status == 404
        assert (await rig.ask("/_nicegui_ws/socket.io/?EIO=4&transport=polling")).status == 404
        assert (await rig.ask("/")).status == 200
        assert len(rig.behind.seen) == 1


async def test_what_a_proxy_would_say_is_not_believed() -> None:
    lies = [("X-Forwarded-Prefix", '"><script>'), ("X-Forwarded-For", "127.0.0.1"), ("Forwarded", "for=1.1.1.1")]
    async with guarded() as rig:
        await rig.ask(headers=lies)
        (scope,) = rig.behind.seen
    assert {name for name, _ in scope["headers"]} == {b"host", b"connection"}


async def test_pages_are_not_opened_faster_or_in_greater_number_than_people_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "OPENINGS_AT_ONCE", 3.0)
    monkeypatch.setattr(guard, "OPENINGS", 0.001)
    async with guarded() as rig:
        assert [(await rig.ask()).status for _ in range(4)] == [200, 200, 200, 503]
    async with guarded(around=Surroundings(pages=lambda: 64)) as rig:
        assert (await rig.ask()).status == 503
        assert (await rig.ask("/_nicegui/3.18.0/static/nicegui.js")).status == 200


@pytest.mark.parametrize(
    "data",
    [
        b"\x00" * 100,
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 5000,
        b"GET /" + b"a" * 200_000,
    ],
)
async def test_what_is_no_request_ends_the_connection(data: bytes) -> None:
    async with guarded() as rig:
        answer = await rig.raw(data)
        assert answer == b"" or parse_status(answer) in (400, 403)
        assert (await rig.ask()).status == 200


@pytest.mark.parametrize("data", [b"", b"G", b"GET / HTTP/1.1\r\nHost: a\r\n"])
async def test_a_request_that_does_not_come_is_not_waited_for(data: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounded.BoundedHttp, "patience", 0.1)
    async with guarded() as rig:
        assert await rig.raw(data, ends=False) == b""


async def test_a_second_request_that_does_not_come_is_not_waited_for_either(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounded.BoundedHttp, "patience", 0.1)
    async with guarded() as rig:
        whole = f"GET / HTTP/1.1\r\nHost: {rig.name}\r\n\r\n".encode()
        answer = await rig.raw(whole + b"GET /again HT", ends=False)
        assert answer.count(b"HTTP/1.1 200") == 1


async def test_one_address_does_not_take_all_connections(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounded, "MOST_OF_ONE", 3)
    async with guarded() as rig:
        held = [await asyncio.open_connection(rig.host, rig.port) for _ in range(3)]
        assert await rig.raw(b"", ends=False) == b""
        for _, writer in held:
            writer.close()
            await writer.wait_closed()


# -- WebSockets --


async def test_a_page_talks_with_the_panel() -> None:
    async with guarded() as rig:
        rig.behind.asked.append("2")
        async with rig.socket() as socket:
            assert await socket.recv() == "2"
            for text in ("3", "40", click(), click(args=["2"])):
                await socket.send(text)
        await asyncio.wait_for(rig.behind.gone.wait(), PATIENCE)
        assert rig.behind.heard == ["3", "40", click(), click(args=["2"])]


@pytest.mark.parametrize(
    "origin",
    [
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
    ],
)
async def test_no_other_sites_page_opens_a_socket(origin: str | None) -> None:
    async with guarded() as rig:
        assert await refused(rig, origin=None if origin is None else origin.format(port=rig.port)) == 403
        assert rig.behind.left == []


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/_nicegui_ws/",
        "/_nicegui_ws/socket.io/",
        SOCKET.replace("EIO=4", "EIO=3"),
        SOCKET.replace("transport=websocket", "transport=polling"),
        SOCKET.replace(PAGE, "../../etc/passwd"),
        f"{SOCKET}&sid=abc",
        f"{SOCKET}&client_id={PAGE}",
        SOCKET.replace("next_message_id=0", "next_message_id=x"),
        SOCKET.replace("/socket.io/", "/socket.io/%2e%2e/socket.io/"),
    ],
)
async def test_a_socket_that_no_page_opens_is_refused(path: str) -> None:
    async with guarded() as rig:
        assert await refused(rig, path) == 403
        assert rig.behind.left == []


@pytest.mark.parametrize(
    "message",
    [
        "",
        "2probe",
        "40/admin,",
        "42[",
        "451-[{}]",
        click(client_id=PAGE[::-1]),
        click(id="__class__"),
        "bAAAA",
        b"\x00",
    ],
)
async def test_a_malformed_message_throws_the_page_out_and_reaches_nobody(message: str | bytes) -> None:
    async with guarded() as rig:
        assert await thrown_out(rig, message, click()) == 1008
        assert rig.behind.heard == ["40"]
        assert rig.behind.left == [1008]


async def test_nobody_speaks_before_entering() -> None:
    async with guarded() as rig:
        assert await thrown_out(rig, click(), entering=False) == 1008
        assert rig.behind.heard == []


@pytest.mark.parametrize(("characters", "code"), [(packets.LONGEST + 1, 1008), (bounded.LONGEST_BYTES + 1, 1009)])
async def test_an_oversized_message_throws_the_page_out(characters: int, code: int) -> None:
    async with guarded() as rig:
        assert await thrown_out(rig, "4" * characters) == code
        assert {*rig.behind.heard} <= {"40"}


async def test_a_page_that_sends_too_fast_is_thrown_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "RATE", 0.001)
    async with guarded() as rig:
        assert await thrown_out(rig, *[click()] * 300) == 1008
        assert len(rig.behind.heard) == guard.BURST
        assert rig.behind.left == [1008]


async def test_a_page_that_drives_for_long_is_not_too_fast(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    bucket = access.Bucket(guard.RATE, guard.BURST, lambda: clock[0])
    for _ in range(60 * 60):  # a hand that drags for a minute, sixty times a second
        clock[0] += 1 / 60
        assert bucket.take()


async def test_an_event_for_nobody_is_dropped_and_the_page_stays() -> None:
    known = Surroundings(is_known=lambda client, element, listener: (client, element) == (PAGE, 7))
    log = f'42["log",{{"client_id":"{PAGE}","level":"error","message":"\\u001b[2J"}}]'
    async with guarded(around=known) as rig:
        async with rig.socket() as socket:
            for text in ("40", click(id=8), log, click(id=7)):
                await socket.send(text)
        await asyncio.wait_for(rig.behind.gone.wait(), PATIENCE)
        assert rig.behind.heard == ["40", click(id=7)]


async def test_text_that_is_none_throws_the_page_out() -> None:
    async with guarded() as rig, rig.socket() as socket:
        socket.transport.write(b"\x81\x82\x00\x00\x00\x00\xff\xfe")  # a masked text frame of two wrong bytes
        with pytest.raises(ConnectionClosed):
            await asyncio.wait_for(socket.recv(), PATIENCE)
        assert rig.behind.heard == []


@pytest.mark.parametrize(
    "frame",
    [
        b"\x00\x80\x00\x00\x00\x00",  # a part of a message, with nothing in it
        b"\x89\x80\x00\x00\x00\x00",  # a ping
        b"\x8a\x80\x00\x00\x00\x00",  # an answer to none
    ],
)
async def test_a_flood_of_frames_that_are_no_messages_throws_the_page_out(frame: bytes) -> None:
    first = b"\x01\x80\x00\x00\x00\x00" if frame[0] == 0 else b""
    async with guarded() as rig, rig.socket() as socket:
        # Ten times what is allowed at once: even a busy machine does not take it so slowly that it is allowed.
        socket.transport.write(first + frame * 430_000)
        with pytest.raises(ConnectionClosed):
            await asyncio.wait_for(socket.recv(), PATIENCE)
        assert rig.behind.heard == []
        assert (await rig.ask()).status == 200


async def test_there_are_no_more_sockets_than_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "MOST_PAGES", 2)
    async with guarded() as rig:
        async with rig.socket(), rig.socket():
            assert await refused(rig) == 403
        while len(rig.behind.left) < 2:  # noqa: ASYNC110  # both have been told
            await asyncio.sleep(0.01)
        async with rig.socket() as socket:
            await socket.send("40")


# -- the token --


def form(token: str) -> bytes:
    return f"token={token}".encode()


async def log_in(rig: Rig, token: str, **headers: str) -> tuple[int, str]:
    """Send the login form as a browser does, and return the status and the cookie."""
    sent = {"Origin": f"http://{rig.name}", "Content-Type": "application/x-www-form-urlencoded"} | headers
    answer = await rig.ask("/login", method="POST", body=form(token), headers=sent.items())
    return answer.status, answer.headers.get("set-cookie", "")


async def test_who_has_shown_no_token_sees_nothing_but_the_question_for_it() -> None:
    async with guarded(token=TOKEN) as rig:
        for path in ("/", "/login", "/_nicegui/3.18.0/static/nicegui.js", f"/?token={TOKEN}", f"/login?token={TOKEN}"):
            answer = await rig.ask(path)
            assert answer.status == (200 if path.startswith("/login") else 401)
            assert b'name="token"' in answer.body
            assert "set-cookie" not in answer.headers
            assert TOKEN.encode() not in answer.body
        assert await refused(rig) == 403
        assert await refused(rig, f"{SOCKET}&token={TOKEN}") == 403
        assert (rig.behind.seen, rig.behind.left) == ([], [])


async def test_the_right_token_opens_the_panel_and_its_socket() -> None:
    async with guarded(token=TOKEN) as rig:
        status, cookie = await log_in(rig, TOKEN)
        assert status == 303
        assert cookie.split("; ")[1:] == ["Path=/", "HttpOnly", "SameSite=Strict"]
        assert TOKEN not in cookie
        shown = cookie.partition(";")[0]
        assert (await rig.ask(headers=[("Cookie", f"other=1; {shown}")])).status == 200
        async with rig.socket(cookie=shown) as socket:
            await socket.send("40")


async def test_a_wrong_token_opens_nothing_and_many_of_them_are_not_even_read() -> None:
    async with guarded(token=TOKEN) as rig:
        wrong = ["", TOKEN[:-1], TOKEN + "x", f"{TOKEN}&token={TOKEN}", "%ff%00"]
        assert [await log_in(rig, token) for token in wrong] == [(403, "")] * 5
        assert await log_in(rig, TOKEN) == (429, "")
        assert (await rig.ask()).status == 401


@pytest.mark.parametrize("cookie", ["{name}=", "{name}=x", "{name}=" + TOKEN, "{name}", "{own}; {own}", "a={value}"])
async def test_a_made_up_cookie_opens_nothing(cookie: str) -> None:
    async with guarded(token=TOKEN) as rig:
        own = (await log_in(rig, TOKEN))[1].partition(";")[0]
        name, _, value = own.partition("=")
        made_up = cookie.format(own=own, name=name, value=value)
        assert (await rig.ask(headers=[("Cookie", made_up)])).status == 401
        assert await refused(rig, cookie=made_up) == 403


async def test_another_sites_page_cannot_log_in_nor_use_that_somebody_has() -> None:
    async with guarded(token=TOKEN) as rig:
        for origin in ("http://evil.example", "null", f"http://localhost:{rig.port}"):
            assert await log_in(rig, TOKEN, Origin=origin) == (403, "")
        own = (await log_in(rig, TOKEN))[1].partition(";")[0]
        assert await refused(rig, origin="http://evil.example", cookie=own) == 403
        answer = await rig.ask(headers=[("Cookie", own), ("Origin", "http://evil.example")])
        assert answer.status == 403
        assert rig.behind.seen == []


async def test_a_login_form_is_short_and_comes_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(access, "FORM_TIME", 0.1)
    async with guarded(token=TOKEN) as rig:
        assert (await log_in(rig, TOKEN + "&a=" + "a" * 1000))[0] == 403
        head = f"POST /login HTTP/1.1\r\nHost: {rig.name}\r\nOrigin: http://{rig.name}\r\nContent-Length: 99\r\n\r\n"
        assert parse_status(await rig.raw(head.encode() + b"token=")) == 403


async def test_secrets_are_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[bytes] = []

    def compare(shown: bytes, secret: bytes) -> bool:
        compared.append(shown)
        return shown == secret

    monkeypatch.setattr(access, "compare_digest", compare)
    async with guarded(token=TOKEN) as rig:
        await log_in(rig, "guess")
        cookie = (await log_in(rig, TOKEN))[1].partition(";")[0]
        await rig.ask(headers=[("Cookie", cookie)])
    assert compared == [b"guess", TOKEN.encode(), cookie.partition("=")[2].encode()]


async def test_a_shared_panel_answers_to_the_address_at_which_it_is_reached_and_to_no_name_of_somebody() -> None:
    rules = access.Access("0.0.0.0", 8700, TOKEN)

    def called(name: str, *, token: str | None = TOKEN) -> str | None:
        rules.token = token
        scope = {"headers": [(b"host", name.encode())], "server": ("192.168.1.5", 8700)}
        return rules.host_of(scope)

    assert called("192.168.1.5:8700") == "192.168.1.5:8700"
    assert called("localhost:8700") is not None
    for name in ("192.168.1.6:8700", "evil.example", "0.0.0.0:8700", "192.168.1.5.evil.example", "3232235781"):
        assert called(name) is None
    assert called("192.168.1.5:8700", token=None) is None


async def test_what_was_refused_is_said_in_json_to_nobody() -> None:
    """A script cannot read why: the reasons are short, plain, and name nothing that was sent."""
    async with guarded() as rig:
        answer = await rig.ask("/<script>alert(1)</script>", headers=[("Origin", "http://<script>.example")])
        assert answer.headers["content-type"].startswith("text/plain")
        assert b"<script>" not in answer.body
        with pytest.raises(ValueError, match="Expecting value"):
            json.loads(answer.body)
