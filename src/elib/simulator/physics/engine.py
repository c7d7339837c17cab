"""One source, two engines: kernels run as they stand, or compiled by Numba with the extra ``compiled``.

A kernel is a plain function marked with :func:`kernel`. Interpreted, it is called as it is, on lists of objects.
Compiled, it and every kernel that it calls are compiled by Numba, on arrays of the same records
(:mod:`elib.simulator.physics.records`). Both give the same result to the last bit, because neither may reorder a sum.

Compiled code is kept in the user's cache folder. The folder's name covers the source of all kernels and the versions
of NumPy and Numba; that of a control function covers also its source, and the globals and closures that it uses.
"""

from __future__ import annotations

import dis
import hashlib
import importlib
import importlib.util
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import fields
from enum import EnumMeta
from functools import cache
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryFile
from threading import Lock
from traceback import walk_tb
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any, Final, Literal, Protocol, TypeAlias, TypeVar, cast

from elib.base import body
from elib.base.errors import SimulationError
from elib.base.extras import install
from elib.simulator.physics.records import SIZE

F = TypeVar("F", bound=Callable[..., Any])
R = TypeVar("R")

EngineName: TypeAlias = Literal["interpreted", "compiled"]

OPTIONS: Final = {
    "nogil": True,  # Worlds may run side by side in threads.
    "error_model": "numpy",  # No check of each division: kernels do not divide by zero.
    "boundscheck": False,
    "_nrt": False,  # Kernels make no arrays: without this, each use of a record's list counts references.
}

INTERPRETED: Final = (
    'the slower engine that does not compile, engine="interpreted", which elib.World and elib.learn.envs.TaskEnv take'
)
"""What runs any Python, for hints."""

