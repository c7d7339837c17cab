"""Kernels for the interpreted engine, folded: one function instead of many that call each other.

Interpreted, a call costs as much as five products, and a name of the module as much as one. Folding takes a kernel's
source and evaluates beforehand what can be known before the run (partial evaluation): constants and what is computed
from them become literals, short loops over a known range are written out, branches on known conditions are dropped, and
the kernels that it calls are written in their places. What remains does the same operations on the same numbers in the
same order, so the result is the same to the last bit; nothing here assumes any law of arithmetic but that ``i + 2 + 3``
is ``i + 5`` for an index.
"""

from __future__ import annotations

import builtins
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any

from elib.physics.folder import FACTORY, Elements, Folder
from elib.physics.syntax import CannotFold


class Program:
    """Folded kernels that call each other, for runs in which the same elements are settled.

    A kernel is folded when it is first called.
    """

    def __init__(self, settled: Elements, kernels: set[FunctionType], inner: set[FunctionType]) -> None:
        """Set up a program of nothing.

        Args:
            settled: Elements of the kernels' parameters of these names that stay what they are.
            kernels: All functions that may be folded.
            inner: Those of them that are written wherever they are called.
        """
        self._settled = settled
        self._kernels, self._inner = kernels, inner
        self._names: dict[str, object] = {"__builtins__": builtins, "__name__": __name__}
        self._folded: dict[tuple[object, ...], Callable[..., Callable[..., Any]]] = {}
        self._found: dict[tuple[int, str], tuple[dict[str, object], str, object]] = {}

    def function(self, kernel: FunctionType, laws: Mapping[str, Callable[..., Any]]) -> Callable[..., Any]:
        """Return *kernel*, folded, with these functions in the places of its globals of these names.

        Raises:
            CannotFold: It does something that folding does not know.
        """
        known = {name: law for name, law in laws.items() if isinstance(law, FunctionType) and law in self._kernels}
        given = {name: law for name, law in laws.items() if name not in known}
        key = (kernel, *known.items(), *given)
        if key not in self._folded:
            folder = Folder(self, known, tuple(given), self._settled, self._kernels, self._inner)
            code = folder.fold(kernel)
            made: dict[str, Callable[..., Callable[..., Any]]] = {}
            exec(code, self._names, made)  # Defines a function of the given laws that returns the folded kernel.
            self._folded[key] = made[FACTORY]
        return self._folded[key](**given)

    def is_current(self) -> bool:
        """Return whether every module still has under each name what was found there."""
        return all(names.get(name) is found for names, name, found in self._found.values())

    def note(self, names: dict[str, object], name: str, found: object) -> None:
        """Note that *found* was found in *names*."""
        self._found[id(names), name] = names, name, found

    def named(self, name: str, found: object) -> str:
        """Return the name under which folded kernels find *found*, a kernel as it will be folded."""
        key = f"{name}__{str(getattr(found, '__module__', '')).replace('.', '_')}"  # No local name of a kernel.
        if key not in self._names and isinstance(found, FunctionType) and found in self._kernels:
            self._names[key] = self._unfolded(found, key)
        self._names.setdefault(key, found)
        return key

    def _unfolded(self, kernel: FunctionType, name: str) -> Callable[..., Any]:
        """Return what stands for a kernel until it is first called."""

        def first(*arguments: object) -> object:
            try:
                self._names[name] = folded = self.function(kernel, {})
            except CannotFold:
                self._names[name] = folded = kernel
            return folded(*arguments)

        return first
