"""What a page may say, message by message."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import AsyncIterator
from unittest import mock

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from local_network import LocalLoop

from elib.base.errors import ArgumentError
from elib.panel.events import KINDS
from elib.panel.panel import Panel
from elib.panel.recents import RecentRobots
from elib.panel.server import messages
from elib.panel.server.conversation import MAX_WAITING
from elib.panel.server.messages import MESSAGES, decode
from elib.panel.server.page import Page, RobotStream
from elib.records import timeline
from shared import needs_page, until

pytestmark = needs_page

# clock: simulated
LOOP = LocalLoop
TAGS = list(MESSAGES)
FIELDS = sorted({field for kind in MESSAGES.values() for field in kind.__struct_fields__})
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20) | st.sampled_from(["1", "2", *TAGS]),
    lambda values: st.lists(values, max_size=4) | st.dictionaries(st.text(max_size=9), values, max_size=4),
    max_leaves=12,
)
SAID = st.builds(
    lambda tag, values: json.dumps({"do": tag} | values),
    st.sampled_from(TAGS),
    st.dictionaries(st.sampled_from(FIELDS), JSON, max_size=4),
)
BROKEN = st.from_regex(r'[\[{"]{0,3}"do" ?: ?"(stop|steer|world)".{0,40}', fullmatch=True)


def test_every_message_has_a_name_and_says_in_a_sentence_what_it_does() -> None:
    for name, kind in MESSAGES.items():
        assert kind.__struct_config__.tag == name
        assert (kind.__doc__ or "").strip().endswith("."), kind


def test_a_message_takes_no_field_beside_its_own() -> None:
    for kind in MESSAGES.values():
        about = {"do": kind.__struct_config__.tag, "page": "page-0"}
        _, found = decode(json.dumps(about | dict.fromkeys(kind.__struct_fields__, 1)))
        assert isinstance(found, ArgumentError), found


@pytest.mark.parametrize("name", [None, 7, "a" * 1000])
def test_a_behaviour_is_named_by_a_short_text(name: object) -> None:
    assert isinstance(decode(json.dumps({"do": "behave", "robots": ["1"], "name": name}))[1], ArgumentError)


@given(st.text() | BROKEN)
def test_text_that_is_no_message_is_refused_and_nothing_else_happens(text: str) -> None:
    assert isinstance(decode(text)[1], ArgumentError)


@given(SAID)
def test_whatever_is_said_is_a_message_or_refused(text: str) -> None:
    _, found = decode(text)
    if isinstance(found, ArgumentError):
        return
    assert type(found) in MESSAGES.values()
    for name in found.__struct_fields__:
        value = getattr(found, name)
        assert not isinstance(value, str) or len(value) <= 500
        assert not isinstance(value, float) or abs(value) < float("inf")


def test_every_kind_of_line_that_a_recording_can_have_has_a_title() -> None:
    assert set(timeline.KINDS) <= set(KINDS)
    assert all(KINDS.values())


class Ears:
    """A connection that keeps what it is told."""

    unread = 0

    def __init__(self) -> None:
        self.told: list[dict] = []
        self.closed_for = 0

    async def send(self, data: bytes, *, is_text: bool) -> None:
        """Keep a text."""
        if is_text:
            self.told.append(json.loads(data))

    async def close(self, code: int, reason: str) -> None:
        """Keep why it is ended."""
        self.closed_for = code

    def hear(self, text: str) -> str:
        """Let the page hear a text, which waits for nothing; return why it is to be closed."""
        hearing = self.page.hear(text)
        with pytest.raises(StopIteration) as ended:
            hearing.send(None)
        return ended.value.value

    def answer(self, number: int) -> dict | None:
        """Return the answer to a request, if it has come."""
        return next((each for each in self.told if each["type"] == "answer" and each["id"] == number), None)


@pytest.fixture
async def ears(tmp_path) -> AsyncIterator[Ears]:
    """Open a page on two virtual robots."""
    panel = Panel(folder=tmp_path, recents=RecentRobots(tmp_path / "recents.json"))
    for key in (panel.add("sim://"), panel.add("sim://line")):
        panel.connect(key)
    ears = Ears()
    ears.page = Page(panel, decode, ears)
    yield ears
    await ears.page.close()
    await panel.close()


async def test_whatever_text_comes_is_carried_out_or_ends_the_page_and_nothing_else_happens(
    ears: Ears, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(messages.discovery, "find", mock.AsyncMock(return_value=[]))
    complaints: list[dict] = []
    asyncio.get_running_loop().set_exception_handler(lambda loop, context: complaints.append(context))
    ends = {"", "not a message of the page"}

    @settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))
    @given(SAID | st.text() | BROKEN)
    def say(text: str) -> None:
        assert ears.hear(text) in ends

    say()
    await asyncio.sleep(1)
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING] == []
    assert complaints == []
    assert set(ears.page.panel.slots) <= {"1", "2"}


@pytest.mark.parametrize("is_slow", [False, True])
async def test_a_mistake_of_the_program_is_answered_and_written_down_once(
    is_slow: bool, ears: Ears, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def later() -> None:
        raise KeyError("slow")

    def fail(page: Page) -> object:
        if is_slow:
            return later()
        raise KeyError("fast")

    monkeypatch.setattr(MESSAGES["files"], "act", staticmethod(fail))
    assert ears.hear('{"do":"files","id":7}') == ""
    await until(lambda: ears.answer(7))
    assert ears.answer(7)["ok"] is False
    assert ears.answer(7)["error"]["message"] == "the program made a mistake"
    assert [record.getMessage() for record in caplog.records] == ["a request of a page failed"]
    assert ears.hear('{"do":"stop","id":8}') == ""
    await until(lambda: ears.answer(8))


async def test_a_result_that_cannot_be_sent_is_a_mistake_of_the_program(
    ears: Ears, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(MESSAGES["files"], "act", staticmethod(lambda page: object()))
    ears.hear('{"do":"files","id":7}')
    await until(lambda: ears.answer(7))
    assert ears.answer(7)["ok"] is False
    assert [record.getMessage() for record in caplog.records] == ["a request of a page failed"]


async def test_updates_that_fail_end_the_page_and_are_written_down_once(
    ears: Ears, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RobotStream, "_next", mock.Mock(side_effect=KeyError("update")))
    ears.hear('{"do":"subscribe","what":"robot","of":"1"}')
    await until(lambda: ears.closed_for)
    assert ears.closed_for == 1011
    assert [record.getMessage() for record in caplog.records] == ["a page failed"]


async def test_too_many_requests_are_refused_but_never_a_stop(ears: Ears, monkeypatch: pytest.MonkeyPatch) -> None:
    waiting = asyncio.Event()
    stopped: list[str] = []
    monkeypatch.setattr(Panel, "slot", lambda self, key: mock.Mock(command=lambda *_, **__: waiting.wait()))
    monkeypatch.setattr(Panel, "stop_all", lambda self: stopped.append("all"))
    for number in range(1, 50):
        assert ears.hear(json.dumps({"do": "command", "robot": "1", "name": "version", "id": number})) == ""
        await asyncio.sleep(0)
    assert ears.hear('{"do":"stop","id":99}') == ""
    await until(lambda: ears.answer(99))
    assert stopped == ["all"]
    assert ears.answer(1) is None
    assert "no more can" in ears.answer(49)["error"]["message"]
    assert len(ears.page._requests) <= MAX_WAITING


async def test_requests_of_a_page_that_is_closed_at_once_end_and_nothing_is_written_down(
    ears: Ears, caplog: pytest.LogCaptureFixture, recwarn: pytest.WarningsRecorder
) -> None:
    for text in ('{"do":"command","robot":"1","name":"version","id":1}', '{"do":"remove","robot":"2","id":2}'):
        assert ears.hear(text) == ""
    await ears.page.close()
    await until(lambda: not ears.page.panel._parting)
    assert ears.answer(1)["error"]["kind"] == "LinkClosed"
    assert [*ears.page.panel.slots] == ["1"]
    assert caplog.records == []
    assert [str(each.message) for each in recwarn.list] == []