INNER: Final = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Compiler options of kernels that only other kernels call."""

_one_loop = Lock()
_one_compiler = Lock()

_is_forked = False


def _forked() -> None:
    """Do without threads in a process that another one forked: what runs loops does not survive it."""
    global _is_forked, _one_loop, _one_compiler
    _is_forked, _one_loop, _one_compiler = True, Lock(), Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)

_kernels: set[FunctionType] = set()
_phases: set[FunctionType] = set()


def kernel(function: F) -> F:
    """Mark *function* as one that Numba can compile and that other kernels may call."""
    _kernels.add(cast("FunctionType", function))
    return function


def phase(function: F) -> F:
    """Mark *function* as a kernel that is called so seldom that it need not be compiled into its callers.

    That makes compiling faster.
    """
    _phases.add(cast("FunctionType", function))
    return kernel(function)


def nothing(*arguments: object) -> bool:
    """Stand for a kernel that a world does not need."""
    return False


def loop(count: int) -> range:
    """Return ``range(count)``: compiled with threads, its turns run at the same time."""
    return range(count)


class Engine(Protocol):
    """How kernels run, and what their records are."""

    name: EngineName

    def records(self, kind: type[R], rows: Sequence[R]) -> Sequence[R]:
        """Return *rows* in the form that kernels take."""

    def blank(self, kind: type[R], count: int) -> Sequence[R]:
        """Return *count* records in the form that kernels take, not filled in yet."""

    def ints(self, values: Sequence[int], room: int = 0) -> Any:
        """Return *values*, each below 2**31, and *room* zeros, in the form that kernels take."""

    def ready(
        self, function: F, *, threads: int = 1, absent: Sequence[str] = (), **substitutes: Callable[..., Any]
    ) -> F:
        """Return a kernel in the form in which this engine runs it.

        Args:
            function: The kernel.
            threads: How many run the turns of its :func:`loop`.
            absent: Names of kernels that are never needed in this world: what is not there need not be compiled.
            substitutes: Functions that take the places of the globals of these names in it.

        Raises:
            SimulationError: A control function cannot be compiled.
        """

    def threads(self, count: int) -> AbstractContextManager[None]:
        """Return a context in which so many threads run the turns of a :func:`loop`."""


class Interpreted:
    """Kernels as they stand, on lists of objects."""

    name: EngineName = "interpreted"

    def records(self, kind: type[R], rows: Sequence[R]) -> Sequence[R]:
        """Return a list of the objects themselves."""
        return list(rows)

    def blank(self, kind: type[R], count: int) -> Sequence[R]:
        """Return a list of new objects."""
        return [kind() for _ in range(count)]

    def ints(self, values: Sequence[int], room: int = 0) -> Any:
        """Return a list of whole numbers."""
        return [*values, *[0] * room]

    def ready(
        self, function: F, *, threads: int = 1, absent: Sequence[str] = (), **substitutes: Callable[..., Any]
    ) -> F:
        """Return the function, with *substitutes* in place; it runs in one thread."""
        return cast("F", _with_substitutes(cast("FunctionType", function), substitutes)) if substitutes else function

    def threads(self, count: int) -> AbstractContextManager[None]:
        """Return a context that does nothing."""
        return nullcontext()

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return engine_named, (self.name,)


def _with_substitutes(function: FunctionType, substitutes: dict[str, Callable[..., Any]]) -> FunctionType:
    """Return *function* with *substitutes* in place of its globals of these names, and in the kernels that it calls."""
    names = {name: substitutes[name] for name in _names_in(function.__code__) & substitutes.keys()}
    for name, called in _kernels_in(function):
        if name not in names and _reaches(called, frozenset(substitutes)):
            names[name] = _with_substitutes(called, substitutes)
    return _copy(function, names)


class Compiled:
    """Kernels compiled by Numba, on structured arrays.

    Raises:
        SimulationError: Numba is not installed.
    """

    name: EngineName = "compiled"

    def __init__(self) -> None:
        if importlib.util.find_spec("numba") is None:
            raise SimulationError("the compiled engine needs Numba, which is not installed", hint=install("compiled"))
        self._ready: dict[tuple[object, ...], Callable[..., Any]] = {}
        self._compilers: dict[str, _Compiler] = {}
        _announce_compilation()

    def records(self, kind: type[R], rows: Sequence[R]) -> Sequence[R]:
        """Return a structured array; from Python its entries have the same attributes as the objects."""
        import numpy as np

        names = [entry.name for entry in fields(cast("Any", kind))]
        made = [tuple(getattr(row, name) for name in names) for row in rows]
        return cast("Sequence[R]", np.array(made, dtype=dtype_of(cast("Any", kind))).view(np.recarray))

    def blank(self, kind: type[R], count: int) -> Sequence[R]:
        """Return a structured array of zeros."""
        import numpy as np

        return cast("Sequence[R]", np.zeros(count, dtype=dtype_of(cast("Any", kind))).view(np.recarray))

    def ints(self, values: Sequence[int], room: int = 0) -> Any:
        """Return an array of 32-bit whole numbers."""
        import numpy as np

        return np.concatenate([np.array(values, dtype=np.int32), np.zeros(room, dtype=np.int32)])

    def ready(
        self, function: F, *, threads: int = 1, absent: Sequence[str] = (), **substitutes: Callable[..., Any]
    ) -> F:
        """Return what compiles the function at its first call."""
        # A control function's digest changes with what it uses: Numba takes globals for constants.
        digests = tuple((name, digest_of(each)) for name, each in substitutes.items())
        is_parallel = threads > 1 and not _is_forked
        key = (function, is_parallel, absent, digests)
        with _one_compiler:
            if key not in self._ready:  # two threads that compile it twice would take twice as long
                compiler = self._compiler(None, {})
                compiler = self._compiler(compiler, dict.fromkeys(absent, nothing))
                if is_parallel or substitutes:
                    compiler = self._compiler(compiler, substitutes, is_parallel=is_parallel)
                self._ready[key] = compiler.entrance(cast("FunctionType", function))
        return cast("F", self._ready[key])

    def _compiler(
        self, base: _Compiler | None, substitutes: Mapping[str, Callable[..., Any]], *, is_parallel: bool = False
    ) -> _Compiler:
        made = _Compiler(base, substitutes, is_parallel=is_parallel)
        return self._compilers.setdefault(made.name, made)

    @contextmanager
    def threads(self, count: int) -> Iterator[None]:
        """Let so many threads run the turns of a :func:`loop`, no more than there are cores, and one loop at a time.

        Not every threading layer of Numba can run two of them at once.
        """
        if count == 1 or _is_forked:
            yield
            return
        numba: Any = importlib.import_module("numba")
        with _one_loop:
            before = numba.get_num_threads()
            numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))
            try:
                yield
            finally:
                numba.set_num_threads(before)

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return engine_named, (self.name,)


class _Compiler:
    """Compiles kernels and all that they call.

    Args:
        base: Compiles the kernels that no substitute and no thread changes; None if there are none of both here.
        substitutes: What takes the place of the globals of these names.
        is_parallel: Whether the turns of :func:`loop` run in threads.
    """

    def __init__(
        self, base: _Compiler | None, substitutes: Mapping[str, Callable[..., Any]], *, is_parallel: bool
    ) -> None:
        self._base = base
        self._is_parallel = is_parallel
        self._substitutes = {name: cast("FunctionType", each) for name, each in substitutes.items()}
        parts = [base.name if base else "", *(f"{name} {digest_of(each)}" for name, each in substitutes.items())]
        self.name: str = hashlib.blake2b(repr([*parts, is_parallel]).encode(), digest_size=8).hexdigest()
        self._folder = _cache_folder() / self.name
        self._is_kept = _is_writable(self._folder)
        self._made: dict[FunctionType, Callable[..., Any]] = {}
        self._begun: set[FunctionType] = set()

    def entrance(self, function: FunctionType) -> Callable[..., Any]:
        """Return *function* as Python calls it."""
        return self._jit(function, {})

    def inner(self, function: FunctionType) -> Callable[..., Any]:
        """Return *function* as kernels call it."""
        if self._base is not None and not self._differs(function):
            return self._base.inner(function)
        if function in self._begun:
            raise SimulationError(
                f"{function.__qualname__!r} calls itself, which cannot be compiled",
                hint=f"use a loop, or {INTERPRETED}",
            )
        if function not in self._made:
            self._begun.add(function)
            has_loop = self._is_parallel and "loop" in _names_in(function.__code__)
            options = (
                {"parallel": True, "_nrt": True} if has_loop else {**INNER, "forceinline": function not in _phases}
            )
            try:
                self._made[function] = self._jit(function, options)
            finally:
                self._begun.remove(function)
        return self._made[function]

    def _differs(self, function: FunctionType) -> bool:
        """Return whether a substitute or a thread changes *function* or anything that it calls."""
        names = frozenset([*self._substitutes, *(["loop"] if self._is_parallel else [])])
        return function not in _kernels or _reaches(function, names)

    def _jit(self, function: FunctionType, options: dict[str, bool]) -> Callable[..., Any]:
        """Return *function* compiled at its first call; its code is read from the folder, or written there."""
        numba: Any = importlib.import_module("numba")
        cells = tuple(CellType(self._replaced(function, cell.cell_contents)) for cell in function.__closure__ or ())
        names = {name: function.__globals__.get(name) for name in _names_in(function.__code__)}
        # In a control function, and in what it calls, a global may bear the name of a kernel by chance.
        substitutes = self._substitutes if function in _kernels else {}
        called: dict[str, Any] = {
            name: self._replaced(function, substitutes.get(name, value)) for name, value in names.items()
        }
        copy = _copy(function, {name: value for name, value in called.items() if value is not names[name]}, cells)
        # Two functions of one name would be mistaken for each other when their code is read from the cache.
        copy.__qualname__ += f"_{self.name}" if options else f"_{self.name}_entrance"
        if function not in _kernels:
            # Numba imports the module when it reads the code from the cache; this one may be a notebook's, or gone.
            copy.__qualname__, copy.__module__ = f"{function.__module__}_{copy.__qualname__}", __name__
        before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(self._folder)
        try:
            return cast("Callable[..., Any]", numba.njit(cache=self._is_kept, **{**OPTIONS, **options})(copy))
        except RuntimeError:  # A function without a file: compiled again in each program.
            return cast("Callable[..., Any]", numba.njit(**{**OPTIONS, **options})(copy))
        finally:
            numba.config.CACHE_DIR = before

    def _replaced(self, caller: FunctionType, value: object) -> object:
        """Return what stands for *value* in a compiled *caller*: kernels and the user's functions are compiled, too."""
        if value is loop:
            numba: Any = importlib.import_module("numba")
            return numba.prange if self._is_parallel else range
        is_own = caller not in _kernels or value in self._substitutes.values()
        if is_own:
            value = getattr(value, "py_func", value)  # Numba's own gets a name of its own, too.
        if isinstance(value, FunctionType) and (value in _kernels or is_own):
            return self.inner(value)
        return value


