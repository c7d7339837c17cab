"""The writer of a folded kernel: it walks through a kernel's tree and writes what is left of it."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import trunc
from types import CodeType, FunctionType
from typing import Any, Final, Protocol, TypeAlias, cast

from elib.physics.syntax import (
    COMPARISONS,
    CannotFold,
    Number,
    Out,
    arithmetic,
    assignment,
    calls_in,
    contains,
    decided,
    falls_through,
    function_named,
    index_of,
    is_pure,
    is_same,
    is_simple,
    name_of,
    number_in,
    reads,
    size_of,
    stored,
    tree_of,
    without_idle,
)

Elements: TypeAlias = Mapping[tuple[str, int], Number]
"""Elements of sequences that do not change during a run: a parameter's name, an index, the value."""

MOST_TURNS: Final = 8
"""A loop of more turns is not written out."""

MOST_NODES: Final = 1200
"""Nor one that would grow beyond so many nodes of the syntax tree."""

MOST_TAKEN: Final = 1000
"""A kernel of more nodes is not written in the place of its call, unless it is an inner one."""

FACTORY: Final = "elib_factory"
"""The name of the function that takes the laws and returns the folded kernel."""

CHOICES: Final = {"min": ast.Lt, "max": ast.Gt}
"""``min(a, b)`` is ``b if b < a else a``, which costs a third of the call."""

TAKEN: Final = ast.Constant(...)
"""Stands for a result that has its names already."""


class Names(Protocol):
    """The globals of folded kernels."""

    def note(self, names: dict[str, object], name: str, found: object) -> None:
        """Note that *found* was found in a module's *names*."""

    def named(self, name: str, found: object) -> str:
        """Return the name under which folded kernels find *found*, a kernel as it will be folded."""


@dataclass
class _Frame:
    """A kernel at the place where it is being written.

    Attributes:
        function: The kernel.
        suffix: Of its local names; empty for the outermost one.
        known: What its local names stand for: literals, or names of the caller's.
        locals: All its local names.
        answers: The names that take its result; none for the outermost kernel, which returns it.
        copies: How many times the statement at hand is written.
        is_loop_last: A loop is being written that nothing follows: to return is to break off.
    """

    function: FunctionType
    suffix: str
    known: dict[str, ast.expr]
    locals: set[str]
    answers: tuple[str, ...] = ()
    copies: int = 1
    is_loop_last: bool = False

    def renamed(self, name: str) -> str:
        return name + self.suffix


