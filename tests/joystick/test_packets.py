"""What a page's WebSocket may say, message by message."""

from __future__ import annotations

import contextlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elib.errors import ArgumentError
from elib.joystick.packets import LONGEST, Conversation, client_of

PAGE = "11111111-2222-4333-8444-555555555555"
OTHER = "99999999-2222-4333-8444-555555555555"
LISTENER = "aaaaaaaa-2222-4333-8444-555555555555"


def event(name: str = "event", **changes: object) -> str:
    about = {"client_id": PAGE, "id": 7, "listener_id": LISTENER, "args": ['{"x":1}', None]}
    return f"42{json.dumps([name, about | changes])}"


def conversation(*, enters: bool = True) -> Conversation:
    found = Conversation(PAGE, lambda client, element, listener: element == 7)
    assert not enters or found.receives("40")
    return found


def query(**changes: str | None) -> bytes:
    pairs: dict[str, str | None] = {
        "client_id": PAGE,
        "next_message_id": "0",
        "implicit_handshake": "true",
        "document_id": OTHER,
        "tab_id": LISTENER,
        "old_tab_id": "null",
        "EIO": "4",
        "transport": "websocket",
    }
    return "&".join(f"{key}={value}" for key, value in (pairs | changes).items() if value is not None).encode()


def test_what_a_page_of_nicegui_says_may_pass() -> None:
    page = conversation(enters=False)
    said = [
        "40",
        event(),
        event(args=[]),
        event("ack", next_message_id=12),
        event("javascript_response", request_id=OTHER, result={"any": ["thing"]}),
        f'421["handshake",{{"client_id":"{PAGE}","next_message_id":3,"implicit_handshake":false,'
        f'"document_id":"{OTHER}","tab_id":"{LISTENER}","old_tab_id":null}}]',
        "41",
        "1",
    ]
    assert [page.receives(text) for text in said] == [True] * len(said)


def test_a_ping_is_answered_once() -> None:
    page = conversation()
    with pytest.raises(ArgumentError):
        page.receives("3")
    page.sends("2")
    assert page.receives("3")
    with pytest.raises(ArgumentError):
        page.receives("3")


def test_a_listener_that_is_no_more_is_not_told() -> None:
    assert not conversation().receives(event(id=8))


def test_a_page_does_not_write_on_the_terminal() -> None:
    assert not conversation().receives(event("log", level="error", message="\x1b[2J you have been robbed"))


MALFORMED = {
    "nothing": "",
    "a ping": "2",
    "a probe": "2probe",
    "an upgrade": "5",
    "a noop": "6",
    "a second entrance": "40",
    "an entrance with a token": '40{"token":1}',
    "another namespace": "40/admin,",
    "an answer to what was not asked": "430[]",
    "a binary event": '451-["event",{"_placeholder":true,"num":0}]',
    "base64": "bAAAA",
    "a number beyond all": "42" + "9" * 200 + "[]",
    "no event": "42",
    "no list": '42{"event":1}',
    "an empty list": "42[]",
    "half of it": event()[:-1],
    "a name alone": '42["event"]',
    "three parts": '42["event",{},{}]',
    "an event of ours": event("connect"),
    "an event to all": event("disconnect"),
    "no number": '42["event",NaN]',
    "deep brackets": "42" + "[" * 5000,
    "another page": event(client_id=OTHER),
    "no page": event(client_id=None),
    "a list for a page": event(client_id=[PAGE]),
    "an element by name": event(id="7"),
    "an element by truth": event(id=True),
    "an element below all": event(id=-1),
    "an element of digits": event(id=10**40),
    "a listener of none": event(listener_id="__class__"),
    "a listener in a list": event(listener_id=[LISTENER]),
    "no arguments": event(args=None),
    "arguments by name": event(args={"0": "1"}),
    "bare arguments": event(args=[1]),
    "arguments that are no JSON": event(args=["{"]),
    "deep arguments": event(args=["[" * 9000]),
    "many arguments": event(args=["1"] * 17),
    "an ack of nothing": event("ack"),
    "an ack of words": event("ack", next_message_id="12"),
    "an ack below all": event("ack", next_message_id=-1),
    "an answer to a class": event("javascript_response", request_id="__init__"),
    "a handshake of half": f'42["handshake",{{"client_id":"{PAGE}"}}]',
    "a handshake with more": event("handshake", tab_id=LISTENER, document_id=OTHER, next_message_id=1, more=1),
    "a handshake of lists": event("handshake", tab_id=[], document_id=[], next_message_id=1),
    "too much": event(args=[json.dumps("x" * LONGEST)]),
}


@pytest.mark.parametrize("text", MALFORMED.values(), ids=MALFORMED.keys())
def test_what_no_page_says_is_refused(text: str) -> None:
    with pytest.raises(ArgumentError):
        conversation().receives(text)


def test_nothing_is_said_before_the_entrance() -> None:
    with pytest.raises(ArgumentError):
        conversation(enters=False).receives(event())


@given(st.text() | st.from_regex(r"4[0-6][0-9]{0,3}[\[{].{0,40}", fullmatch=True))
def test_whatever_comes_passes_or_is_refused_and_nothing_else_happens(text: str) -> None:
    with contextlib.suppress(ArgumentError):
        conversation().receives(text)


@given(st.recursive(st.none() | st.booleans() | st.integers() | st.text(max_size=9), st.lists, max_leaves=9))
def test_any_json_for_an_event_passes_or_is_refused(value: object) -> None:
    for key in ("client_id", "id", "listener_id", "args"):
        try:
            conversation().receives(event(**{key: value}))
        except ArgumentError:
            continue
        assert key == "args" or (key == "id" and isinstance(value, int))


def test_the_page_is_known_by_the_address_of_its_socket() -> None:
    assert client_of(query()) == PAGE
    assert client_of(query(implicit_handshake=None, old_tab_id=OTHER, t="abc")) == PAGE


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"EIO=4&transport=websocket",
        query(EIO="3"),
        query(transport="polling"),
        query(client_id=None),
        query(client_id="../../etc/passwd"),
        query(next_message_id="one"),
        query(next_message_id="9" * 40),
        query(tab_id="a" * 5000),
        query(document_id="'; drop"),
        query(sid="0123456789"),
        query(j="0"),
        query() + b"&client_id=" + OTHER.encode(),
        query() + b"&x=" * 100,
        b"\xff\xfe",
    ],
)
def test_a_socket_that_no_page_would_open_is_nobodys(text: bytes) -> None:
    with pytest.raises(ArgumentError):
        client_of(text)
