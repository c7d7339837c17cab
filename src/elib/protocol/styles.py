"""The styles: what a row of the table, or an action, becomes when it is reached through an object.

:class:`Command` and :class:`Action` are the descriptors that class bodies hold. Reached through an object they become a
function whose *type* depends on the style of that object, by overloads of ``__get__``.
"""

from __future__ import annotations

import inspect
import re
import typing
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Concatenate, Generic, Never, ParamSpec, TypeVar, overload

if TYPE_CHECKING:
    from elib.protocol.table import Spec
    from elib.robot.blocking import PendingCall

P = ParamSpec("P")
T = TypeVar("T")
V_contra = TypeVar("V_contra", contravariant=True)


class Style:
    """Base of the objects that commands are reached through."""

    def _call(self, operation: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        raise NotImplementedError


class AsyncStyle(Style):
    """Calls give coroutines."""


class BlockingStyle(Style):
    """Calls wait and give values."""


class BeginStyle(Style):
    """Calls give futures."""


class CallbackStyle(Style, Generic[V_contra]):
    """Calls give nothing; the outcome reaches a callback that takes values of this type."""


class SwarmStyle(Style):
    """Calls go to several robots and give coroutines of every robot's answer, by its name."""


@dataclass(frozen=True, slots=True)
class Outcomes(Generic[T]):
    """What became of a call to several robots: each one's name stands in exactly one of the two.

    Attributes:
        answers: What the robots answered.
        errors: What went wrong with the others.
    """

    answers: dict[str, T]
    errors: dict[str, Exception]


class CollectingStyle(Style):
    """Calls go to several robots and give coroutines of their outcomes; no robot's error ends them."""


class Bound:
    """An operation reached through a style: a function in all that users see, and cheaper to make than one."""

    __slots__ = ("operation", "style")

    def __init__(self, style: Style, operation: Bindable[..., Any]) -> None:
        self.style = style
        self.operation = operation

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Do it, as the style does such things."""
        return self.style._call(self.operation, args, kwargs)

    def __get__(self, obj: object, owner: type | None = None) -> typing.Self:
        """Return itself: with it ``help()`` takes this for a method, not for a piece of data."""
        return self

    @property
    def __name__(self) -> str:
        return self.operation.name

    @property
    def __doc__(self) -> str | None:  # type: ignore[override]  # an instance's own docstring
        return self.operation.__doc__

    @property
    def __signature__(self) -> inspect.Signature:
        return self.operation.__signature__

    def __repr__(self) -> str:
        return f"<{self.operation.name}{self.__signature__} of {self.style!r}>"


class Bindable(Generic[P, T]):
    """A descriptor that becomes a function, typed by the style it is reached through."""

    name: str
    __signature__: inspect.Signature

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, obj: None, owner: type) -> typing.Self: ...
    @overload
    def __get__(self, obj: AsyncStyle, owner: type) -> Callable[P, Coroutine[Any, Any, T]]: ...
    @overload
    def __get__(self, obj: BlockingStyle, owner: type) -> Callable[P, T]: ...
    @overload
    def __get__(self, obj: BeginStyle, owner: type) -> Callable[P, PendingCall[T]]: ...
    @overload
    def __get__(self, obj: CallbackStyle[T], owner: type) -> Callable[P, None]: ...
    @overload
    def __get__(self, obj: SwarmStyle, owner: type) -> Callable[P, Coroutine[Any, Any, dict[str, T]]]: ...
    @overload
    def __get__(self, obj: CollectingStyle, owner: type) -> Callable[P, Coroutine[Any, Any, Outcomes[T]]]: ...
    def __get__(self, obj: Style | None, owner: type) -> Any:
        if obj is None:
            return self

        return Bound(obj, self)

    def __set__(self, obj: Style, value: Never) -> None:
        raise AttributeError(f"{self.name} is a command and cannot be assigned to; call robot.{self.name}(...)")

    def __call__(self, style: Style, *args: Any, **kwargs: Any) -> Any:
        """Call through the class: ``elib.Epuck.proximity(robot)``."""
        return style._call(self, args, kwargs)


class Words(str):
    """An annotation as a person reads it: signatures show it without quotes."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def readable_signature(function: Callable[..., object]) -> inspect.Signature:
    """Return a method's signature without ``self``, its annotations as words: ``(n: int) -> Wheels``."""
    scope: Mapping[str, object] = getattr(function, "__globals__", {})
    signature = inspect.signature(function)
    return signature.replace(
        parameters=[
            each.replace(annotation=_words(each.annotation, scope)) for each in list(signature.parameters.values())[1:]
        ],
        return_annotation=_words(signature.return_annotation, scope),
    )


def _words(note: object, scope: Mapping[str, object]) -> Words:
    known = scope.get(note) if isinstance(note, str) else note
    if typing.get_origin(known) is typing.Annotated:  # a quantity: its type is what a caller passes
        note = inspect.formatannotation(typing.get_args(known)[0])
    return Words(re.sub(r"\b[a-z]\w*\.", "", note if isinstance(note, str) else inspect.formatannotation(note)))


class Command(Bindable[P, T]):
    """A row of the table, as the class body holds it."""

    def __init__(self, spec: Spec[T]) -> None:
        self.spec = spec
        self.name = spec.name
        self.__signature__ = spec.signature

    @property
    def __doc__(self) -> str:  # type: ignore[override]  # an instance's own docstring
        from elib.protocol.profiles import rule

        lines = [f"    {each.name}: {rule(each.quantity)}" for each in self.spec.parameters]
        return "\n".join([self.spec.doc, *(["", "Args:"] if lines else []), *lines])


class Action(Bindable[P, T]):
    """A method that needs several requests, written once as a coroutine function of the async robot."""

    def __init__(self, function: Callable[..., Coroutine[Any, Any, T]]) -> None:
        self.function = function
        self.name = function.__name__
        self.__doc__ = inspect.getdoc(function)
        self.__signature__ = readable_signature(function)


def action(function: Callable[Concatenate[Any, P], Coroutine[Any, Any, T]]) -> Action[P, T]:
    """Make a coroutine method of the async robot reachable through all four styles."""
    return Action(function)
