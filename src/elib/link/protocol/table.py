"""The parts of the command table: a row, its parameters, and the requests it makes.

A row is written once, as a decorated signature in ``commands.py``. :class:`Spec` is its data: the codec, the command
line, the reference page and the tests read it. ``styles.py`` makes it a method of the robot.
"""

from __future__ import annotations

import enum
import inspect
import textwrap
import typing
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Concatenate, Generic, Literal, ParamSpec, TypeVar

from elib.base.errors import Unsupported
from elib.base.rules import Flag
from elib.link.protocol.context import Context, Form, Profile, Reply
from elib.link.protocol.forms import prepare
from elib.link.protocol.profiles import rule
from elib.link.protocol.quantities import Quantity
from elib.link.protocol.styles import Bindable, argument_hints, bind, readable_signature
from elib.link.protocol.wifi import WifiForm

P = ParamSpec("P")
T = TypeVar("T")
WheelEffect = Literal["", "drive", "stop"]
QUICK = 1.0
"""s that a call waits by default; only slow commands have another time."""
EXAMPLE = "\n\nExample:\n"
"""Begins the last section of a docstring."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One argument of a command."""

    name: str
    quantity: Quantity
    default: object = inspect.Parameter.empty


@dataclass(frozen=True, slots=True)
class Spec(Generic[T]):
    """One row of the table."""

    name: str
    signature: inspect.Signature  # its signature, without `self`
    # its arguments with units and ranges; `clip` of `set_speed()` has none, and is not on the wire
    parameters: tuple[Parameter, ...]
    text: Form[T] | None  # its usual text form, or None
    # its usual binary form, or None. It is sent if there is no text form, or with others in one frame.
    binary: Form[T] | None
    wifi: Form[T] | None  # its form over Wi-Fi, or None
    timeout: float  # seconds that a call waits for its answer by default
    urgent: bool  # whether it goes first among the waiting calls
    replaces: frozenset[str]  # names of rows; a call takes the place of their calls that are not sent yet
    remember: Callable[[Sequence[int], Context], None] | None  # called with a confirmed call, to note what it has set
    doc: str  # its docstring, without the example
    example: str  # what is typed at Python's prompt, and what that prints
    is_reading: bool  # whether it returns a value and changes nothing
    # what it does to the wheels: after `drive` they may turn, after `stop` they stand; empty if nothing
    wheels: WheelEffect

    @property
    def letter(self) -> str:
        """The letter on the wire; an empty text if there is no text form."""
        return "" if self.text is None else self.text.letter

    def form(self, context: Context) -> Form[T]:
        """Return the form that this firmware understands.

        Raises:
            Unsupported: The firmware does not have the command.
        """
        profile = context.profile
        reason = profile.absent.get(self.name)
        if reason is not None:
            raise Unsupported(f"{self.name}() does not exist on {profile.name}: {reason}")
        if profile.codec == "wifi":
            form = self.wifi
        else:
            form = typing.cast("Form[T] | None", profile.forms.get(self.name)) or self.text or self.binary
        if form is None:
            raise Unsupported(f"{self.name}() does not exist on {profile.name}")
        return form

    def binary_form(self, profile: Profile) -> Form[T] | None:
        """Return the form that stands in a binary frame on this firmware, or None."""
        own = profile.binary_forms.get(self.name) or profile.forms.get(self.name)
        return self.binary if own is None or own.code is None else typing.cast("Form[T]", own)

    def numbers(self, context: Context, args: tuple[object, ...], kwargs: dict[str, object]) -> tuple[int, ...]:
        """Check the arguments and return them as whole numbers, as they are on the wire.

        Raises:
            ArgumentError: One is missing, unknown, of the wrong type or out of this firmware's range.
        """
        quantities = {each.name: context.profile.limited(each.quantity) for each in self.parameters}
        bound = bind(self.name, self.signature, args, kwargs, lambda name: quantities[name].rule)
        bound.apply_defaults()
        given = bound.arguments
        clip = "clip" in given and Flag().require(given["clip"], "clip")
        return tuple(each.to_wire(each.check(name, given[name], clip=clip)) for name, each in quantities.items())

    def request(self, context: Context, /, *args: object, **kwargs: object) -> Request[T]:
        """Return the request of one call. Every argument is checked before a byte is made.

        Raises:
            Unsupported: The firmware does not have the command.
            ArgumentError: An argument is wrong.
        """
        if not self.parameters and not args and not kwargs:
            known = context.requests.get(self.name)
            if known is None:
                known = context.requests[self.name] = self._request(context, (), {})
            return typing.cast("Request[T]", known)
        return self._request(context, args, kwargs)

    def _request(self, context: Context, args: tuple[object, ...], kwargs: dict[str, object]) -> Request[T]:
        form = self.form(context)
        numbers = self.numbers(context, args, kwargs)
        data, reply = prepare(form, numbers, context)
        make = (lambda now: prepare(form, numbers, now)[0]) if form.is_stateful else None
        shown = ", ".join([*map(_shown, args), *(f"{name}={_shown(value)}" for name, value in kwargs.items())])
        return Request(
            text=f"{self.name}({shown})",
            name=self.name,
            data=data,
            reply=reply,
            numbers=numbers,
            spec=self,
            service=context.profile.service.get(self.name, 0.0),
            make=make,
            timeout=max(self.timeout, context.profile.patience),
            wheels=self.wheels,
        )