def _copy(
    function: FunctionType, names: dict[str, Callable[..., Any]], cells: tuple[CellType, ...] | None = None
) -> FunctionType:
    """Return *function* with other globals, and with other closure cells if any are given."""
    copy = FunctionType(
        function.__code__,
        {**function.__globals__, **names},
        function.__name__,
        function.__defaults__,
        cells or function.__closure__,
    )
    copy.__module__, copy.__doc__ = function.__module__, function.__doc__
    return copy


@cache
def dtype_of(kind: type) -> Any:
    """Return the NumPy type with the fields of a record: all are 8 bytes wide."""
    import numpy as np

    columns = []
    for entry in fields(kind):
        code = "f8" if "float" in str(entry.type) else "i8"
        columns.append((entry.name, code, (entry.metadata[SIZE],)) if SIZE in entry.metadata else (entry.name, code))
    return np.dtype(columns, align=True)


def not_compiled(error: Exception) -> str | None:
    """Return why Numba could not compile a function, and in which line; None if *error* is not about that."""
    *_, (frame, _) = walk_tb(error.__traceback__)
    if not str(frame.f_globals.get("__name__")).startswith("numba."):
        return None
    if not type(error).__module__.startswith("numba."):  # Of an unknown field, or a full disk.
        return repr(error)
    lines = str(error).splitlines()
    reasons = (line.strip() for line in lines if line.strip() and not line.startswith("Failed in nopython mode"))
    places = (re.fullmatch(r"During: .* at (.+) \((\d+)\)", line) for line in lines)
    place = next((f" ({Path(found[1]).name}, line {found[2]})" for found in places if found), "")
    reason = next(reasons, str(error))
    return (f"{reason} {next(reasons, '')}" if reason.endswith(":") else reason) + place


