"""Examples, README and tutorial as whole programs: with and without ``with``, in a thread, and at the prompt.

Each ends in time with exit code 0, and writes nothing on stderr.
"""

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from pages import CANNOT_STOP, ROOT, complaints, name_of, programs

from lanes import short
from shared import PATIENCE

SOURCES = {
    **{name_of(path): path.read_text() for path in sorted((ROOT / "examples").glob("*.py"))},
    **{
        name_of(page): "\n".join(block.text for block, _ in programs(page))
        for page in [ROOT / "README.md", *sorted((ROOT / "docs/tutorial").glob("*.md"))]
    },
}
NEEDS_WITH = {"examples/18_replay.py"}
"""It reads a file that is complete only at the end of the block."""
NOT_IN_A_THREAD = {
    f"docs/tutorial/{page}.md"
    for page in ("02-first-behaviour", "04-first-swarm", "05-first-evolution", "07-where-am-i")
}
"""They drive for minutes of simulated time, and open no robot in another way than the others."""
QUICK = {"examples/01_hello.py"}


class WithoutWith(ast.NodeTransformer):
    """Takes the ``with`` from around blocking robots: the robot is opened, used, and left open."""

    def __init__(self) -> None:
        self.count = 0

    def visit_With(self, node: ast.With) -> ast.AST | list[ast.stmt]:
        self.generic_visit(node)
        first = node.items[0]
        match first.context_expr:
            case ast.Call(func=ast.Attribute(value=ast.Name(id="elib"), attr="connect")):
                assert first.optional_vars is not None
                self.count += 1
                opened = ast.Assign([first.optional_vars], first.context_expr)
                rest = [ast.With(node.items[1:], node.body)] if node.items[1:] else node.body
                return [ast.fix_missing_locations(ast.copy_location(opened, node)), *rest]
        return node


def without_with(source: str) -> str:
    transformer = WithoutWith()
    changed = transformer.visit(ast.parse(source))
    return ast.unparse(ast.fix_missing_locations(changed)) if transformer.count else ""


def in_a_thread(source: str) -> str:
    return f"""
import threading
names = {{"__name__": "__main__"}}
thread = threading.Thread(target=exec, args=(compile({source!r}, "program", "exec"), names))
thread.start()
thread.join()
"""


BARE = {name: bare for name, source in SOURCES.items() if name not in NEEDS_WITH and (bare := without_with(source))}


def ways(name: str) -> dict[str, str]:
    """Return a program as it is, without ``with``, and in a thread, where it can be so."""
    source, bare = SOURCES[name], BARE.get(name, "")
    thread = "" if name in NOT_IN_A_THREAD else in_a_thread(bare or source)
    found = {"as it is": source, "without with": bare, "in a thread": thread}
    return {way: text for way, text in found.items() if text}


def run(source: str, folder: Path, *options: str, said: str = "") -> subprocess.CompletedProcess[str]:
    program = folder / "program.py"
    program.write_text(source)
    command = [sys.executable, *options, str(program)]
    return subprocess.run(command, cwd=folder, input=said, capture_output=True, text=True, timeout=10 * PATIENCE)


def test_there_are_programs_of_both_kinds() -> None:
    assert len(SOURCES) >= 23
    assert {"README.md", "examples/01_hello.py", "docs/tutorial/01-first-robot.md"} <= set(BARE)


def one_way_each() -> list[object]:
    """Return the shortest program in each way, and in the long form all others, each in one way: they take turns."""
    quick = [(name, way) for name in QUICK for way in ways(name)]
    others = [(name, list(ways(name))) for name in SOURCES if name not in QUICK]
    long = [(name, possible[k % len(possible)]) for k, (name, possible) in enumerate(others)]
    return short([*quick, *long], *quick)


@pytest.mark.parametrize(("name", "way"), one_way_each())
def test_a_program_as_it_is_without_with_or_in_a_thread_ends_without_a_complaint(
    name: str, way: str, tmp_path: Path
) -> None:
    done = run(ways(name)[way], tmp_path)
    assert complaints(done.stderr, may_be_left_moving=name in CANNOT_STOP) == []
    assert done.returncode == 0


@pytest.mark.parametrize("name", short(["examples/01_hello.py", "README.md"], "examples/01_hello.py"))
def test_a_program_that_goes_on_at_the_prompt_ends_without_a_complaint(name: str, tmp_path: Path) -> None:
    done = run(BARE[name], tmp_path, "-i", "-q", said="print(robot)\n")
    assert "open>" in done.stdout
    assert done.stderr.replace(">>> ", "").strip() == ""
    assert done.returncode == 0
