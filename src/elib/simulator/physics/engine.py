"""One source, two engines: kernels run as they stand, or compiled by Numba with the extra ``compiled``.

A kernel is a plain function marked with :func:`kernel`. Interpreted, it is called as it is, on lists of objects.
Compiled, it and every kernel that it calls are compiled by Numba, on arrays of the same records
(:mod:`elib.simulator.physics.records`). Both give the same result to the last bit, because neither may reorder a sum.

A kernel that needs a function of the user takes it as an argument, and calls it by :func:`call`. Compiled, the
argument is the function's address. So the kernels are compiled once for all, and their code is kept in the user's cache
folder; only the user's function is compiled again in each process, in about 0.1 s. The folder's name has a hash of the
source of all kernels and of the versions of NumPy and Numba: Numba checks only the file in which a function stands, not
the files of the functions that it calls.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import fields
from functools import cache
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryFile
from threading import Lock
from traceback import walk_tb
from types import CellType, FunctionType, MethodType
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, TypeVar, cast

from elib.base import body
from elib.base.errors import SimulationError
from elib.base.extras import install
from elib.simulator.physics.records import SIZE
from elib.simulator.physics.usage import constants_of, used_by

if TYPE_CHECKING:
    from numpy.typing import NDArray

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

Use: TypeAlias = Literal["entrance", "parallel", "inner"]
"""How a kernel is called: from Python, from Python with threads, or from kernels."""

USES: Final[dict[Use, dict[str, bool]]] = {
    "entrance": {},
    "parallel": {"parallel": True, "_nrt": True},
    "inner": {"no_cpython_wrapper": True, "no_cfunc_wrapper": True},
}
"""Further options of the compiler."""

_one_loop = Lock()
_one_compiler = Lock()

_is_forked = False


def _forked() -> None:
    """Do without threads in a process that another one forked: Numba's threads do not survive that."""
    global _is_forked, _one_loop, _one_compiler
    _is_forked, _one_loop, _one_compiler = True, Lock(), Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)

_kernels: set[FunctionType] = set()
_phases: set[FunctionType] = set()
_copies: set[FunctionType] = set()
_compiled_as: dict[FunctionType, FunctionType] = {}


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


def compiled_as(other: Callable[..., Any]) -> Callable[[F], F]:
    """Mark a function of which compiled kernels call another form."""

    def mark(function: F) -> F:
        _compiled_as[cast("FunctionType", function)] = cast("FunctionType", other)
        return function

    return mark