def _shown(value: object) -> str:
    return value.name if isinstance(value, enum.Enum) else repr(value)


@dataclass(frozen=True, slots=True)
class Request(Generic[T]):
    """One call, ready for the wire."""

    text: str  # the call, as a person writes it
    name: str  # the name of its row
    data: bytes  # the bytes to send, in one write
    reply: Reply[T]  # the shape of the answer
    numbers: tuple[int, ...] = ()  # its arguments as whole numbers
    # its row; None for a request of several rows and for a text command
    spec: Spec[T] | None = field(default=None, repr=False)
    service: float = 0.0  # longest time that the robot is busy with it and reads nothing, s
    # makes the bytes for the connection on which they are sent, if they contain what was set there; else None
    make: Callable[[Context], bytes] | None = field(default=None, repr=False)
    timeout: float = QUICK  # seconds to wait for the answer by default
    wheels: WheelEffect = ""  # what it does to the wheels; see Spec
    is_poll: bool = False  # whether it asks for readings alone, without being a row's own request

    def __str__(self) -> str:
        return self.text

    @property
    def is_picture(self) -> bool:
        """Whether it asks for a picture, which is worth having even after the deadline."""
        return self.spec is not None and self.spec.name == "image"

    @property
    def is_quick(self) -> bool:
        """Whether the robot answers it at once; a slow link makes :attr:`timeout` longer, and not the command slow."""
        return self.spec is None or self.spec.timeout <= QUICK

    @property
    def is_urgent(self) -> bool:
        """Whether it goes first among the waiting calls: it stops the robot."""
        return self.spec is not None and self.spec.urgent

    @property
    def halts(self) -> bool:
        """Whether it stops the wheels: it must not wait while the line is out of sync, and it may be done twice."""
        return self.is_urgent or (self.name == "set_speed" and self.spec is not None and not any(self.numbers))

    @property
    def only_reads(self) -> bool:
        """Whether it returns a value and changes nothing, so that it may be asked again."""
        return self.is_poll or (self.spec is not None and self.spec.is_reading and not self.spec.parameters)

    def sent(self, context: Context) -> None:
        """Note what holds now, even if its answer is lost: wheels that it may stop are not told to drive on later."""
        if self.halts or (self.spec is None and self.wheels):  # which speeds a text command sets is not known
            context.last_set.speed = (0, 0)

    def confirmed(self, context: Context) -> None:
        """Note what the robot has confirmed."""
        if self.spec is not None and self.spec.remember is not None:
            self.spec.remember(self.numbers, context)


class Command(Bindable[P, T]):
    """A row of the table, as the class body holds it."""

    def __init__(self, spec: Spec[T]) -> None:
        self.spec = spec
        self.name = spec.name
        self.__signature__ = spec.signature

    @property
    def __doc__(self) -> str:  # type: ignore[override]  # an instance's own docstring
        lines = [f"    {each.name}: {rule(each.quantity)}" for each in self.spec.parameters]
        arguments = ["", "Args:", *lines] if lines else []
        example = ["", "Example:", textwrap.indent(self.spec.example, "    ")] if self.spec.example else []
        return "\n".join([self.spec.doc, *arguments, *example])


def without_example(doc: str) -> str:
    """Return a docstring without its example, which is its last section."""
    return doc.partition(EXAMPLE)[0]


def example_of(doc: str) -> str:
    """Return the example of a docstring: lines of Python's prompt, and what they print."""
    return textwrap.dedent(doc.partition(EXAMPLE)[2])


def command(
    text: Form[T] | None = None,
    binary: Form[T] | None = None,
    *,
    wifi: WifiForm[T] | None = None,
    timeout: float = QUICK,
    wheels: WheelEffect = "",
    urgent: bool = False,
    replaces: Sequence[str] = (),
    remember: Callable[[Sequence[int], Context], None] | None = None,
) -> Callable[[Callable[Concatenate[Any, P], T]], Command[P, T]]:
    """Make a row of the command table from a signature; :class:`Spec` explains the arguments."""

    def row(function: Callable[Concatenate[Any, P], T]) -> Command[P, T]:
        hints = argument_hints(function)
        signature = readable_signature(function)
        parameters = tuple(
            Parameter(
                item.name,
                next(note for note in hints[item.name].__metadata__ if isinstance(note, Quantity)),
                item.default,
            )
            for item in signature.parameters.values()
            if hints[item.name] is not bool
        )
        return Command(
            Spec(
                name=function.__name__,
                signature=signature,
                parameters=parameters,
                text=text,
                binary=binary,
                wifi=None if wifi is None else wifi.form(remember),
                timeout=timeout,
                urgent=urgent,
                replaces=frozenset(replaces),
                remember=remember,
                doc=without_example(inspect.getdoc(function) or ""),
                example=example_of(inspect.getdoc(function) or ""),
                is_reading=function.__annotations__["return"] not in (None, "None"),
                wheels=wheels,
            )
        )

    return row
