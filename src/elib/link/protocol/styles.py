"""The API styles: what a row of the table, or an action, becomes when it is reached through an object.

``Command`` and :class:`Action` are the descriptors that class bodies hold. Reached through an
object they become a function whose *type* depends on the style of that object, by overloads of ``__get__``.
"""

from __future__ import annotations

import concurrent.futures
import functools
import inspect
import re
import types
import typing
import warnings
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Concatenate, Generic, Never, ParamSpec, Protocol, TypeVar, overload

from elib.base.errors import ArgumentError, CallCancelled, ElibError, LinkClosed
from elib.base.pose import Pose
from elib.base.rules import nearest
from elib.link.protocol.quantities import Quantity, check_timeout

P = ParamSpec("P")
T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
if TYPE_CHECKING:  # Python 3.13 has defaults of type variables, and type checkers know them for older versions too
    from typing_extensions import TypeVar as TypeVarWithDefault

    # A lambda is passed before the command is named: without a bound and a default its argument would be an `object`.
    V_contra = TypeVarWithDefault("V_contra", contravariant=True, bound=Any, default=Any)
else:
    V_contra = TypeVar("V_contra", contravariant=True)


class ApiStyle:
    """Base of the objects through which commands are called."""

    _spelt = "robot.{}"
    """How a program writes a call."""

    def _call(self, operation: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        raise NotImplementedError


class AsyncStyle(ApiStyle):
    """Calls return coroutines."""

    _spelt = "await robot.{}"


class BlockingStyle(ApiStyle):
    """Calls wait and return values."""


class BeginStyle(ApiStyle):
    """Calls return a :class:`Pending` at once."""

    _spelt = "robot.begin.{}"


class CallbackStyle(ApiStyle, Generic[V_contra]):
    """Calls return nothing; the outcome reaches a callback that takes values of this type."""

    _spelt = "robot.callback(...).{}"


class SwarmStyle(ApiStyle):
    """Calls go to several robots and return coroutines of their answers, by the names of the robots."""

    _spelt = "await robots.all.{}"


class LoopPortal(Protocol):
    """The interface of the portal to the robot's event loop, as begun calls use it."""

    def wait(self, future: concurrent.futures.Future[T], timeout: float | None = None) -> T:
        """Wait for *future*, at most *timeout* seconds of the robot's time, and return its result."""
        ...

    def later(self, function: Callable[[], None], name: str) -> None:
        """Run *function* off the loop."""
        ...


class NotAValue:
    """What a program may take for the value that it stands for; used as one, it says what to write."""

    __slots__ = ()

    @property
    def advice(self) -> str:
        """What to write."""
        raise NotImplementedError

    if not TYPE_CHECKING:  # type checkers say so by themselves

        def __getattr__(self, name):
            if name.startswith("_") or name in type(self).__slots__:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            raise AttributeError(self.advice)

        def _refuse(self, *_):
            raise TypeError(self.advice)

        def __bool__(self):  # any code may ask whether there is something
            return True

        def __eq__(self, other):
            return self._refuse() if isinstance(other, (int, float, str, tuple)) else self is other

        def __format__(self, how):
            return self._refuse() if how else str(self)

        __hash__ = object.__hash__
        __iter__ = __len__ = __getitem__ = __contains__ = __await__ = __lt__ = __le__ = __gt__ = __ge__ = _refuse
        __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _refuse
        __neg__ = __abs__ = __round__ = __int__ = __float__ = __index__ = _refuse


class Pending(NotAValue, Generic[T_co]):
    """A call that was begun. It goes on whether or not anybody waits.

    Attributes:
        name: The name of the call in its error; it may be changed while the call is pending.
        state: Any object of the caller.
    """

    def __init__(
        self,
        future: concurrent.futures.Future[T_co],
        portal: LoopPortal,
        name: str,
        state: Any = None,
        keep_alive: object = None,
    ) -> None:
        self._keep_alive = keep_alive  # the robot is not closed while somebody holds it
        self._future = future
        self._portal = portal
        self._own_name = self.name = name
        self._is_cancelled = False
        self.state = state

    def end(self) -> T_co:
        """Wait for the outcome; return the value or raise the error. A second call does the same."""
        return self.result()

    def result(self, timeout: float | None = None) -> T_co:
        """Wait for the outcome; return the value or raise the error.

        Args:
            timeout: Seconds of the robot's time after which to stop waiting; the call itself goes on.

        Raises:
            TimeoutError: *timeout* passed.
        """
        if timeout is not None:
            check_timeout(timeout)
        try:
            return self._future.result() if self._future.done() else self._portal.wait(self._future, timeout)
        except (concurrent.futures.CancelledError, LinkClosed) as error:
            if self._is_cancelled:
                hint = "cancel() of this call gave it up; the robot is open"
                raise CallCancelled(f"{self.name} was cancelled", hint=hint) from None
            if isinstance(error, LinkClosed):
                raise
            raise LinkClosed(f"{self.name} was given up: the robot was closed") from None
        except ElibError as error:
            if self.name != self._own_name and self.name not in error.message:
                error.message = f"{self.name}: {error.message}"
            raise

    def done(self) -> bool:
        """Return whether the outcome is there."""
        return self._future.done()

    def cancel(self) -> bool:
        """Give the call up; return whether it was still pending. Its ``end()`` then raises CallCancelled."""
        self._is_cancelled = True  # first, because another thread may wait for the outcome
        self._is_cancelled = self._future.cancel()
        return self._is_cancelled

    def exception(self) -> BaseException | None:
        """Wait for the outcome; return the error, or None."""
        try:
            self.result()
        except Exception as error:
            return error
        return None

    def add_done_callback(self, function: Callable[[Pending[T_co]], object]) -> None:
        """Call ``function(pending)`` once, off the event loop, when the outcome is there; at once if it is."""
        name = f"the callback of {self.name}"
        self._future.add_done_callback(lambda _: self._portal.later(lambda: _ignore(function(self)), name))

    @property
    def advice(self) -> str:
        """What to write."""
        return f"{self.name}() is under way: call .end() for its value, or use elib.open() for await"

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} {'done' if self.done() else 'pending'}>"