@dataclass
class Folder:
    """Writes one folded function: statements go to lists, expressions are returned."""

    names: Names
    laws: Mapping[str, Callable[..., Any]]
    given: tuple[str, ...]
    settled: Elements
    kernels: set[FunctionType]
    inner: set[FunctionType]
    count: int = 0

    def fold(self, kernel: FunctionType) -> CodeType:
        """Return code that defines a function which takes the given laws and returns the folded kernel."""
        tree = tree_of(kernel)
        parameters = [argument.arg for argument in tree.args.args]
        frame = _Frame(kernel, "", {}, {*parameters, *stored(tree.body)})
        body: Out = []
        self._block(tree.body, frame, body, is_last=True)
        written = function_named(kernel.__name__, parameters, without_idle(body) or [ast.Pass()])
        factory = function_named(FACTORY, self.given, [written, ast.Return(name_of(kernel.__name__))])
        module = ast.fix_missing_locations(ast.Module([ast.copy_location(factory, tree)], []))
        return compile(module, kernel.__code__.co_filename, "exec")

    # Statements.

    def _block(self, body: Sequence[ast.stmt], frame: _Frame, out: Out, *, is_last: bool) -> None:
        """Write statements; *is_last* says that nothing of their kernel follows them."""
        for n, statement in enumerate(body):
            start, count = len(out), self.count
            is_done = self._statement(statement, body[n + 1 :], frame, out, is_last=is_last)
            if not frame.suffix:  # What was written here stands for this line of the outermost kernel.
                for written in out[start:]:
                    if not hasattr(written, "lineno"):
                        ast.copy_location(written, statement)
            if is_done:
                return
            self.count = count  # What was named for this statement alone is free again.

    def _statement(
        self, statement: ast.stmt, rest: Sequence[ast.stmt], frame: _Frame, out: Out, *, is_last: bool
    ) -> bool:
        """Write a statement, and return whether *rest*, what follows it, is done with."""
        match statement:
            case ast.Return():
                self._return(statement, frame, out)
                return True
            case ast.Break() | ast.Continue():
                out.append(type(statement)())
                return True
            case ast.If():
                return self._if(statement, rest, frame, out, is_last=is_last)
            case ast.For() if not statement.orelse:
                self._for(statement, frame, out, is_last=is_last and not rest)
            case ast.While() if not statement.orelse and not (frame.suffix and contains(ast.Return, [statement])):
                self._forget(stored([statement]), frame)
                written: Out = []
                test = self._expression(statement.test, frame, None)
                self._block(statement.body, frame, written, is_last=False)
                self._forget(stored([statement]), frame)
                out.append(ast.While(test, written or [ast.Pass()], []))
            case ast.Assign(targets=[*targets]) if len(targets) == 1 or is_simple(statement.value):
                for target in targets:
                    self._assign(target, statement.value, frame, out)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._assign(target, value, frame, out)
            case ast.AugAssign():
                self._augment(statement, frame, out)
            case ast.Expr():
                value = self._expression(statement.value, frame, out, is_whole=True)
                if not is_simple(value):
                    out.append(ast.Expr(value))
            case ast.Pass():
                pass
            case _:
                raise CannotFold(f"{type(statement).__name__} in {frame.function.__name__}")
        return False

    def _return(self, statement: ast.Return, frame: _Frame, out: Out) -> None:
        if not frame.suffix:
            value = statement.value and self._expression(statement.value, frame, out, is_whole=True)
            out.append(ast.Return(value))
        elif frame.is_loop_last:
            out.append(ast.Break())
        elif statement.value is not None:
            self._deliver(frame.answers, statement.value, frame, out)

    def _deliver(self, answers: tuple[str, ...], value: ast.expr, frame: _Frame, out: Out) -> None:
        """Assign a result to the names that take it."""
        if len(answers) == 1:
            result = self._expression(value, frame, out, is_whole=True)
            if result is not TAKEN:
                out.append(assignment(answers[0], result))
            return
        if not isinstance(value, ast.Tuple) or len(value.elts) != len(answers):
            raise CannotFold(f"{frame.function.__name__} returns {ast.unparse(value)}")
        pairs = [(name, self._expression(part, frame, out)) for name, part in zip(answers, value.elts, strict=True)]
        pairs = [(name, part) for name, part in pairs if not (isinstance(part, ast.Name) and part.id == name)]
        if not any(reads(part, name) for n, (name, _) in enumerate(pairs) for _, part in pairs[n + 1 :]):
            out += [assignment(name, part) for name, part in pairs]
        else:
            names: list[ast.expr] = [ast.Name(name, ast.Store()) for name, _ in pairs]
            out.append(ast.Assign([ast.Tuple(names, ast.Store())], ast.Tuple([part for _, part in pairs], ast.Load())))

    def _if(self, statement: ast.If, rest: Sequence[ast.stmt], frame: _Frame, out: Out, *, is_last: bool) -> bool:
        test = decided(self._expression(statement.test, frame, out, is_whole=True))
        if isinstance(test, ast.Constant):
            self._block([*(statement.body if test.value else statement.orelse), *rest], frame, out, is_last=is_last)
            return True
        bodies = [list(statement.body), list(statement.orelse)]
        returns = frame.suffix and not frame.is_loop_last and contains(ast.Return, bodies[0] + bodies[1])
        if returns:  # Written in the place of a call nothing can return: what follows goes to the branch that goes on.
            going_on = [body for body in bodies if falls_through(body)]
            if not is_last or (len(going_on) > 1 and len(rest) > 1):
                raise CannotFold(f"{frame.function.__name__} returns in the middle")
            for body in going_on:
                body += rest
        written: list[Out] = [[], []]
        before, after = frame.known, []
        for body, branch in zip(bodies, written, strict=True):
            frame.known = dict(before)
            self._block(body, frame, branch, is_last=is_last and (bool(returns) or not rest))
            after.append((frame.known, falls_through(body)))
        ends = [known for known, goes_on in after if goes_on] or [before]
        frame.known = {
            name: value for name, value in ends[0].items() if all(is_same(value, known.get(name)) for known in ends[1:])
        }
        if written[0]:
            out.append(ast.If(test, written[0], written[1]))
        elif written[1]:
            out.append(ast.If(ast.UnaryOp(ast.Not(), test), written[1], []))
        return bool(returns)

    def _for(self, statement: ast.For, frame: _Frame, out: Out, *, is_last: bool) -> None:
        turns = self._turns(statement, frame)
        if turns is not None:
            for turn in turns:
                self._assign(statement.target, ast.Constant(turn), frame, out)
                frame.copies *= len(turns)
                self._block(statement.body, frame, out, is_last=False)
                frame.copies //= len(turns)
            return
        returns = bool(frame.suffix) and contains(ast.Return, statement.body)
        if returns and (not is_last or frame.answers or contains((ast.For, ast.While), statement.body)):
            raise CannotFold(f"{frame.function.__name__} returns from within a loop")
        over = self._expression(statement.iter, frame, out)
        self._forget(stored([statement]), frame)
        written: Out = []
        frame.is_loop_last, before = returns, frame.is_loop_last
        self._block(statement.body, frame, written, is_last=False)
        frame.is_loop_last = before
        self._forget(stored([statement]), frame)
        out.append(ast.For(self._target(statement.target, frame, out), over, written or [ast.Pass()], []))

    def _turns(self, statement: ast.For, frame: _Frame) -> range | None:
        """Return the turns of a loop that is worth writing out, or None."""
        call = statement.iter
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"):
            return None
        ends = [number_in(self._expression(end, frame, None)) for end in call.args]
        if not all(isinstance(end, int) for end in ends):
            return None
        turns = range(*cast("list[int]", ends))
        if len(turns) > MOST_TURNS or (len(turns) > 1 and len(turns) * self._weight(statement, frame) > MOST_NODES):
            return None
        leaves = contains((ast.Break, ast.Continue, ast.Return), statement.body)
        return None if leaves else turns

    def _weight(self, node: ast.AST, frame: _Frame) -> int:
        """Return the nodes of a syntax tree with the inner kernels that it calls."""
        weight = 0
        for part in ast.walk(node):
            weight += 1
            if isinstance(part, ast.Call) and isinstance(part.func, ast.Name) and part.func.id not in frame.locals:
                called = self._global(part.func.id, frame)
                if isinstance(called, FunctionType) and called in self.inner:
                    weight += size_of(called)
        return weight

    def _assign(self, target: ast.expr, value: ast.expr, frame: _Frame, out: Out) -> None:
        """Write an assignment; a kernel called for it assigns to the target itself."""
        parts = target.elts if isinstance(target, ast.Tuple) else [target]
        into = tuple(frame.renamed(part.id) for part in parts if isinstance(part, ast.Name))
        result = self._expression(value, frame, out, is_whole=True, into=into if len(into) == len(parts) else ())
        self._forget(stored([target]), frame)
        if result is TAKEN:
            return
        if isinstance(target, ast.Name) and isinstance(result, ast.Constant):
            frame.known[target.id] = result
        out.append(ast.Assign([self._target(target, frame, out)], result))

    def _augment(self, statement: ast.AugAssign, frame: _Frame, out: Out) -> None:
        target = statement.target
        if isinstance(target, ast.Name) and target.id in frame.known:
            whole = ast.BinOp(name_of(target.id), statement.op, statement.value)
            self._assign(target, whole, frame, out)
            return
        value = self._expression(statement.value, frame, out)
        written = self._target(target, frame, out)
        self._forget(stored([target]), frame)
        out.append(ast.AugAssign(cast("ast.Name | ast.Subscript", written), statement.op, value))

    def _target(self, target: ast.expr, frame: _Frame, out: Out) -> ast.expr:
        match target:
            case ast.Name(id=name):
                return ast.Name(frame.renamed(name), ast.Store())
            case ast.Subscript():
                sequence = self._expression(target.value, frame, out)
                index = index_of(self._expression(target.slice, frame, out))
                if self._settled_at(sequence, index) is not None:
                    raise CannotFold(f"{frame.function.__name__} changes what is settled")
                return ast.Subscript(sequence, index, ast.Store())
            case ast.Tuple(elts=parts):
                return ast.Tuple([self._target(part, frame, out) for part in parts], ast.Store())
        raise CannotFold(f"{ast.unparse(target)} is assigned in {frame.function.__name__}")

    def _forget(self, names: set[str], frame: _Frame) -> None:
        for name in names:
            frame.known.pop(name, None)

    # Expressions.

    def _expression(
        self,
        node: ast.expr,
        frame: _Frame,
        out: Out | None,
        *,
        is_whole: bool = False,
        into: tuple[str, ...] = (),
    ) -> ast.expr:
        """Return what is left of an expression.

        Args:
            node: The expression.
            frame: The kernel that it stands in.
            out: Where statements go that must run before it; None if it may be evaluated never, or more than once, so
                that there is no place for any.
            is_whole: Nothing stands to the left of it in its statement.
            into: Names for the result of a kernel that it calls: if they have taken it, :data:`TAKEN` is returned.
        """
        match node:
            case ast.Constant(value=value):
                return ast.Constant(value)
            case ast.Name(id=name):
                return self._name(name, frame)
            case ast.BinOp():
                left = self._expression(node.left, frame, out)
                right = self._expression(node.right, frame, out)
                return arithmetic(left, node.op, right)
            case ast.UnaryOp():
                operand = self._expression(node.operand, frame, out)
                value = number_in(operand)
                if value is not None and isinstance(node.op, ast.USub | ast.Not):
                    return ast.Constant(-value if isinstance(node.op, ast.USub) else not value)
                return ast.UnaryOp(node.op, operand)
            case ast.Compare():
                return self._comparison(node, frame, out)
            case ast.BoolOp():
                return self._logic(node, frame, out)
            case ast.IfExp():
                test = self._expression(node.test, frame, out)
                if isinstance(test, ast.Constant):
                    return self._expression(node.body if test.value else node.orelse, frame, out)
                body, orelse = (self._expression(part, frame, None) for part in (node.body, node.orelse))
                return ast.IfExp(test, body, orelse)
            case ast.Subscript():
                return self._element(node, frame, out)
            case ast.Tuple(elts=parts):
                return ast.Tuple([self._expression(part, frame, out) for part in parts], ast.Load())
            case ast.List(elts=parts):
                return ast.List([self._expression(part, frame, out) for part in parts], ast.Load())
            case ast.Call(func=ast.Name(), keywords=[]):
                return self._call(node, frame, out, is_whole=is_whole, into=into)
            case ast.Call(func=ast.Attribute(value=owner, attr=method), args=parts, keywords=[]):
                called = ast.Attribute(self._expression(owner, frame, out), method, ast.Load())
                return ast.Call(called, [self._expression(part, frame, out) for part in parts], [])
        raise CannotFold(f"{ast.unparse(node)} in {frame.function.__name__}")

    def _name(self, name: str, frame: _Frame) -> ast.expr:
        if name in frame.locals:
            known = frame.known.get(name)
            if isinstance(known, ast.Constant):
                return ast.Constant(known.value)
            return name_of(known.id if isinstance(known, ast.Name) else frame.renamed(name))
        if name in self.given and not frame.suffix:
            return name_of(name)
        found = self._global(name, frame)
        if name in self.laws and not frame.suffix:
            return name_of(self.names.named(name, found))
        if isinstance(found, int | float):
            return ast.Constant(found)
        if getattr(builtins, name, None) is found:
            return name_of(name)
        self.names.note(frame.function.__globals__, name, found)
        return name_of(self.names.named(name, found))

    def _global(self, name: str, frame: _Frame) -> object:
        """Return what a global name of a kernel stands for; None for a law that is not known yet."""
        if not frame.suffix and (name in self.laws or name in self.given):
            return self.laws.get(name)
        names = frame.function.__globals__
        return names[name] if name in names else getattr(builtins, name)

    def _comparison(self, node: ast.Compare, frame: _Frame, out: Out | None) -> ast.expr:
        left = self._expression(node.left, frame, out)
        first = self._expression(node.comparators[0], frame, out)
        others = [self._expression(part, frame, None) for part in node.comparators[1:]]
        a, b, compare = number_in(left), number_in(first), COMPARISONS.get(type(node.ops[0]))
        if a is not None and b is not None and compare is not None and not others:
            return ast.Constant(compare(a, b))
        return ast.Compare(left, node.ops, [first, *others])

    def _logic(self, node: ast.BoolOp, frame: _Frame, out: Out | None) -> ast.expr:
        """Fold ``and`` and ``or``: what is known and does not decide is left out."""
        decisive = isinstance(node.op, ast.Or)
        *others, last = node.values
        parts: list[ast.expr] = []
        for n, part in enumerate(others):
            written = self._expression(part, frame, out if n == 0 else None)
            if not isinstance(written, ast.Constant):
                parts.append(written)
            elif bool(written.value) is decisive:
                last = written
                break
        parts.append(self._expression(last, frame, None))
        return parts[0] if len(parts) == 1 else ast.BoolOp(node.op, parts)

    def _element(self, node: ast.Subscript, frame: _Frame, out: Out | None) -> ast.expr:
        sequence = self._expression(node.value, frame, out)
        index = index_of(self._expression(node.slice, frame, out))
        value = self._settled_at(sequence, index)
        return ast.Subscript(sequence, index, ast.Load()) if value is None else ast.Constant(value)

    def _settled_at(self, sequence: ast.expr, index: ast.expr) -> Number | None:
        """Return the value of an element if it is settled."""
        if not isinstance(sequence, ast.Name) or not isinstance(index, ast.Constant):
            return None
        return self.settled.get((sequence.id, cast("int", index.value)))

    # Calls.

    def _call(
        self, node: ast.Call, frame: _Frame, out: Out | None, *, is_whole: bool, into: tuple[str, ...]
    ) -> ast.expr:
        name = cast("ast.Name", node.func).id
        called = None if name in frame.locals else self._global(name, frame)
        arguments = [self._expression(part, frame, out) for part in node.args]
        if called in (min, max) and len(arguments) == 2 and (out is not None or all(map(is_simple, arguments))):
            return self._choice(name, [self._held(part, out) for part in arguments])
        if called is int and len(arguments) == 1:
            return ast.Call(name_of(self.names.named("trunc", trunc)), arguments, [])
        if called is float and (value := number_in(arguments[0])) is not None:
            return ast.Constant(float(value))
        if out is not None and self._is_taken(called, frame, is_whole=is_whole):
            taken: Out = []
            try:
                result = self._take(cast("FunctionType", called), arguments, into, frame.copies, taken)
            except CannotFold:
                pass
            else:
                if name not in self.laws:
                    self.names.note(frame.function.__globals__, name, cast("FunctionType", called))
                out += taken
                return result
        if isinstance(called, FunctionType) and called in self.kernels:
            self._check(called, arguments)
        return ast.Call(self._name(name, frame), arguments, [])

    def _check(self, called: FunctionType, arguments: list[ast.expr]) -> None:
        """Make sure that what is settled here is settled in a kernel that is folded by itself too."""
        names = {name for name, _ in self.settled}
        for parameter, argument in zip(tree_of(called).args.args, arguments, strict=True):
            if parameter.arg in names and not (isinstance(argument, ast.Name) and argument.id == parameter.arg):
                raise CannotFold(f"{called.__name__} gets other {parameter.arg}")

    def _held(self, value: ast.expr, out: Out | None) -> ast.expr:
        """Return a value that may be asked for twice."""
        if is_simple(value) or out is None:
            return value
        self.count += 1
        name = f"held__{self.count}"
        out.append(assignment(name, value))
        return name_of(name)

    def _choice(self, name: str, arguments: list[ast.expr]) -> ast.expr:
        first, second = arguments
        a, b = number_in(first), number_in(second)
        if a is not None and b is not None:
            return ast.Constant(min(a, b) if name == "min" else max(a, b))
        return ast.IfExp(ast.Compare(second, [CHOICES[name]()], [first]), second, first)

    def _is_taken(self, called: object, frame: _Frame, *, is_whole: bool) -> bool:
        """Return whether a function is to be written in the place of its call."""
        if not isinstance(called, FunctionType) or called not in self.kernels:
            return False
        if not is_whole and not is_pure(called):
            return False  # It must not come before what stands to the left of it.
        if called in self.inner:
            return True
        is_only = frame.copies == 1 and calls_in(frame.function).count(called.__name__) == 1
        return is_only and size_of(called) <= MOST_TAKEN

    def _take(
        self, called: FunctionType, arguments: list[ast.expr], into: tuple[str, ...], copies: int, out: Out
    ) -> ast.expr:
        """Write a kernel in the place of its call, and return its result."""
        tree = tree_of(called)
        parameters = [argument.arg for argument in tree.args.args]
        changed = stored(tree.body)
        self.count += 1
        frame = _Frame(called, f"__{self.count}", {}, {*parameters, *changed}, copies=copies)
        for parameter, argument in zip(parameters, arguments, strict=True):
            if is_simple(argument) and (parameter not in changed or isinstance(argument, ast.Constant)):
                frame.known[parameter] = argument
            if parameter in changed or not is_simple(argument):
                out.append(assignment(frame.renamed(parameter), argument))
        *body, last = tree.body
        if isinstance(last, ast.Return) and last.value is not None and not contains(ast.Return, body):
            self._block(body, frame, out, is_last=False)
            if len(into) > 1 and isinstance(last.value, ast.Tuple):
                self._deliver(into, last.value, frame, out)
                return TAKEN
            return self._expression(last.value, frame, out, is_whole=True)
        values = [node.value for node in ast.walk(tree) if isinstance(node, ast.Return)]
        if any(value is not None for value in values):
            if None in values or falls_through(tree.body):
                raise CannotFold(f"{called.__name__} returns a number here and nothing there")
            frame.answers = into or (f"answer__{self.count}",)
        self._block(tree.body, frame, out, is_last=True)
        if into and frame.answers:
            return TAKEN
        return name_of(frame.answers[0]) if frame.answers else ast.Constant(None)