def digest_of(function: Callable[..., Any]) -> str:
    """Return a digest of a control function: its code, and all that it uses. That of a kernel is its name alone.

    Raises:
        SimulationError: It is not a plain function.
    """
    function = getattr(function, "py_func", function)  # Of Numba.
    if not isinstance(function, FunctionType):
        raise SimulationError(f"{function!r} cannot be compiled: it is not a plain function", hint="define it with def")
    digest = hashlib.blake2b(digest_size=8)
    for part in _parts_of(function, set()):
        digest.update(part.encode() + b"\0")
    return digest.hexdigest()


def _parts_of(function: FunctionType, known: set[object]) -> Iterator[str]:
    """Yield what makes a function what it is."""
    yield f"{function.__module__}.{function.__qualname__}"
    if function in _kernels or function in known:  # The folder's name covers the source of all kernels.
        return
    known.add(function)
    code = function.__code__
    yield _text_of(code)
    used = {name: function.__globals__[name] for name in _names_in(code) if name in function.__globals__}
    used |= zip(code.co_freevars, (cell.cell_contents for cell in function.__closure__ or ()), strict=True)
    yield from _told_apart(function.__defaults__, code, known)
    for name in sorted(used):
        yield name
        yield from _told_apart(used[name], code, known)


def _told_apart(value: Any, code: CodeType, known: set[object]) -> Iterator[str]:
    """Yield what tells a value that *code* uses apart from others."""
    value = getattr(value, "py_func", value)
    if isinstance(value, FunctionType):
        yield from _parts_of(value, known)
    elif isinstance(value, ModuleType | type) and not isinstance(value, EnumMeta):
        yield f"{value.__name__} {getattr(value, '__version__', '')}"
        if (value, code) not in known:
            known.add((value, code))
            for name in sorted(_attributes_in(code) & vars(value).keys()):
                yield name
                yield from _told_apart(vars(value)[name], code, known)
    elif isinstance(value, tuple | list):
        yield f"{type(value).__qualname__} {len(value)}"
        for part in value:
            yield from _told_apart(part, code, known)
    elif hasattr(value, "tobytes") and not isinstance(value, type):  # An array, or a number, of NumPy.
        yield f"{value.dtype} {value.shape} {value.strides} {value.tobytes().hex()}"
    elif hasattr(value, "__qualname__") and not isinstance(value, EnumMeta):  # Its text may say where it is in memory.
        yield f"{value.__module__}.{value.__qualname__}"
    else:
        yield repr(list(value) if isinstance(value, EnumMeta) else value)