def call(function: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    """Call a function of the user that a kernel was given (:meth:`Engine.argument`). It returns nothing."""
    function(*arguments)


def opened(kept: Any) -> Any:
    """Return what :meth:`Engine.kept` has kept."""
    return kept


def loop(count: int) -> range:
    """Return ``range(count)``: compiled with threads, its turns run at the same time. Only Python calls its kernel."""
    return range(count)


class Engine:
    """How kernels run, and what their records are: interpreted, as they stand, on lists of objects."""

    name: EngineName = "interpreted"

    def records(self, kind: type[R], rows: Sequence[R]) -> Sequence[R]:
        """Return *rows* in the form that kernels take."""
        return list(rows)

    def blank(self, kind: type[R], count: int) -> Sequence[R]:
        """Return *count* records in the form that kernels take, not filled in yet."""
        return [kind() for _ in range(count)]

    def ints(self, values: Sequence[int], room: int = 0) -> Any:
        """Return *values*, each below 2**31, and *room* zeros, in the form that kernels take."""
        return [*values, *[0] * room]

    def table(self, rows: Any) -> Any:
        """Return rows of floats in the form that kernels take."""
        # Without NumPy, which a program that only drives never loads.
        return rows.tolist() if hasattr(rows, "tolist") else [[float(number) for number in row] for row in rows]

    def column(self, kind: type, rows: Sequence[Any], name: str) -> NDArray[Any]:
        """Return one field of all *rows*, records of one *kind*, as an array; compiled, it is the memory itself."""
        import numpy as np

        field = dtype_of(kind)[name]
        return np.array([getattr(row, name) for row in rows], dtype=field.base).reshape(len(rows), *field.shape)

    def tuples(self, rows: Sequence[Any], *names: str) -> list[tuple[Any, ...]]:
        """Return these fields of all *rows*, numbers of Python: two or more."""
        return list(map(attrgetter(*names), rows))

    def argument(
        self, function: Callable[..., None], like: Callable[[], tuple[object, ...]], *, checks_indices: bool = False
    ) -> Any:
        """Return a function of the user in the form in which kernels take it, for :func:`call`.

        Args:
            function: The function.
            like: Returns such arguments as it will get.
            checks_indices: Whether an index that is out of its range is an IndexError, compiled, too.

        Raises:
            SimulationError: It cannot be compiled.
        """
        return function

    def kept(self, parts: R) -> R:
        """Return a short form of a tuple of many arrays, whose kernels look into it by :func:`opened`.

        Compiled, to pass so many arrays takes longer than a few ticks. The tuple must live as long as its short form,
        and all that are kept must be of one type.
        """
        return parts

    def ready(self, function: F, *, threads: int = 1) -> F:
        """Return a kernel in the form in which this engine runs it.

        Args:
            function: The kernel.
            threads: How many run the turns of its :func:`loop`.
        """
        return function

    def threads(self, count: int) -> AbstractContextManager[None]:
        """Return a context in which so many threads run the turns of a :func:`loop`."""
        return nullcontext()

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return engine_named, (self.name,)


class Compiled(Engine):
    """Kernels compiled by Numba, on structured arrays.

    Raises:
        SimulationError: Numba is not installed.
    """

    name: EngineName = "compiled"

    def __init__(self) -> None:
        if importlib.util.find_spec("numba") is None:
            raise SimulationError("the compiled engine needs Numba, which is not installed", hint=install("compiled"))
        self._folder = _cache_folder()
        self._is_kept = _is_writable(self._folder)
        self._dispatchers: dict[tuple[FunctionType, Use], Any] = {}
        self._addresses: dict[tuple[object, ...], Any] = {}
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

    def table(self, rows: Any) -> Any:
        """Return an array."""
        import numpy as np

        return np.array(rows, dtype=np.float64)

    def column(self, kind: type, rows: Sequence[Any], name: str) -> NDArray[Any]:
        """Return the field's part of the memory."""
        import numpy as np

        return np.asarray(cast("Any", rows)[name])

    def tuples(self, rows: Sequence[Any], *names: str) -> list[tuple[Any, ...]]:
        """Return these fields, read at once."""
        return cast("list[tuple[Any, ...]]", cast("Any", rows)[list(names)].tolist())

    def argument(
        self, function: Callable[..., None], like: Callable[[], tuple[object, ...]], *, checks_indices: bool = False
    ) -> Any:
        """Return the address of the compiled function; if anything that it uses has changed it is compiled again."""
        key = (checks_indices, *constants_of(cast("FunctionType", function), _kernels, set()))
        with _one_compiler:
            self._checks_indices = checks_indices
            if key not in self._addresses:
                numba: Any = importlib.import_module("numba")
                made = self._user_function(cast("FunctionType", function), {})
                made.compile(tuple(numba.typeof(each) for each in like()))
                result = made.overloads[made.signatures[0]]
                address = result.library.get_pointer_to_function(result.fndesc.llvm_func_name)
                self._addresses[key] = made, address
        return self._addresses[key][1]

    def kept(self, parts: R) -> R:
        """Return an array that holds what a compiled kernel gets of the tuple: pointers and shapes."""
        import numpy as np

        _kept_types[:] = [importlib.import_module("numba").typeof(parts)]
        kept: Any = np.zeros(KEPT, np.int64)
        self.ready(keep)(parts, kept)
        return cast("R", kept)

    def ready(self, function: F, *, threads: int = 1) -> F:
        """Return what compiles the function at its first call, or finds it in the cache."""
        with _one_compiler:
            return cast("F", self._kernel(function, "parallel" if threads > 1 and not _is_forked else "entrance"))

    def _kernel(self, function: Any, use: Use) -> Any:
        """Return what compiles a kernel; its code is read from the folder, or written there."""
        if (function, use) in self._dispatchers:
            return self._dispatchers[function, use]
        numba: Any = importlib.import_module("numba")
        turns = numba.prange if use == "parallel" else range
        copy = _copy(function, lambda value: turns if value is loop else self._stand_in(value, {}))
        copy.__qualname__ += f"_{use}"  # of two functions of one name, Numba could take one for the other
        _copies.add(copy)
        options = {**OPTIONS, **USES[use]} | ({"forceinline": function not in _phases} if use == "inner" else {})
        before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(self._folder)
        try:
            # Numba never finds a function again that refers to others by its closure.
            is_kept = self._is_kept and not function.__closure__
            self._dispatchers[function, use] = numba.njit(cache=is_kept, **options)(copy)
        finally:
            numba.config.CACHE_DIR = before
        return self._dispatchers[function, use]

    def _user_function(self, function: FunctionType, built: dict[FunctionType, Any]) -> Any:
        """Return Numba's dispatcher of a user's function. *built* has one for each function; None while it is built."""
        if function not in built:
            built[function] = None
            copy = _copy(function, lambda value: self._stand_in(value, built))
            checked = {**OPTIONS, "boundscheck": self._checks_indices}
            built[function] = importlib.import_module("numba").njit(**checked, **USES["inner"], forceinline=True)(copy)
        if built[function] is None:
            raise SimulationError(
                f"{function.__qualname__!r} calls itself, which cannot be compiled",
                hint=f"use a loop, or {INTERPRETED}",
            )
        return built[function]

    def _stand_in(self, value: Any, built: dict[FunctionType, Any]) -> Any:
        """Return what stands for *value* in a compiled function: functions are compiled, too."""
        if isinstance(value, FunctionType) and value in (call, opened, put):
            return _intrinsics()[value]
        value = getattr(value, "py_func", value)  # Numba's own is compiled again, for this engine.
        if isinstance(value, MethodType) or (callable(value) and not hasattr(value, "__name__")):
            raise SimulationError(
                f"{value!r} cannot be compiled: it is not a plain function", hint="define it with def"
            )
        if not isinstance(value, FunctionType):
            return value
        value = _compiled_as.get(value, value)
        return self._kernel(value, "inner") if value in _kernels else self._user_function(value, built)

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


KEPT: Final = 1024
"""Words of memory for what is kept: a course of episodes takes about 500."""

_kept_types: list[Any] = []
"""The one type of what is kept, as the compiler knows it."""


def put(parts: Any, kept: Any) -> None:
    """Write what a compiled kernel got of a tuple into an array."""


@kernel
def keep(parts: Any, kept: Any) -> None:
    """Write what a compiled kernel gets of a tuple into an array."""
    put(parts, kept)


@cache
def _intrinsics() -> dict[Callable[..., Any], Any]:
    """Return what stands for :func:`call`, :func:`put` and :func:`opened` in compiled kernels."""
    numba: Any = importlib.import_module("numba")
    intrinsic: Any = importlib.import_module("numba.extending").intrinsic
    cgutils: Any = importlib.import_module("numba.core.cgutils")
    void = numba.types.void

    def place(context: Any, builder: Any, array: Any, value: Any, kind: Any) -> Any:
        """Return a pointer to the memory of an array as one to a value of a *kind*."""
        like = context.get_value_type(kind)
        assert context.get_abi_sizeof(like) <= 8 * KEPT
        return builder.bitcast(context.make_array(array)(context, builder, value).data, like.as_pointer())

    def parts_at(builder: Any, pointer: Any) -> Any:
        """Return the value behind a pointer, each part loaded by itself: the compiler leaves out those of no use."""
        kind = pointer.type.pointee
        if not hasattr(kind, "elements") and not hasattr(kind, "count"):
            return builder.load(pointer)
        value = cgutils.get_null_value(kind)
        for k in range(len(kind)):
            value = builder.insert_value(value, parts_at(builder, cgutils.gep_inbounds(builder, pointer, 0, k)), k)
        return value

    @intrinsic  # type: ignore[untyped-decorator]
    def compiled_call(typing: Any, address: Any, arguments: Any) -> Any:
        """Call the function at an address."""

        def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            convention = context.call_conv
            kind = convention.get_function_type(void, tuple(arguments)).as_pointer()
            function, given = builder.inttoptr(values[0], kind), cgutils.unpack_tuple(builder, values[1])
            status, _ = convention.call_function(builder, function, void, tuple(arguments), given)
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return context.get_dummy_value()

        return void(address, arguments), lower

    @intrinsic  # type: ignore[untyped-decorator]
    def compiled_put(typing: Any, parts: Any, kept: Any) -> Any:
        def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            builder.store(values[0], place(context, builder, kept, values[1], parts))
            return context.get_dummy_value()

        return void(parts, kept), lower

    @intrinsic  # type: ignore[untyped-decorator]
    def compiled_opened(typing: Any, kept: Any) -> Any:
        def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return parts_at(builder, place(context, builder, kept, values[0], signature.return_type))

        return _kept_types[0](kept), lower

    return {call: compiled_call, put: compiled_put, opened: compiled_opened}


def _copy(function: FunctionType, replaced: Callable[[Any], Any]) -> FunctionType:
    """Return *function* with other values of all that it uses."""
    used = {name: replaced(value) for name, value in used_by(function).items()}
    cells = tuple(CellType(used[name]) for name in function.__code__.co_freevars)
    names = {**function.__globals__, **used}
    copy = FunctionType(function.__code__, names, function.__name__, function.__defaults__, cells or None)
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    copy.__kwdefaults__ = function.__kwdefaults__
    return copy


@cache
def dtype_of(kind: type) -> Any:
    """Return the NumPy type with the fields of a record: all are 8 bytes wide."""
    import numpy as np

    columns = []
    for entry in fields(kind):
        size = entry.metadata.get(SIZE)
        zero = entry.default if size is None else cast("Any", entry.default_factory)()[0]
        columns.append((entry.name, "f8" if isinstance(zero, float) else "i8", *([(size,)] if size else [])))
    return np.dtype(columns, align=True)


@contextmanager
def explained(what: str, instead: str) -> Iterator[None]:
    """Say why *what* cannot be compiled, if that is the error of the block, and what to do *instead*.

    Raises:
        SimulationError: It cannot.
    """
    try:
        yield
    except Exception as error:
        reason = not_compiled(error)
        if reason is None:
            raise
        hint = f"keep to numbers, loops and comparisons, make no lists or arrays{instead}"
        raise SimulationError(f"{what} cannot be compiled: {reason}", hint=hint) from error


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
    from importlib.metadata import version  # here: only compiled worlds need it

    digest = hashlib.blake2b(digest_size=8)
    for package in ("numba", "numpy"):
        digest.update(version(package).encode())
    for module in (body.__file__, __file__):  # kernels keep the measures in elib.base as constants
        for file in sorted(Path(module).parent.rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()


_is_announced = False


def _announce_compilation() -> None:
    """Say on stderr that kernels are being compiled, when they are for the first time: it takes a while."""
    event: Any = importlib.import_module("numba.core.event")

    class Announcer(event.Listener):  # type: ignore[misc]  # Numba's events are untyped
        def on_start(self, happening: Any) -> None:
            global _is_announced
            if not _is_announced and happening.data["dispatcher"].py_func in _copies:
                _is_announced = True
                print("elib: compiling the simulator, once for this machine ...", file=sys.stderr)

        def on_end(self, happening: object) -> None:
            """The program goes on."""

    if not _is_announced:
        event.register("numba:compile", Announcer())


@cache
def engine_named(name: str) -> Engine:
    """Return the engine called *name*.

    Raises:
        SimulationError: No engine has this name, or what it needs is not installed.
    """
    if name == "interpreted":
        return Engine()
    if name == "compiled":
        return Compiled()
    raise SimulationError(f"there is no engine {name!r}", hint='choose "interpreted" or "compiled"')
