"""One source, two speeds: kernels run as they stand, or compiled by Numba with the extra ``swarm``.

A kernel is a plain function marked with :func:`kernel`. Interpreted, it is called as it is, on lists. Compiled, it
is copied with every kernel it calls replaced by that one's compiled form, and works on arrays; both give the same
result to the last bit, since neither may reorder a sum. Compiled code is kept in the user's cache folder, by the text
of all kernels, so that a change to any of them leaves no stale code behind.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FunctionType
from typing import Any, Final, Generic, Literal, ParamSpec, Protocol, TypeAlias, TypeVar, cast

from elib import body
from elib.errors import ArgumentError, SimulationError, install
from elib.physics.folding import Program
from elib.physics.layout import ROBOTS, Floats, Ints
from elib.physics.settled import Settled, literals, settled_in
from elib.physics.syntax import CannotFold

P = ParamSpec("P")
T = TypeVar("T")

EngineName: TypeAlias = Literal["interpreted", "compiled"]


LINE = 64
"""Bytes of a line of the cache."""

WARM: Final = 5000
"""Robots sensed or moved for a tick before a kernel is folded, which takes as long as so many take longer without."""

_kernels: set[FunctionType] = set()
_inner: set[FunctionType] = set()
_forms: dict[FunctionType, str] = {}


def kernel(function: Callable[P, T]) -> Callable[P, T]:
    """Mark *function* as one that Numba can compile, and that other kernels may call."""
    _kernels.add(cast("FunctionType", function))
    return function


def inner_kernel(function: Callable[P, T]) -> Callable[P, T]:
    """Mark *function* as a kernel that is compiled into those that call it: a short one in an inner loop."""
    _inner.add(cast("FunctionType", function))
    return kernel(function)


def interpreted_kernel(function: Callable[P, T]) -> Callable[P, T]:
    """Mark *function* as one that only the interpreted engine runs, folded into those that call it."""
    return inner_kernel(function)


def compiled_as(form: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Mark a kernel that another one replaces when it is compiled; both give the same to the last bit.

    Args:
        form: The other one, as ``module:function``. Only the compiled engine imports it: it may need Numba.
    """

    def mark(function: Callable[P, T]) -> Callable[P, T]:
        _forms[cast("FunctionType", function)] = form
        return kernel(function)

    return mark


def _form(function: FunctionType) -> FunctionType:
    """Return the kernel that is compiled in place of *function*: itself, unless it has another form."""
    if function not in _forms:
        return function
    module, _, name = _forms[function].partition(":")
    return cast("FunctionType", getattr(importlib.import_module(module), name))


class Engine(Protocol):
    """How kernels run, and what their sequences are."""

    name: EngineName

    def floats(self, values: Sequence[float]) -> Floats:
        """Return *values* as the engine's flat sequence of floats."""

    def ints(self, values: Sequence[int]) -> Ints:
        """Return *values* as the engine's flat sequence of integers."""

    def ready(self, function: Callable[P, T]) -> Callable[P, T]:
        """Return a kernel in the form in which this engine runs it."""

    def bare(self, function: Callable[P, T], **laws: Callable[..., Any]) -> Callable[P, T]:
        """Return the same for a kernel that never asks how long a sequence is: faster, as it gets no lengths.

        Args:
            function: The kernel.
            laws: Functions that take the places of the globals of these names in it.
        """


class Interpreted:
    """Kernels on lists: as they stand, or folded (:mod:`elib.physics.folding`) once a run is long enough to gain."""

    name: EngineName = "interpreted"

    def __init__(self) -> None:
        self._programs: dict[Settled, Program] = {}
        self._done: dict[tuple[FunctionType, Settled], int] = {}

    def floats(self, values: Sequence[float]) -> Floats:
        """Return a list of floats."""
        return [float(value) for value in values]

    def ints(self, values: Sequence[int]) -> Ints:
        """Return a list of integers."""
        return list(values)

    def ready(self, function: Callable[P, T]) -> Callable[P, T]:
        """Return the function itself."""
        return function

    def bare(self, function: Callable[P, T], **laws: Callable[..., Any]) -> Callable[P, T]:
        """Return what runs the function with these laws in place, folded when that pays."""
        kernel = cast("FunctionType", function)
        plain = cast("Callable[P, T]", _copy(kernel, laws)) if laws else function
        if kernel in _kernels and {"fixed", "numbers"} <= set(_parameters(kernel)):
            return Warming(self, kernel, laws, plain)
        return plain

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return engine_named, (self.name,)

    def done(self, kernel: FunctionType, settled: Settled, steps: int) -> int:
        """Return how many steps this kernel has done for such worlds, with these *steps*."""
        done = self._done[kernel, settled] = self._done.get((kernel, settled), 0) + steps
        return done

    def folded(
        self, kernel: FunctionType, laws: dict[str, Callable[..., Any]], settled: Settled
    ) -> Callable[..., Any] | None:
        """Return a folded kernel, or None if it cannot be folded or another kernel has come into its place since."""
        if settled not in self._programs:
            self._programs[settled] = Program(literals(settled), _kernels, _inner)
        program = self._programs[settled]
        try:
            return program.function(kernel, laws) if program.is_current() else None
        except CannotFold:
            return None


