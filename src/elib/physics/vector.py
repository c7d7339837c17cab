"""Eight numbers at once: vectors for the compiled engine, as the processor has them.

A compiler turns a loop over eight sensors into such instructions only now and then, and guards them with checks that
cost more than the work. Here they are written down: ``load`` and ``store`` move eight numbers that lie side by side,
``pick`` takes them from anywhere, the operators work on each pair, a comparison gives eight flags, and ``choose`` takes
one of two numbers where a program for one would branch. Each number comes out as the same operation on a single one
gives it, to the last bit. Where a machine has shorter vectors, LLVM uses several.

Only compiled kernels can call what is here; the extra ``swarm`` brings Numba.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, Final, TypeAlias, cast

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.extending import intrinsic, lower_builtin, register_model
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

LANES: Final = 8
"""Numbers in a vector."""

DOUBLE, LONG, BIT, INT = ir.DoubleType(), ir.IntType(64), ir.IntType(1), ir.IntType(32)


class Vector(types.Type):
    """Eight of a kind.

    Attributes:
        element: What LLVM calls one of them.
    """

    def __init__(self, name: str, element: Any) -> None:
        self.element = element
        super().__init__(name=name)


REALS: Final = Vector("reals", DOUBLE)
WORDS: Final = Vector("words", LONG)
FLAGS: Final = Vector("flags", BIT)


@register_model(Vector)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Vector) -> None:
        super().__init__(manager, kind, ir.VectorType(kind.element, LANES))


Reals: TypeAlias = Any
"""What real numbers are to a reader of types; Numba finds out by itself."""


def _compiled(build: Callable[..., Any]) -> Callable[..., Any]:
    """Return what kernels call, from a function of Numba's types that returns a signature and how to build it."""
    return cast("Callable[..., Any]", intrinsic(build))


# -- operators --


