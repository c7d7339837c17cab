"""What a page and a program have in common: messages both ways, an answer to each request, and limits for both.

A message is a JSON object such as ``{"do": "stop", "id": 7}``. With an ``id`` it is answered once, by ``{"type":
"answer", "id": 7, "ok": true, "result": ...}``, or with ``"ok": false`` and an ``error`` that has a ``kind``, a
``message`` and a ``hint``. A request without a number is told of its failure alone.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import json
import logging
import re
import secrets
from collections.abc import Awaitable, Callable, Iterable
from inspect import Parameter
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Protocol,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec
from msgspec import Meta, Struct
from msgspec.json import Decoder

from elib.base.errors import ArgumentError, ElibError, LinkClosed, ReplyTimeout
from elib.base.tasks import Tasks
from elib.simulator.emulator.control_server import time_factor

if TYPE_CHECKING:
    from elib.panel.panel import Panel
    from elib.panel.slot import Slot

MAX_MESSAGE = 8192
"""Bytes of a message: the longest useful one has some hundred."""
MAX_ID = 1 << 53
"""Of a request: a program in JavaScript can tell all whole numbers up to here apart."""
MAX_WAITING = 32
"""Requests of one caller that wait for an answer at the same time."""
MAX_UNREAD = 256 * 1024
"""Bytes of answers that a caller may leave unread."""
ANSWERS, ANSWERS_AT_ONCE = 500.0, 1000.0
"""Answers to one caller per second for long, and at once; later ones wait. A robot on a serial line gives fewer."""
GREETING = "say hello first, with the token"

F = TypeVar("F", bound=Callable[..., Any])
Json = Any
Result = Awaitable[object] | object
Id = Annotated[int, Meta(description="Number of the request.")]
Number = Annotated[int, Meta(ge=0, le=MAX_ID, description="Number that the answer repeats; 0 asks for no answer.")]
Text = Annotated[str, Meta(description="What happened.")]


class Message(Struct, tag_field="do", forbid_unknown_fields=True, kw_only=True):
    """What a caller says: a class for each message, with its fields."""

    is_greeting: ClassVar[bool] = False
    """Whether it may be said before the token was shown."""
    needs: ClassVar[str] = ""
    """What the page that says it must be able to do, a field of :class:`~elib.panel.panel.Can`; empty for nothing."""
    act: ClassVar[Callable[..., Result]]
    """Does it, for the caller and with the fields; raises ElibError if it cannot be done."""
    answers: ClassVar[object] = None
    """The type of the result."""

    id: Number = 0  # number that the answer repeats; 0 asks for no answer

    def carry_out(self, caller: Any) -> Result:
        """Do it for *caller*, and return the result, or an awaitable of it; an ElibError says why it cannot be done."""
        return type(self).act(caller, **{name: getattr(self, name) for name in self.__struct_fields__ if name != "id"})


def message_of(
    act: Callable[..., Result],
    name: str,
    fields: Iterable[Parameter],
    doc: str | None,
    **more: object,
) -> type[Message]:
    """Return the class of the messages that a function carries out, whose arguments are their fields."""
    found = msgspec.defstruct(
        "".join(part.capitalize() for part in name.split("_")),
        [(each.name, each.annotation, *(() if each.default is each.empty else (each.default,))) for each in fields],
        bases=(Message,),
        namespace={"act": staticmethod(act), "__doc__": doc, **more},
        module=act.__module__,
        tag=name,
        kw_only=True,
    )
    return cast("type[Message]", found)


def _awaited(hint: object) -> object:
    """Return the type of what is there in the end."""
    return get_args(hint)[0] if get_origin(hint) is Awaitable else hint


class Table(dict[str, type[Message]]):
    """The messages that one kind of caller may say, by their names."""

    def request(self, needs: str = "", *, name: str = "", **more: Any) -> Callable[[F], F]:
        """Return a decorator by which a function or a method becomes a message: its name, arguments and docstring."""

        def add(act: F) -> F:
            hints = get_type_hints(act, include_extras=True)
            _, *given = inspect.signature(act).parameters.values()
            fields = [each.replace(annotation=hints[each.name]) for each in given]
            more.setdefault("answers", _awaited(hints["return"]))
            self.put(message_of(act, name or act.__name__, fields, act.__doc__, needs=needs, **more))
            return act

        return add

    def put(self, kind: type[Message]) -> None:
        """Add a class of messages."""
        self[str(kind.__struct_config__.tag)] = kind


Decoded = tuple[int, Message | ArgumentError]
Decode = Callable[[str], Decoded]


class _Numbered(Struct):
    """The parts of any message that say what a wrong one was meant to be."""

    id: object = 0
    do: object = ""


_NUMBERED = Decoder(_Numbered)


def decoder_of(kinds: Iterable[type[Message]], hint: Callable[[object], str] = lambda do: "") -> Decode:
    """Return the function that decodes a message of some kinds.

    It returns the number of a message, or 0, and what was said; of a wrong message, what is wrong with it. *hint* gives
    what to try, from what stands at ``do``.
    """
    decoder: Decoder[Message] = Decoder(Union[tuple(kinds)])  # noqa: UP007  # a tuple of types has no |

    def decode(text: str) -> Decoded:
        try:
            message = decoder.decode(text)
        except (msgspec.DecodeError, RecursionError) as error:
            said = re.sub(r"\s+", " ", str(error))[:200] or "nested too deeply"
            try:
                wrong = _NUMBERED.decode(text)
            except (msgspec.DecodeError, RecursionError):
                wrong = _Numbered()
            number = wrong.id if type(wrong.id) is int and 0 <= wrong.id <= MAX_ID else 0
            return number, ArgumentError(f"this is not a message of the protocol: {said}", hint=hint(wrong.do))
        return message.id, message

    return decode


class Told(Struct, tag_field="type"):
    """Something that a caller is told."""


class Answer(Told, tag="answer", kw_only=True):
    """The answer to a request that was carried out."""

    id: Id
    ok: Annotated[bool, Meta(extra_json_schema={"const": True})] = True
    result: Annotated[Json, Meta(description="What the request gives, or null.", extra_json_schema={})] = None


class Trouble(Struct, kw_only=True):
    """Why a request was not carried out."""

    kind: Annotated[str, Meta(description="Name of the error in elib, such as ReplyTimeout.")]
    message: Text
    hint: Annotated[str, Meta(description="What to try; empty if there is nothing to say.")]

    @classmethod
    def of(cls, error: ElibError) -> Trouble:
        """Return what is told of an error."""
        return cls(kind=type(error).__name__, message=error.message, hint=error.hint)


class Failure(Told, tag="answer", kw_only=True):
    """The answer to a request that failed."""

    id: Id
    ok: Annotated[bool, Meta(extra_json_schema={"const": False})] = False
    error: Trouble


class Error(Told, tag="error", kw_only=True):
    """The failure of a request without a number, or something that went wrong without a request.

    A program is told so when a robot that it drives was stopped under it, and when a watch has ended by itself.
    """

    robot: Annotated[str, Meta(description="Key of the robot that it is about; empty for none.")] = ""
    error: Trouble


class Connection(Protocol):
    """What carries messages to a caller, such as a WebSocket."""

    @property
    def unread(self) -> int:
        """Bytes that the caller has not taken yet of what it was sent."""

    async def send(self, data: bytes, *, is_text: bool) -> None:
        """Send a message, and wait for nothing; a caller that is gone gets none."""

    async def close(self, code: int, reason: str) -> None:
        """End it, with a code of RFC 6455."""


class Caller:
    """A page or a program, from the opening of its connection to its end.

    Attributes:
        connection: What carries messages to it.
    """

    kind: ClassVar[str]
    """What it is, in the words of errors: ``page`` or ``program``."""
    served_by: ClassVar[str]
    """Who serves it, in the words of errors: who ends, and who makes a mistake if one is made."""
    closing_reason: ClassVar[str] = ""
    """Why it is left for a text that is not a message; empty if it is only told so."""
    max_wait: ClassVar[float | None] = None
    """s within which a request is answered whatever happens; None if that is left to the request."""
    logger: ClassVar[logging.Logger]

    def __init__(self, panel: Panel, decode: Decode, connection: Connection) -> None:
        self.panel = panel
        self._met: set[Slot] = set()
        # its name at the drive locks. A caller acts under this name alone: no message has one.
        self.key = f"{self.kind}-{secrets.token_hex(8)}"
        self.is_let_in = True  # whether it has shown the token, if there is one
        self.connection, self._decode = connection, decode
        self._loop = asyncio.get_running_loop()
        self._requests = Tasks()
        self._due = 0.0

    def admit(self, message: Message) -> None:
        """Check that the caller may say this now, before it is carried out; an ArgumentError says why it may not."""
        return

    def meet(self) -> None:
        """Look at every robot that is there now: it is read, and what was started there goes on."""
        there = set(self.panel.slots.values())
        for slot in there - self._met:
            slot.join(self.key)
        self._met = there

    # -- what it says --

    async def hear(self, text: str) -> str:
        """Carry out one message; return why the connection is to be closed, or an empty string."""
        if self.unread > MAX_UNREAD:
            return f"the {self.kind} does not read its answers"
        number, message = self._decode(text)
        if isinstance(message, ArgumentError):
            await self._answer(number, message)
            return self.closing_reason if self.is_let_in else GREETING
        if not self.is_let_in and not message.is_greeting:
            await self._answer(number, ArgumentError(GREETING))
            return GREETING
        try:
            if self.panel.is_ending:
                raise LinkClosed(f"{self.served_by} ends")
            self.admit(message)
            result = message.carry_out(self)
            if inspect.isawaitable(result):
                if len(self._requests) >= MAX_WAITING:
                    if inspect.iscoroutine(result):
                        result.close()
                    raise ArgumentError(
                        f"{MAX_WAITING} requests wait for their answers, and no more can", hint="wait for answers"
                    )
                self._requests.begin(self._finish(number, result), "elib request")
                return ""
        except Exception as error:
            await self._answer(number, error)
            return "" if self.is_let_in else "this is not the token"
        if self._pause() > 0:
            self._requests.begin(self._answer_later(number, result), "elib answer")
        else:
            await self._answer(number, result)
        return ""

    async def _finish(self, number: int, work: Awaitable[object]) -> None:
        """Wait for the result of a request, and answer it."""
        result: object
        try:
            async with asyncio.timeout(None if self.max_wait is None else self.max_wait * time_factor()):
                result = await work
        except TimeoutError as error:
            own = ReplyTimeout(f"the request did not end within {self.max_wait or 0:g} s")
            result = error if isinstance(error, ElibError) else own
        except asyncio.CancelledError:
            result = LinkClosed("the connection ends before the request did")
        except Exception as error:
            result = error
        await self._answer_later(number, result)

    async def _answer_later(self, number: int, result: object) -> None:
        pause = self._pause()
        if pause > 0:  # a sleep of zero would cost a turn of the event loop
            with contextlib.suppress(asyncio.CancelledError):
                await asyncio.sleep(pause)
        await self._answer(number, result)

    def _pause(self) -> float:
        """Return how long an answer waits now, s, because many went before it."""
        return max(0.0, self._due - self._loop.time() - ANSWERS_AT_ONCE / ANSWERS * time_factor())

    async def _answer(self, number: int, result: object) -> None:
        """Send the one answer of a request: a result or an error."""
        self._due = max(self._due, self._loop.time()) + time_factor() / ANSWERS
        try:
            if isinstance(result, BaseException):
                raise result
            if not number:
                return
            data = _encoded(Answer(id=number, result=result))
        except ElibError as error:
            data = _failure(number, Trouble.of(error))
        except Exception as error:
            self.logger.error("a request of a %s failed", self.kind, exc_info=error)
            mistake = Trouble(kind="Error", message=f"{self.served_by} made a mistake", hint="its terminal says more")
            data = _failure(number, mistake)
        await self.send(data)

    # -- what it is told --

    @property
    def unread(self) -> int:
        """Bytes that it has not taken yet of what it was sent."""
        return self.connection.unread

    async def tell(self, message: Told) -> None:
        """Send a message."""
        await self.send(_encoded(message))

    async def send(self, data: bytes, *, is_text: bool = True) -> None:
        """Send a message, and wait for nothing; a caller that is gone gets none."""
        await self.connection.send(data, is_text=is_text)

    async def close(self) -> None:
        """Leave all robots: what it drove stops now. Every request that waits is answered."""
        for slot in self._met:
            slot.leave(self.key)
        self._met = set()
        await asyncio.sleep(0)  # so that every request has begun, and answers when it is cancelled
        await self._requests.end()


def _encoded(message: Told) -> bytes:
    try:
        return msgspec.json.encode(message)
    except UnicodeEncodeError:  # a path that is not UTF-8, which json writes in ASCII; what is not finite is null
        text = json.dumps(msgspec.to_builtins(message))
        return json.dumps(json.loads(text, parse_constant=lambda _: None)).encode()


def _failure(number: int, error: Trouble) -> bytes:
    return _encoded(Failure(id=number, error=error) if number else Error(error=error))