@cache
def _text_of(code: CodeType) -> str:
    """Return what a function does, without where it stands in its file."""
    steps = (
        _text_of(step.argval) if isinstance(step.argval, CodeType) else f"{step.opname} {step.argval!r}"
        for step in dis.get_instructions(code)
    )
    return "\n".join(steps)


@cache
def _attributes_in(code: CodeType) -> frozenset[str]:
    """Return the names of all globals and attributes that a function uses, also within comprehensions."""
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return frozenset(code.co_names).union(*(_attributes_in(constant) for constant in inner))


def fields_read(function: Callable[..., Any]) -> frozenset[str]:
    """Return the names of all attributes that a function of the user, or one that it calls, takes of its arguments.

    What it takes of globals, such as a function of a module, is left out.
    """
    found: set[str] = set()
    left, known = [getattr(function, "py_func", function)], set()
    while left:
        each = left.pop()
        if not isinstance(each, FunctionType) or each in _kernels or each in known:
            continue
        known.add(each)
        found |= _fields_in(each.__code__)
        called = [each.__globals__.get(name) for name in _names_in(each.__code__)]
        called += [cell.cell_contents for cell in each.__closure__ or ()]
        left += [getattr(value, "py_func", value) for value in called]
    return frozenset(found)


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


@cache
def _names_in(code: CodeType) -> frozenset[str]:
    """Return the names of all globals that a function uses, also within comprehensions."""
    own = (step.argval for step in dis.get_instructions(code) if step.opname == "LOAD_GLOBAL")
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return frozenset(own).union(*(_names_in(constant) for constant in inner))


def _kernels_in(function: FunctionType) -> Iterator[tuple[str, FunctionType]]:
    """Yield the name and the kernel of each global of *function* that is a kernel."""
    for name in _names_in(function.__code__):
        value = function.__globals__.get(name)
        if isinstance(value, FunctionType) and value in _kernels:
            yield name, value


def _reaches(function: FunctionType, names: frozenset[str]) -> bool:
    """Return whether *function*, or a kernel that it calls, uses one of these globals."""
    own = _names_in(function.__code__)
    return not own.isdisjoint(names) or any(_reaches(called, names) for _, called in _kernels_in(function))


def _is_writable(folder: Path) -> bool:
    """Return whether files can be written to *folder*, which is made. Numba would choose another one without a word."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _cache_folder() -> Path:
    """Return where compiled code of exactly these kernels and versions is kept."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData/Local")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base, "elib", f"kernels-{_source_digest()}")


@cache
def _source_digest() -> str:
    digest = hashlib.blake2b(digest_size=8)
    for package in ("numba", "numpy"):
        digest.update(version(package).encode())
    for file in (Path(body.__file__), *sorted(Path(__file__).parent.rglob("*.py"))):
        digest.update(file.read_bytes())
    return digest.hexdigest()


_is_announced = False


def _announce_compilation() -> None:
    """Say on stderr that code is being compiled, when it is for the first time: it takes a while."""
    event: Any = importlib.import_module("numba.core.event")

    class Announcer(event.Listener):  # type: ignore[misc]  # Numba's events are untyped
        def on_start(self, happening: object) -> None:
            global _is_announced
            if not _is_announced:
                _is_announced = True
                print("elib: compiling for this machine, once for each control function ...", file=sys.stderr)

        def on_end(self, happening: object) -> None:
            """Nothing to say: the program goes on."""

    if not _is_announced:
        event.register("numba:compile", Announcer())


@cache
def engine_named(name: str) -> Engine:
    """Return the engine called *name*.

    Raises:
        SimulationError: No engine has this name, or what it needs is not installed.
    """
    if name == "interpreted":
        return Interpreted()
    if name == "compiled":
        return Compiled()
    raise SimulationError(f"there is no engine {name!r}", hint='choose "interpreted" or "compiled"')
