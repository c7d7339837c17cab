"""Where Python enters compiled kernels: arrays come in, and only where each begins goes on.

Inside, a sequence is a bare pointer: an index then costs one instruction instead of a check for a negative one, and a
call passes one number for a sequence instead of seven. One function for each number of arguments, because compiled
code can be kept only for functions that stand in a file.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core.extending import intrinsic


@intrinsic
def begin(typing: Any, value: Any) -> Any:
    """Return the pointer to an array's first element; any other value as it is."""
    if not isinstance(value, types.Array):
        return value(value), lambda context, builder, signature, arguments: arguments[0]

    def lower(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> Any:
        return context.make_array(value)(context, builder, arguments[0]).data

    return types.CPointer(value.dtype)(value), lower  # type: ignore[no-untyped-call]


def target(*arguments: Any) -> Any:
    """Stand for the kernel."""


def with_4(a0: Any, a1: Any, a2: Any, a3: Any) -> Any:
    return target(begin(a0), begin(a1), begin(a2), begin(a3))


def with_7(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, a5: Any, a6: Any) -> Any:
    return target(begin(a0), begin(a1), begin(a2), begin(a3), begin(a4), begin(a5), begin(a6))


def with_8(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, a5: Any, a6: Any, a7: Any) -> Any:
    return target(begin(a0), begin(a1), begin(a2), begin(a3), begin(a4), begin(a5), begin(a6), begin(a7))


def with_9(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, a5: Any, a6: Any, a7: Any, a8: Any) -> Any:
    return target(begin(a0), begin(a1), begin(a2), begin(a3), begin(a4), begin(a5), begin(a6), begin(a7), begin(a8))


def with_10(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, a5: Any, a6: Any, a7: Any, a8: Any, a9: Any) -> Any:
    return target(
        begin(a0), begin(a1), begin(a2), begin(a3), begin(a4), begin(a5), begin(a6), begin(a7), begin(a8), begin(a9)
    )


def with_11(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, a5: Any, a6: Any, a7: Any, a8: Any, a9: Any, a10: Any) -> Any:
    return target(
        begin(a0),
        begin(a1),
        begin(a2),
        begin(a3),
        begin(a4),
        begin(a5),
        begin(a6),
        begin(a7),
        begin(a8),
        begin(a9),
        begin(a10),
    )


def with_12(
    a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, a5: Any, a6: Any, a7: Any, a8: Any, a9: Any, a10: Any, a11: Any
) -> Any:
    return target(
        begin(a0),
        begin(a1),
        begin(a2),
        begin(a3),
        begin(a4),
        begin(a5),
        begin(a6),
        begin(a7),
        begin(a8),
        begin(a9),
        begin(a10),
        begin(a11),
    )


def with_14(
    a0: Any,
    a1: Any,
    a2: Any,
    a3: Any,
    a4: Any,
    a5: Any,
    a6: Any,
    a7: Any,
    a8: Any,
    a9: Any,
    a10: Any,
    a11: Any,
    a12: Any,
    a13: Any,
) -> Any:
    return target(
        begin(a0),
        begin(a1),
        begin(a2),
        begin(a3),
        begin(a4),
        begin(a5),
        begin(a6),
        begin(a7),
        begin(a8),
        begin(a9),
        begin(a10),
        begin(a11),
        begin(a12),
        begin(a13),
    )


def with_15(
    a0: Any,
    a1: Any,
    a2: Any,
    a3: Any,
    a4: Any,
    a5: Any,
    a6: Any,
    a7: Any,
    a8: Any,
    a9: Any,
    a10: Any,
    a11: Any,
    a12: Any,
    a13: Any,
    a14: Any,
) -> Any:
    return target(
        begin(a0),
        begin(a1),
        begin(a2),
        begin(a3),
        begin(a4),
        begin(a5),
        begin(a6),
        begin(a7),
        begin(a8),
        begin(a9),
        begin(a10),
        begin(a11),
        begin(a12),
        begin(a13),
        begin(a14),
    )


def with_16(
    a0: Any,
    a1: Any,
    a2: Any,
    a3: Any,
    a4: Any,
    a5: Any,
    a6: Any,
    a7: Any,
    a8: Any,
    a9: Any,
    a10: Any,
    a11: Any,
    a12: Any,
    a13: Any,
    a14: Any,
    a15: Any,
) -> Any:
    return target(
        begin(a0),
        begin(a1),
        begin(a2),
        begin(a3),
        begin(a4),
        begin(a5),
        begin(a6),
        begin(a7),
        begin(a8),
        begin(a9),
        begin(a10),
        begin(a11),
        begin(a12),
        begin(a13),
        begin(a14),
        begin(a15),
    )
