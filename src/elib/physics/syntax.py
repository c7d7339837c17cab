"""Syntax trees of kernels: what folding asks of them, and small pieces of new ones."""

from __future__ import annotations

import ast
import inspect
import operator
import textwrap
from collections.abc import Callable, Sequence
from functools import cache
from types import FunctionType
from typing import Any, Final, TypeAlias

Number: TypeAlias = int | float

Out: TypeAlias = list[ast.stmt]
"""Statements that are being written."""

ARITHMETIC: Final[dict[type[ast.AST], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
}
COMPARISONS: Final[dict[type[ast.AST], Callable[[Any, Any], bool]]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}


class CannotFold(Exception):
    """A kernel does something that folding does not know; it is called instead."""


@cache
def tree_of(function: FunctionType) -> ast.FunctionDef:
    """Return the syntax tree of a kernel, without its docstring."""
    try:
        source = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError) as error:
        raise CannotFold(f"{function.__name__} has no source") from error
    tree = ast.parse(source).body[0]
    if not isinstance(tree, ast.FunctionDef) or tree.args.vararg or tree.args.kwonlyargs or tree.args.kwarg:
        raise CannotFold(f"{function.__name__} is no plain function")
    if function.__closure__ or tree.args.defaults:
        raise CannotFold(f"{function.__name__} has more than parameters")
    ast.increment_lineno(tree, function.__code__.co_firstlineno - 1)
    if ast.get_docstring(tree) is not None:
        del tree.body[0]
    return tree


def stored(nodes: Sequence[ast.AST]) -> set[str]:
    """Return the local names that these statements assign."""
    return {
        node.id
        for root in nodes
        for node in ast.walk(root)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }


def contains(kinds: type[ast.AST] | tuple[type[ast.AST], ...], nodes: Sequence[ast.AST]) -> bool:
    """Return whether there is a node of these kinds somewhere."""
    return any(isinstance(node, kinds) for root in nodes for node in ast.walk(root))


def falls_through(body: Sequence[ast.stmt]) -> bool:
    """Return whether what follows a block may run after it."""
    if not body:
        return True
    last = body[-1]
    if isinstance(last, ast.If) and last.orelse:
        return falls_through(last.body) or falls_through(last.orelse)
    return not isinstance(last, ast.Return | ast.Break | ast.Continue)


def number_in(node: ast.expr | None) -> Number | None:
    """Return the value of a literal number, or None."""
    value = node.value if isinstance(node, ast.Constant) else None
    return value if isinstance(value, int | float) else None


def decided(test: ast.expr) -> ast.expr:
    """Return a condition without a literal at its end that decides nothing."""
    if not isinstance(test, ast.BoolOp):
        return test
    *others, last = test.values
    if not isinstance(last, ast.Constant) or bool(last.value) is not isinstance(test.op, ast.And):
        return test
    return others[0] if len(others) == 1 else ast.BoolOp(test.op, others)


def is_simple(node: ast.expr) -> bool:
    """Return whether an expression costs nothing to evaluate again."""
    return isinstance(node, ast.Constant | ast.Name)


def is_same(a: ast.expr | None, b: ast.expr | None) -> bool:
    """Return whether both are there and say the same."""
    return a is not None and b is not None and ast.dump(a) == ast.dump(b)


def reads(node: ast.expr, name: str) -> bool:
    """Return whether an expression asks for a local name."""
    return any(isinstance(part, ast.Name) and part.id == name for part in ast.walk(node))


def name_of(name: str) -> ast.Name:
    """Return the expression that asks for a name."""
    return ast.Name(name, ast.Load())


def assignment(name: str, value: ast.expr) -> ast.Assign:
    """Return the statement that gives a name a value."""
    return ast.Assign([ast.Name(name, ast.Store())], value)


def function_named(name: str, parameters: Sequence[str], body: Out) -> ast.FunctionDef:
    """Return the definition of a function."""
    arguments = ast.arguments([], [ast.arg(parameter) for parameter in parameters], None, [], [], None, [])
    return ast.FunctionDef(name=name, args=arguments, body=body, decorator_list=[])


@cache
def size_of(node: ast.AST | FunctionType) -> int:
    """Return the nodes of a syntax tree, or of a kernel's."""
    return sum(1 for _ in ast.walk(tree_of(node) if isinstance(node, FunctionType) else node))


@cache
def calls_in(function: FunctionType) -> tuple[str, ...]:
    """Return the names that a kernel calls, once for each call."""
    return tuple(
        node.func.id
        for node in ast.walk(tree_of(function))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    )


@cache
def is_pure(function: FunctionType) -> bool:
    """Return whether a kernel changes no sequence."""
    for node in ast.walk(tree_of(function)):
        if isinstance(node, ast.Attribute) or (isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store)):
            return False
    called = (function.__globals__.get(name) for name in calls_in(function))
    return all(is_pure(kernel) for kernel in called if isinstance(kernel, FunctionType))


def arithmetic(left: ast.expr, kind: ast.operator, right: ast.expr) -> ast.expr:
    """Return an operation on two expressions, or its result where both are literal."""
    a, b, compute = number_in(left), number_in(right), ARITHMETIC.get(type(kind))
    if b == 0 and isinstance(kind, ast.Div):
        compute = None
    if a is None or b is None or compute is None:
        return ast.BinOp(left, kind, right)
    return ast.Constant(compute(a, b))


def index_of(index: ast.expr) -> ast.expr:
    """Return an index with the literal numbers of its sum added up."""
    terms: list[ast.expr] = []
    offset = 0

    def gather(node: ast.expr) -> None:
        nonlocal offset
        value = number_in(node)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            gather(node.left)
            gather(node.right)
        elif isinstance(value, int):
            offset += value
        else:
            terms.append(node)

    gather(index)
    if not terms:
        return ast.Constant(offset)
    total = terms[0]
    for term in terms[1:]:
        total = ast.BinOp(total, ast.Add(), term)
    return ast.BinOp(total, ast.Add(), ast.Constant(offset)) if offset else total


def without_idle(body: Out) -> Out:
    """Return statements without the assignments of literals and names that nobody reads."""
    read = {
        node.id
        for root in body
        for node in ast.walk(root)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }
    return _Sweeper(read).swept(body)


class _Sweeper(ast.NodeTransformer):
    """Takes assignments of literals out whose names are not in *read*."""

    def __init__(self, read: set[str]) -> None:
        self._read = read

    def swept(self, body: Out) -> Out:
        return [kept for statement in body if (kept := self.visit(statement)) is not None]

    def visit_Assign(self, node: ast.Assign) -> ast.Assign | None:
        (target,) = node.targets
        is_idle = isinstance(target, ast.Name) and target.id not in self._read and is_simple(node.value)
        return None if is_idle else node

    def visit_If(self, node: ast.If) -> ast.If:
        node.body, node.orelse = self.swept(node.body) or [ast.Pass()], self.swept(node.orelse)
        return node

    def visit_For(self, node: ast.For) -> ast.For:
        node.body = self.swept(node.body) or [ast.Pass()]
        return node

    def visit_While(self, node: ast.While) -> ast.While:
        node.body = self.swept(node.body) or [ast.Pass()]
        return node