@dataclass(frozen=True, slots=True)
class Outcomes(Generic[T]):
    """The outcomes of a call to several robots. The name of each robot is in exactly one of the two.

    Attributes:
        answers: The answers, by the names of the robots.
        errors: The errors of the other robots.
    """

    answers: dict[str, T]
    errors: dict[str, Exception]


class CollectingStyle(ApiStyle):
    """Calls go to several robots and return coroutines of their outcomes; the error of one robot does not end them."""

    _spelt = "await robots.all.collect.{}"


class Method(NotAValue):
    """An operation reached through a style. Users see a method; it is cheaper to make than one."""

    __slots__ = ("operation", "style")

    def __init__(self, style: ApiStyle, operation: Bindable[..., Any]) -> None:
        self.style = style
        self.operation = operation

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the operation in this style."""
        return self.style._call(self.operation, args, kwargs)

    def __bool__(self) -> bool:
        # Code that asks whether there is a function may do so, but most often the brackets were forgotten.
        warnings.warn(f"{self.advice}; a command itself is always true", stacklevel=2)
        return True

    def __get__(self, obj: object, owner: type | None = None) -> typing.Self:
        """Return itself, so that ``help()`` shows a method and not an attribute."""
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

    @property
    def advice(self) -> str:
        """What to write."""
        needed = (name for name, each in self.__signature__.parameters.items() if each.default is each.empty)
        call = self.style._spelt.format(f"{self.operation.name}({', '.join(needed)})")
        return f"{self.operation.name} is a command: write {call}"

    def __repr__(self) -> str:
        return f"<{self.operation.name}{self.__signature__} of {self.style!r}>"


class Bindable(Generic[P, T]):
    """A descriptor that becomes a function, with the types of the style it is reached through."""

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
    def __get__(self, obj: BeginStyle, owner: type) -> Callable[P, Pending[T]]: ...
    @overload
    def __get__(self, obj: CallbackStyle[T], owner: type) -> Callable[P, None]: ...
    @overload
    def __get__(self, obj: SwarmStyle, owner: type) -> Callable[P, Coroutine[Any, Any, dict[str, T]]]: ...
    @overload
    def __get__(self, obj: CollectingStyle, owner: type) -> Callable[P, Coroutine[Any, Any, Outcomes[T]]]: ...
    def __get__(self, obj: ApiStyle | None, owner: type) -> Any:
        if obj is None:
            return self

        return Method(obj, self)

    def __set__(self, obj: ApiStyle, value: Never) -> None:
        raise AttributeError(f"{self.name} is a command and cannot be assigned to; call robot.{self.name}(...)")

    def __call__(self, style: ApiStyle, *args: Any, **kwargs: Any) -> Any:
        """Call through the class: ``elib.Epuck.proximity(robot)``."""
        return style._call(self, args, kwargs)


def bind(
    name: str,
    signature: inspect.Signature,
    args: tuple[object, ...],
    kwargs: Mapping[str, object],
    rule: Callable[[str], str],
) -> inspect.BoundArguments:
    """Return the arguments of a call by their names.

    Args:
        name: What is called.
        signature: Its signature, without ``self``.
        args: The arguments by place.
        kwargs: The arguments by name.
        rule: Returns what an argument must be, or an empty text.

    Raises:
        ArgumentError: One is missing, unknown or one too many.
    """
    try:
        return signature.bind(*args, **kwargs)
    except TypeError as error:
        known = signature.parameters
        places = [each.name for each in known.values() if each.kind is not each.KEYWORD_ONLY]
        called = f"{name}({', '.join(places)})"
        for wrong in kwargs:
            if wrong not in known:
                hint = nearest(wrong, known) if known else ""
                raise ArgumentError(f"{called} has no argument {wrong!r}", hint=hint) from None
        if len(args) > len(places):
            named = " or ".join(f"{each}=..." for each in known if each not in places)
            hint = f"write it with its name: {named}" if named else ""
            raise ArgumentError(f"{called} takes no further argument {args[len(places)]!r}", hint=hint) from None
        for each in list(known.values())[len(args) :]:
            if each.name not in kwargs and each.default is each.empty:
                needed = rule(each.name)
                raise ArgumentError(f"{called} needs {each.name}" + (needed and f": {needed}")) from None
        raise ArgumentError(f"{name}(): {error}") from None


class Words(str):
    """An annotation as text, which signatures show without quotes."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def readable_signature(function: Callable[..., object]) -> inspect.Signature:
    """Return the signature of a method without ``self``, with short annotations: ``(n: int) -> Wheels``."""
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