class Warming(Generic[P, T]):
    """Runs a kernel as it stands until so much was done that folding pays.

    Args:
        engine: Counts, and folds.
        kernel: The kernel.
        laws: Functions that take the places of its globals of these names.
        plain: The kernel with these laws.
    """

    def __init__(
        self, engine: Interpreted, kernel: FunctionType, laws: dict[str, Callable[..., Any]], plain: Callable[P, T]
    ) -> None:
        self._engine, self._kernel, self._laws, self._plain = engine, kernel, laws, plain
        places = _parameters(kernel)
        self._fixed_at, self._numbers_at = places.index("fixed"), places.index("numbers")
        self._ticks_at = places.index("ticks") if "ticks" in places else None
        self._settled: Settled | None = None
        self._chosen: Callable[P, T] | None = None

    def __call__(self, *arguments: P.args, **named: P.kwargs) -> T:
        """Run the kernel; its arguments stand in their order."""
        numbers: Any = arguments[self._numbers_at]
        now = settled_in(cast("Any", arguments[self._fixed_at]), numbers)
        if now != self._settled:
            self._settled, self._chosen = now, None
        if self._chosen is None:
            ticks: Any = arguments[self._ticks_at] if self._ticks_at is not None else None
            steps = 1 if ticks is None else numbers[ROBOTS] * ticks
            if self._engine.done(self._kernel, now, steps) < WARM:
                return self._plain(*arguments, **named)
            self._chosen = self._engine.folded(self._kernel, self._laws, now) or self._plain
        return self._chosen(*arguments, **named)

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        # What was folded is made anew: a function that was made in a run has no name to be found by.
        return _warming, (self._kernel, self._laws)


def _warming(kernel: Callable[..., T], laws: dict[str, Callable[..., Any]]) -> Callable[..., T]:
    return engine_named("interpreted").bare(kernel, **laws)


def _parameters(function: FunctionType) -> tuple[str, ...]:
    return function.__code__.co_varnames[: function.__code__.co_argcount]


class Compiled:
    """Kernels compiled by Numba, on arrays of 64-bit numbers.

    Raises:
        SimulationError: Numba is not installed.
    """

    name: EngineName = "compiled"

    def __init__(self) -> None:
        if importlib.util.find_spec("numba") is None:
            raise SimulationError("the compiled engine needs Numba, which is not installed", hint=install("swarm"))
        self._ready: dict[tuple[object, ...], Callable[..., Any]] = {}
        self._cache = _cache_folder()
        _announce_compilation()

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return engine_named, (self.name,)

    def floats(self, values: Sequence[float]) -> Floats:
        """Return an array of 64-bit floats."""
        return cast("Floats", _aligned(values, "float64"))

    def ints(self, values: Sequence[int]) -> Ints:
        """Return an array of 64-bit integers."""
        return cast("Ints", _aligned(values, "int64"))

    def ready(self, function: Callable[P, T]) -> Callable[P, T]:
        """Return the compiled function; it is compiled at its first call."""
        return self._compiled(cast("FunctionType", function), {})

    def bare(self, function: Callable[P, T], **laws: Callable[..., Any]) -> Callable[P, T]:
        """Return the compiled function; inside, a sequence is a bare pointer."""
        for law in laws.values():
            if not isinstance(law, FunctionType):
                raise ArgumentError(
                    f"{law!r} cannot be compiled as a law: it is no plain function", hint="define it with def"
                )
        return self._entrance(cast("FunctionType", function), laws)

    def _compiled(self, function: FunctionType, laws: dict[str, Callable[..., Any]]) -> Callable[..., Any]:
        function = _form(function)
        key = (function, *laws.items())
        if key in self._ready:
            return self._ready[key]
        names = {
            name: self._compiled(value, {})
            for name, value in function.__globals__.items()
            if name in function.__code__.co_names and isinstance(value, FunctionType) and value in _kernels
        }
        names |= {name: self._compiled(cast("FunctionType", law), {}) for name, law in laws.items()}
        own = all(cast("FunctionType", law) in _kernels for law in laws.values()) and (laws or function in _kernels)
        copy = _copy(function, names)
        copy.__qualname__ = "_".join([function.__qualname__, *(law.__name__ for law in laws.values())])
        self._ready[key] = _jit(copy, self._cache if own else None, is_inner=function in _inner)
        return self._ready[key]

    def _entrance(self, function: FunctionType, laws: dict[str, Callable[..., Any]]) -> Callable[..., Any]:
        """Return what Python calls: it takes arrays and hands on where they begin."""
        key = ("entrance", function, *laws.items())
        if key not in self._ready:
            from elib.physics import entrances

            shim = getattr(entrances, f"with_{function.__code__.co_argcount}")
            copy = _copy(shim, {"target": self._compiled(function, laws)})
            copy.__qualname__ = "_".join([function.__qualname__, *(law.__name__ for law in laws.values()), "entrance"])
            own = all(law in _kernels for law in laws.values()) and function in _kernels
            self._ready[key] = _jit(copy, self._cache if own else None)
        return self._ready[key]


