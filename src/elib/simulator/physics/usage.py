"""What a function of the user uses: its constants, and the fields that it reads."""

from __future__ import annotations

import dis
from collections.abc import Callable, Iterator
from functools import cache
from types import CodeType, FunctionType, ModuleType
from typing import Any


@cache
def _names_in(code: CodeType, *, are_globals: bool) -> frozenset[str]:
    """Return the names of the globals that a function uses, also within comprehensions, or of its attributes too."""
    steps = (step.argval for step in dis.get_instructions(code) if step.opname == "LOAD_GLOBAL")
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    own = frozenset(steps if are_globals else code.co_names)
    return own.union(*(_names_in(constant, are_globals=are_globals) for constant in inner))


def used_by(function: FunctionType) -> dict[str, Any]:
    """Return the globals and the variables of outer functions that *function* uses, by name."""
    known, cells = function.__globals__, function.__closure__ or ()
    used = {name: known[name] for name in _names_in(function.__code__, are_globals=True) if name in known}
    for name, cell in zip(function.__code__.co_freevars, cells, strict=True):
        used[name] = cell.cell_contents
    return used


def constants_of(function: FunctionType, kernels: set[FunctionType], known: set[object]) -> Iterator[object]:
    """Yield the code and the constants of a function, and of all that it calls: Numba takes what it uses for constants.

    Args:
        function: The function.
        kernels: Functions that never change.
        known: What was looked at already.
    """
    yield function.__code__
    if function in kernels or function in known:
        return
    known.add(function)
    yield repr(function.__defaults__)
    names = _names_in(function.__code__, are_globals=False)
    for name, value in used_by(function).items():
        yield name
        yield from _told_apart(value, names, kernels, known)


def _told_apart(value: Any, names: frozenset[str], kernels: set[FunctionType], known: set[object]) -> Iterator[object]:
    """Yield what tells a value apart from others; of a module or a class only what has one of the *names*."""
    value = getattr(value, "py_func", value)  # what Numba compiled already
    if isinstance(value, FunctionType):
        yield from constants_of(value, kernels, known)
    elif isinstance(value, ModuleType | type):
        yield repr(value)
        for name in names & vars(value).keys() if (value, names) not in known else ():
            known.add((value, names))
            yield from _told_apart(vars(value)[name], names, kernels, known)
    elif isinstance(value, tuple | list):
        yield len(value)
        for each in value:
            yield from _told_apart(each, names, kernels, known)
    elif hasattr(value, "tobytes"):  # an array or a number of NumPy
        yield from (str(value.dtype), value.shape, value.tobytes())
    else:
        yield repr(value)


def fields_read(function: Callable[..., Any], known: set[object]) -> frozenset[str]:
    """Return the names of all attributes that a function of the user, or one that it calls, takes of its arguments.

    What it takes of globals, such as a function of a module, is left out.

    Args:
        function: The function.
        known: What need not be looked at; what was looked at is added.
    """
    function = getattr(function, "py_func", function)
    if not isinstance(function, FunctionType) or function in known:
        return frozenset()
    known.add(function)
    called = used_by(function).values()
    return _fields_in(function.__code__).union(*(fields_read(each, known) for each in called if callable(each)))


@cache
def _fields_in(code: CodeType) -> frozenset[str]:
    """Return the names of the attributes of all but globals, also within comprehensions."""
    found: set[str] = set()
    is_global = False
    for step in dis.get_instructions(code):
        if step.opname in ("LOAD_ATTR", "LOAD_METHOD"):
            if not is_global:
                found.add(step.argval)
        else:
            is_global = step.opname in ("LOAD_GLOBAL", "LOAD_DEREF")
    return frozenset(found).union(*(_fields_in(each) for each in code.co_consts if isinstance(each, CodeType)))
