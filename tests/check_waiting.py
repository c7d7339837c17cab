"""Refuse tests that race: short sleeps and bounds, clocks, ports that others may have, and pages that are left.

``make check`` runs it. A line that only looks like a race, or a function, or a file, says why in a comment::

    await asyncio.sleep(1)  # clock: simulated
    async def main() -> None:  # clock: simulated
    # clock: simulated

A question to a page that is just left has no answer: ``reload``, ``go`` and ``until`` of a tab wait for the next page.

A function whose decorator is ``simulated``, or ``inside`` of ``tests/shared.py``, needs none: there, waiting takes no
wall time and is exact.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).parent
BOUND = 60.0
"""s. A bound on what is waited for is at least as long."""
HELPER = "use until(...) or wait_until(...) of tests/shared.py, or prove it in simulated time or by counting"
SLEEPS = {"asyncio.sleep", "time.sleep", "anyio.sleep"}
CLOCKS = {f"time.{name}" for name in ("time", "monotonic", "perf_counter")}
BOUNDED = {"asyncio.timeout": 0, "asyncio.wait_for": 1, "concurrent.futures.wait": 1}
"""Functions that wait, and which of their arguments is the bound."""
WAITING = {"wait": 0, "join": 0, "result": 0, "exception": 0, "settimeout": 0, "communicate": 1, "select": 3}
"""Methods that wait, and which of their arguments is the bound."""
KEYWORD = {"run", "check_output", "urlopen", "open", "wait_procs", "wait_for", "create_connection", "get", *WAITING}
"""Functions and methods that take their bound as ``timeout=``."""
OURS = ("elib.", "robot.", "ada.", "bob.")
"""What waits here belongs to the library: its own timeouts are what is tested."""
LEAVING = re.compile(r"location\.(reload|assign|replace)\(|location(\.href)? = ")
"""What lets a page go to another one, in JavaScript."""
EXCUSE = re.compile(r"# clock: \w")


class Reader(ast.NodeVisitor):
    """Collects what is wrong in one file as lines and sentences."""

    def __init__(self, text: str) -> None:
        self.found: list[tuple[int, str]] = []
        self._lines = text.splitlines()
        tree = ast.parse(text)
        self._numbers = dict(_constants(tree))
        if not any(line.startswith("# clock: ") for line in self._lines):
            self.visit(tree)

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        decorators = (_name(each.func if isinstance(each, ast.Call) else each) for each in node.decorator_list)
        is_simulated = any(name.endswith(("simulated", "inside")) for name in decorators)
        if not is_simulated and not self._is_excused(node.lineno, node.body[0].lineno):
            self.found += _ports_let_go(node)
            self.generic_visit(node)

    visit_AsyncFunctionDef = visit_FunctionDef  # noqa: N815  # the name that ast wants

    def visit_Call(self, node: ast.Call) -> None:
        if not self._is_excused(node.lineno, (node.end_lineno or node.lineno) + 1):
            for sentence in self._judge(node):
                self.found.append((node.lineno, sentence))
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, str) and LEAVING.search(node.value) and not self._is_excused(node.lineno, 0):
            sentence = "the next question may go to the old page; use reload() or go() of the tab"
            self.found.append((node.lineno, sentence))

    def _judge(self, node: ast.Call) -> Iterator[str]:
        name = _name(node.func)
        last = name.rpartition(".")[2]
        keywords = {each.arg: each.value for each in node.keywords}
        if name in SLEEPS and not self._is_at_most(node.args[0], 0):
            yield f"{name}() sleeps"
        elif name in CLOCKS:
            yield f"{name}() reads the wall clock"
        elif name in ("os.kill", "os.killpg") and self._is_at_most(node.args[0], 2**22):
            yield f"{name}() names a fixed process"
        elif name == "until" and isinstance(node.args[0], ast.Lambda) and ".run(" in ast.unparse(node.args[0]):
            yield "until() asks a page that may be left; use until() of the tab"
        elif last == "bind" and node.args and self._has_fixed_port(node.args[0]):
            yield "bind() takes a fixed port; take port 0"
        elif not name.startswith(OURS):
            place = BOUNDED.get(name, WAITING.get(last, 99) if "." in name else 99)
            bound = node.args[place] if place < len(node.args) else keywords.get("timeout") if last in KEYWORD else None
            if bound is not None and self._is_at_most(bound, BOUND - 1e-9) and not self._is_at_most(bound, 0):
                yield f"{name}() waits for {ast.unparse(bound)} s only"

    def _is_at_most(self, node: ast.expr, most: float) -> bool:
        value = self._numbers.get(node.id) if isinstance(node, ast.Name) else getattr(node, "value", None)
        return isinstance(value, int | float) and not isinstance(value, bool) and value <= most

    def _has_fixed_port(self, address: ast.expr) -> bool:
        port = address.elts[-1] if isinstance(address, ast.Tuple) and len(address.elts) == 2 else None
        return isinstance(port, ast.Constant) and isinstance(port.value, int) and port.value > 0

    def _is_excused(self, first: int, end: int) -> bool:
        return any(EXCUSE.search(line) for line in self._lines[first - 1 : max(end - 1, first)])


def _ports_let_go(function: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield where a port is noted that is used after the block which holds it."""
    read = [each for each in ast.walk(function) if isinstance(each, ast.Name)]
    for block in ast.walk(function):
        if isinstance(block, ast.With) and "socket." in ast.unparse(block.items[0]):
            for each in ast.walk(block):
                noted = ast.unparse(each) if isinstance(each, ast.Assign | ast.Return) else ""
                names = {target.id for target in getattr(each, "targets", ()) if isinstance(target, ast.Name)}
                later = {name.id for name in read if name.lineno > (block.end_lineno or 0)}
                if "getsockname()" in noted and (isinstance(each, ast.Return) or names & later):
                    yield each.lineno, "a port that is let go may be anybody's; use held_port()"


def _constants(tree: ast.Module) -> Iterator[tuple[str, float]]:
    """Yield the numbers that the file gives names to."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant):
            for target in node.targets:
                if isinstance(target, ast.Name) and isinstance(node.value.value, int | float):
                    yield target.id, node.value.value


def _name(node: ast.expr) -> str:
    """Return a dotted name; a question mark stands for what is none."""
    if isinstance(node, ast.Attribute):
        return f"{_name(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else "?"


def main() -> int:
    """Print each race of the tests with its file and line; return 1 if there are any."""
    found = [
        f"{path.relative_to(TESTS.parent)}:{line}: {sentence}"
        for path in sorted(TESTS.rglob("*.py"))
        for line, sentence in Reader(path.read_text()).found
    ]
    print(*found, sep="\n", end="\n" if found else "")
    if found:
        print(f"{len(found)} places race the wall clock: {HELPER}.")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