def _aligned(values: Sequence[float], kind: str) -> Any:
    """Return an array of 8-byte numbers that begins where a line of the cache does.

    Eight numbers that the layout puts at a multiple of eight are then one line, and not parts of two.
    """
    import numpy as np

    room = np.empty(len(values) + LINE // 8, dtype=kind)
    first = -room.ctypes.data % LINE // 8
    array = room[first : first + len(values)]
    array[:] = values
    return array


def _copy(function: FunctionType, names: dict[str, Callable[..., Any]]) -> FunctionType:
    copy = FunctionType(
        function.__code__,
        {**function.__globals__, **names},
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )
    copy.__module__, copy.__doc__ = function.__module__, function.__doc__
    return copy


def _jit(function: FunctionType, cache: Path | None, *, is_inner: bool = False) -> Callable[..., Any]:
    """Return *function* compiled at its first call; *cache* keeps the code, None compiles anew in each program."""
    numba: Any = importlib.import_module("numba")

    # "numpy" leaves out the check of each division; kernels never divide by zero. The lock is free meanwhile, so
    # that worlds run side by side.
    options = {"nogil": True, "error_model": "numpy", "boundscheck": False, "_nrt": False, "forceinline": is_inner}
    if cache is None:
        return cast("Callable[..., Any]", numba.njit(**options)(function))
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(cache)
    try:
        return cast("Callable[..., Any]", numba.njit(cache=True, **options)(function))
    except RuntimeError:  # The folder cannot be written: compiled anew in each program.
        return cast("Callable[..., Any]", numba.njit(**options)(function))
    finally:
        numba.config.CACHE_DIR = before


def _cache_folder() -> Path:
    """Return where compiled code of exactly these kernels is kept."""
    digest = hashlib.blake2b(digest_size=8)
    for file in (Path(body.__file__), *sorted(Path(__file__).parent.rglob("*.py"))):
        digest.update(file.read_bytes())
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData/Local")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "elib" / f"kernels-{digest.hexdigest()}"


_is_announced = False


def _announce_compilation() -> None:
    """Say on stderr that code is being compiled, when it is for the first time: it takes a while."""
    event: Any = importlib.import_module("numba.core.event")

    class Announcer(event.Listener):  # type: ignore[misc]  # Numba's events are untyped
        def on_start(self, happening: object) -> None:
            global _is_announced
            if not _is_announced:
                _is_announced = True
                once = "the simulator once, half a minute; a law of your own each time"
                print(f"elib: compiling for this machine ({once}) ...", file=sys.stderr)

        def on_end(self, happening: object) -> None:
            """Nothing to say: the program goes on."""

    if not _is_announced:
        event.register("numba:compile", Announcer())


_engines: dict[str, Engine] = {}


def engine_named(name: str) -> Engine:
    """Return the engine called *name*.

    Raises:
        SimulationError: There is none of that name, or what it needs is not installed.
    """
    if name not in ("interpreted", "compiled"):
        raise SimulationError(f"there is no engine {name!r}", hint='choose "interpreted" or "compiled"')
    if name not in _engines:
        _engines[name] = Interpreted() if name == "interpreted" else Compiled()
    return _engines[name]