def _spread(builder: Any, value: Any) -> Any:
    """Return a vector of eight times *value*."""
    kind = ir.VectorType(value.type, LANES)
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.Constant(INT, 0))
    zeros = ir.Constant(ir.VectorType(INT, LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(kind, ir.Undefined), zeros)


def _element(kind: Any) -> Vector | None:
    """Return the vector that a number of this type is spread to."""
    if isinstance(kind, Vector):
        return kind
    if isinstance(kind, types.Float):
        return REALS
    if isinstance(kind, types.Boolean):
        return FLAGS
    return WORDS if isinstance(kind, types.Integer) else None


def _common(one: Any, other: Any) -> Vector | None:
    """Return the vector that both become in an operation; None if there is none."""
    if not (isinstance(one, Vector) or isinstance(other, Vector)):
        return None
    vector, number = (one, other) if isinstance(one, Vector) else (other, one)
    return vector if _element(number) == vector or (vector == REALS and _element(number) == WORDS) else None


def _widened(context: Any, builder: Any, value: Any, given: Any, wanted: Vector) -> Any:
    if isinstance(given, Vector):
        return value
    number = {REALS: types.float64, WORDS: types.int64, FLAGS: types.boolean}[wanted]
    value = context.cast(builder, value, given, number)
    return _spread(builder, builder.trunc(value, BIT) if wanted == FLAGS and value.type != BIT else value)


def _operation(which: Any, build: Callable[[Any, Vector, Any, Any], Any], *, compares: bool = False) -> None:
    """Let an operator of Python work on vectors, and on a vector and a number."""

    @infer_global(which)
    class _Template(AbstractTemplate):
        def generic(self, given: Any, _: Any) -> Any:
            kind = _common(*given) if len(given) == 2 else None
            return None if kind is None else signature(FLAGS if compares else kind, *given)

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        kind = _common(*sig.args)
        assert kind is not None
        one, other = (
            _widened(context, builder, value, given, kind) for value, given in zip(values, sig.args, strict=True)
        )
        return build(builder, kind, one, other)

    numbers: tuple[Any, ...] = (types.Number, types.Boolean)
    for pair in ((Vector, Vector), *((Vector, other) for other in numbers), *((one, Vector) for one in numbers)):
        lower_builtin(which, *pair)(lower)


def _arithmetic(on_reals: str, on_words: str) -> Callable[[Any, Vector, Any, Any], Any]:
    return lambda builder, kind, one, other: getattr(builder, on_reals if kind == REALS else on_words)(one, other)


def _comparison(sign: str) -> Callable[[Any, Vector, Any, Any], Any]:
    def build(builder: Any, kind: Vector, one: Any, other: Any) -> Any:
        if kind == REALS:
            return (builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered)(sign, one, other)
        return builder.icmp_signed(sign, one, other)

    return build


_operation(operator.add, _arithmetic("fadd", "add"))
_operation(operator.sub, _arithmetic("fsub", "sub"))
_operation(operator.mul, _arithmetic("fmul", "mul"))
_operation(operator.truediv, _arithmetic("fdiv", "sdiv"))
for _which, _name in (
    (operator.and_, "and_"),
    (operator.or_, "or_"),
    (operator.xor, "xor"),
    (operator.rshift, "ashr"),
    (operator.lshift, "shl"),
):
    _operation(_which, _arithmetic(_name, _name))
for _which, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _operation(_which, _comparison(_sign), compares=True)


# -- memory --


def _place(builder: Any, sequence: Any, index: Any) -> Any:
    return builder.gep(sequence, [index])


def _vector_of(sequence: Any) -> Vector | None:
    return _element(sequence.dtype) if isinstance(sequence, types.CPointer) else None


def _index(context: Any, builder: Any, value: Any, kind: Any) -> Any:
    return context.cast(builder, value, kind, types.int64)


@_compiled
def load(typing: Any, sequence: Any, index: Any) -> Any:
    """Return ``sequence[index]`` to ``sequence[index + 7]``."""
    kind = _vector_of(sequence)
    if kind is None:
        return None

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        where = _place(builder, values[0], _index(context, builder, values[1], sig.args[1]))
        return builder.load(builder.bitcast(where, ir.VectorType(kind.element, LANES).as_pointer()), align=8)

    return kind(sequence, index), lower


@_compiled
def store(typing: Any, sequence: Any, index: Any, vector: Any) -> Any:
    """Set ``sequence[index]`` to ``sequence[index + 7]``."""
    if _vector_of(sequence) is None or vector != _vector_of(sequence):
        return None

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        where = _place(builder, values[0], _index(context, builder, values[1], sig.args[1]))
        builder.store(values[2], builder.bitcast(where, values[2].type.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(sequence, index, vector), lower


@_compiled
def after(typing: Any, sequence: Any, count: Any) -> Any:
    """Return the sequence that begins *count* elements later."""
    if _vector_of(sequence) is None:
        return None

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return _place(builder, values[0], _index(context, builder, values[1], sig.args[1]))

    return sequence(sequence, count), lower


@_compiled
def pick(typing: Any, sequence: Any, indices: Any, at: Any) -> Any:
    """Return the elements of *sequence* at the places ``indices[at]`` to ``indices[at + 7]``.

    Eight loads: where a processor has an instruction for all of them it is no faster, and often slower since it was
    mended against spies (Downfall, CVE-2022-40982).
    """
    kind = _vector_of(sequence)
    if kind is None or _vector_of(indices) != WORDS:
        return None

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        found = ir.Constant(ir.VectorType(kind.element, LANES), ir.Undefined)
        for lane, where in enumerate(_places(context, builder, sig, values)):
            found = builder.insert_element(found, builder.load(where), ir.Constant(INT, lane))
        return found

    return kind(sequence, indices, at), lower


@_compiled
def pick_two(typing: Any, sequence: Any, indices: Any, at: Any) -> Any:
    """Return the elements of *sequence* at the places ``indices[at]`` to ``indices[at + 7]``, and those behind them."""
    kind = _vector_of(sequence)
    if kind is None or _vector_of(indices) != WORDS:
        return None
    both = types.UniTuple(kind, 2)

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        pair = ir.VectorType(kind.element, 2).as_pointer()
        parts = [
            builder.load(builder.bitcast(where, pair), align=8) for where in _places(context, builder, sig, values)
        ]
        while len(parts) > 1:  # Two, four, eight and then all sixteen numbers in a row.
            order = _order(range(2 * parts[0].type.count))
            parts = [
                builder.shuffle_vector(one, other, order) for one, other in zip(parts[::2], parts[1::2], strict=True)
            ]
        every_other = [
            builder.shuffle_vector(parts[0], parts[0], _order(range(first, 2 * LANES, 2))) for first in (0, 1)
        ]
        return context.make_tuple(builder, both, every_other)

    return both(sequence, indices, at), lower


def _places(context: Any, builder: Any, sig: Any, values: Any) -> list[Any]:
    """Return where the eight elements of a sequence are whose indices lie one behind the other."""
    sequence, indices, at = values
    first = _place(builder, indices, _index(context, builder, at, sig.args[2]))
    return [_place(builder, sequence, builder.load(_place(builder, first, LONG(lane)))) for lane in range(LANES)]


def _order(indices: range) -> Any:
    return ir.Constant(ir.VectorType(INT, len(indices)), list(indices))


# -- functions --


@_compiled
def spread(typing: Any, value: Any) -> Any:
    """Return a vector of eight times *value*."""
    kind = _element(value)
    if kind is None or isinstance(value, Vector):
        return None

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return _widened(context, builder, values[0], sig.args[0], kind)

    return kind(value), lower


@_compiled
def choose(typing: Any, flags: Any, one: Any, other: Any) -> Any:
    """Return *one* where a flag is set and *other* elsewhere."""
    kind = _common(one, other)
    if flags != FLAGS or kind is None:
        return None

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        a, b = (
            _widened(context, builder, value, given, kind)
            for value, given in zip(values[1:], sig.args[1:], strict=True)
        )
        return builder.select(values[0], a, b)

    return kind(flags, one, other), lower


def _unary(name: str) -> Any:
    def function(typing: Any, vector: Any) -> Any:
        if vector != REALS:
            return None

        def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            kind = values[0].type
            called = cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind]), f"llvm.{name}.v8f64")
            return builder.call(called, values)

        return REALS(vector), lower

    return function


root = _compiled(_unary("sqrt"))
"""Return the square roots of a vector."""
size = _compiled(_unary("fabs"))
"""Return the numbers of a vector without their signs."""


@_compiled
def whole(typing: Any, vector: Any) -> Any:
    """Return the whole numbers of a vector, cut towards 0."""

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.fptosi(values[0], ir.VectorType(LONG, LANES))

    return WORDS(vector), lower


@_compiled
def real(typing: Any, vector: Any) -> Any:
    """Return whole numbers as real ones."""

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.sitofp(values[0], ir.VectorType(DOUBLE, LANES))

    return REALS(vector), lower


@_compiled
def mask(typing: Any, flags: Any) -> Any:
    """Return the flags as the bits of a number, the first as the lowest."""
    if flags != FLAGS:
        return None

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.zext(builder.bitcast(values[0], ir.IntType(LANES)), LONG)

    return types.int64(flags), lower