def argument_hints(function: Callable[..., object]) -> dict[str, Any]:
    """Return the annotations of the arguments. That of the result may name what is not imported yet."""
    own = {name: note for name, note in function.__annotations__.items() if name not in ("self", "return")}
    holder = types.SimpleNamespace(__annotations__=own)
    return typing.get_type_hints(holder, globalns=function.__globals__, include_extras=True)


class Action(Bindable[P, T]):
    """A method that needs several requests, written once as a coroutine function of the async robot."""

    def __init__(self, function: Callable[..., Coroutine[Any, Any, T]]) -> None:
        self.function = function
        self.name = function.__name__
        self.__doc__ = inspect.getdoc(function)
        self.__signature__ = readable_signature(function)

    def check(self, args: tuple[object, ...], kwargs: Mapping[str, object]) -> inspect.BoundArguments:
        """Return the arguments of a call, each that has a quantity as the number to use.

        Raises:
            ArgumentError: One is missing, unknown, one too many, or out of its range.
        """
        parameters = self.__signature__.parameters
        bound = bind(self.name, self.__signature__, args, kwargs, self._rule)
        for name, value in bound.arguments.items():
            quantity = self.quantities[name]
            if quantity is not None and value is not parameters[name].default and not isinstance(value, Pose):
                bound.arguments[name] = quantity.check(name, value)
        return bound

    def _rule(self, argument: str) -> str:
        """Return what an argument may be; an empty text if it has no rule."""
        found = self.quantities[argument]
        return "" if found is None else found.rule

    @functools.cached_property
    def quantities(self) -> Mapping[str, Quantity | None]:
        """Unit and range of each argument; None for one that has none."""
        return {name: _quantity(hint) for name, hint in argument_hints(self.function).items()}


def _quantity(hint: object) -> Quantity | None:
    """Return the quantity of an annotation, or of one of its alternatives."""
    notes = (note for each in (hint, *typing.get_args(hint)) for note in getattr(each, "__metadata__", ()))
    return next((note for note in notes if isinstance(note, Quantity)), None)


def action(function: Callable[Concatenate[Any, P], Coroutine[Any, Any, T]]) -> Action[P, T]:
    """Make a coroutine method of the async robot a method in every style."""
    return Action(function)


def _ignore(_: object) -> None:
    """Drop the result of a callback."""
