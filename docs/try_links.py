"""Links below the programs of the pages, which open them in the studio."""

from __future__ import annotations

import ast
import base64
import os
import re
import sys
import zlib
from pathlib import Path
from urllib.parse import quote

LABS = Path(__file__).parents[1] / "src/elib/lab/labs"
FILE = re.compile(r"[\w-]+\.toml\b")
STUDIO = "studio/index.html"
"""Where the site has the studio."""
PROGRAM = re.compile(r"(?P<needs><!-- needs [^\n]*-->\n+)?^```python\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
LAB = re.compile(r"^!\[[^]]*\]\(\.\./src/elib/lab/labs/(?P<name>[\w-]+)/world\.svg\)$", re.MULTILINE)
NOT_THERE = (
    "elib.cli",
    "elib.doors",
    "elib.learn",
    "elib.studies",
    "multiprocessing",
    "socket",
    "subprocess",
    "threading",
)
"""Modules that no program in a page can use, beside those of other packages."""
NEEDS_MORE = {"Batch", "Grid", "Localiser", "draw", "image", "pitch", "plot", "record", "tags"}
"""Names of elib that need NumPy, Pillow or other packages."""

NO_ACT = (ast.Import, ast.ImportFrom, ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Assign, ast.AnnAssign)
"""Statements that show nothing when they are run."""


def program_link(name: str, text: str) -> str:
    """Return the end of an address of the studio that opens a program there."""
    packer = zlib.compressobj(9, wbits=-zlib.MAX_WBITS)
    packed = packer.compress(text.encode()) + packer.flush()
    return f"#program={quote(name)},{base64.urlsafe_b64encode(packed).decode().rstrip('=')}"


def with_links(text: str, page: str) -> str:
    """Return the text of a page of the tutorial, the cookbook or the labs, with a link below each program.

    Args:
        text: Its Markdown.
        page: Where the site has it.
    """
    up = os.path.relpath(STUDIO, Path(page).parent).replace(os.sep, "/")
    earlier: list[tuple[ast.stmt, str]] = []

    def linked(shown: str, name: str, program: str) -> str:
        return f'{shown}\n\n<a class="try" href="{up}{program_link(name, program)}" target="_blank">Try it</a>\n'

    def program(found: re.Match[str]) -> str:
        if found["needs"]:
            return found[0]
        whole = with_needs(found["text"], earlier)
        earlier.extend(_statements(found["text"]))
        return linked(found[0], f"{Path(page).stem}.py", whole) if runs(whole) else found[0]

    def lab(found: re.Match[str]) -> str:
        start = (LABS / found["name"] / "start.py").read_text(encoding="utf-8")
        return linked(found[0], f"{found['name']}.py", start) if runs(start) else found[0]

    return LAB.sub(lab, PROGRAM.sub(program, text))


def with_needs(text: str, earlier: list[tuple[ast.stmt, str]]) -> str:
    """Return a program with what it uses of the programs above it on its page: imports, functions and values."""
    needed: list[tuple[ast.stmt, str]] = []
    missing = _used(own := ast.parse(text)) - _bound(own)
    for statement, written in reversed(earlier):
        if missing & (bound := _bound(statement)):
            needed.insert(0, (statement, written))
            missing = missing - bound | _used(statement)
    is_import = {True: "", False: ""}
    for statement, written in needed:
        is_import[isinstance(statement, ast.Import | ast.ImportFrom)] += written + "\n"
    return "\n".join(filter(None, (is_import[True], is_import[False], text)))


def runs(text: str) -> bool:
    """Return whether a text does something when it is run, and the studio has all that it needs."""
    tree, names = ast.parse(text), set()
    called = {each.attr for each in ast.walk(tree) if isinstance(each, ast.Attribute)}
    if called & NEEDS_MORE or all(isinstance(each, NO_ACT) for each in tree.body):
        return False
    for each in ast.walk(tree):
        if isinstance(each, ast.Import):
            names |= {alias.name for alias in each.names}
        elif isinstance(each, ast.ImportFrom):
            names |= {f"{each.module}.{alias.name}" for alias in each.names}
    own = {name for name in names if name.partition(".")[0] in {"elib", *sys.stdlib_module_names}}
    return own == names and not any(f"{name}.".startswith(tuple(f"{each}." for each in NOT_THERE)) for name in names)


def _statements(text: str) -> list[tuple[ast.stmt, str]]:
    """Return the statements of a program, as they are written, with their decorators."""
    lines, found = text.splitlines(), []
    for each in ast.parse(text).body:
        first = min([each.lineno, *(decorator.lineno for decorator in getattr(each, "decorator_list", ()))])
        found.append((each, "\n".join(lines[first - 1 : each.end_lineno])))
    return found


def _used(tree: ast.AST) -> set[str]:
    """Return the names that a statement, or a program, uses, and the files that its texts name."""
    names = {each.id for each in ast.walk(tree) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Load)}
    texts = [each.value for each in ast.walk(tree) if isinstance(each, ast.Constant) and isinstance(each.value, str)]
    return names.union(*map(FILE.findall, texts))


def _bound(tree: ast.AST) -> set[str]:
    """Return the names that a statement, or a program, gives something, and the files that it writes."""
    found = set()
    for each in ast.walk(tree):
        match each:
            case ast.Import() | ast.ImportFrom():
                found |= {(alias.asname or alias.name).partition(".")[0] for alias in each.names}
            case ast.Attribute(attr="write_text", value=ast.Call(args=[ast.Constant(value=file)])):
                found.add(file)
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                found.add(each.name)
            case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name) | ast.ExceptHandler(name=str(name)):
                found.add(name)
    return found
