"""The pages, taken apart: code blocks, headings and links."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").rglob("*.md")],
    key=lambda path: path.relative_to(ROOT).as_posix(),
)
NEEDS = re.compile(r"<!-- needs (?P<what>[^<>]+?)(?: at (?P<where>\S+))? -->")
"""The line before a block that cannot run here: ``<!-- needs a robot -->``. With ``at TEXT`` only the command lines
that contain the text need it."""
CANNOT_STOP = {"docs/tutorial/03-when-things-fail.md", "docs/tutorial/04-first-swarm.md"}
"""Their programs cut a link, or silence a robot: the message that it did not confirm its stop is right."""


@dataclass(frozen=True, slots=True)
class Block:
    """One fenced block: what it is, where it begins, what it holds, and what it needs that is not here."""

    language: str
    line: int
    text: str
    needs: str = ""
    needs_at: str = ""

    @property
    def cannot_run(self) -> bool:
        return bool(self.needs) and not self.needs_at


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def blocks(path: Path, language: str) -> list[Block]:
    return [block for block in all_blocks(path) if block.language == language]


def all_blocks(path: Path) -> Iterator[Block]:
    lines = path.read_text(encoding="utf-8").splitlines()
    place = 0
    while place < len(lines):
        indent, fence, language = lines[place].partition("```")
        if fence and not indent.strip():
            end = lines.index(f"{indent}```", place + 1)
            before = next((line for line in reversed(lines[:place]) if line.strip()), "")
            text = "\n".join(line.removeprefix(indent) for line in lines[place + 1 : end])
            needs = NEEDS.fullmatch(before.strip())
            marks = (needs["what"], needs["where"] or "") if needs else ("", "")
            yield Block(language.strip(), place + 2, text, *marks)
            place = end
        place += 1


def programs(path: Path, *languages: str) -> Iterator[tuple[Block, Block | None]]:
    """The Python blocks that run, each with the output that is shown right below it."""
    languages = languages or ("python",)
    lines = path.read_text(encoding="utf-8").splitlines()
    for block, below in pairwise([*all_blocks(path), Block("", 0, "")]):
        if block.language in languages and not block.cannot_run:
            end = block.line + len(block.text.splitlines())
            is_shown = below.language == "text" and not any(lines[end : below.line - 2])
            yield block, below if is_shown else None


def complaints(stderr: str, *, may_be_left_moving: bool) -> list[str]:
    """Return the lines that a program should not have written to stderr; that it compiles, once, it may say."""
    lines = [line for line in stderr.splitlines() if not line.startswith("elib: compiling ")]
    if may_be_left_moving:
        lines = [line for line in lines if "did not confirm that it stands" not in line and line[:5] != "hint:"]
    return lines


def prose(path: Path) -> str:
    """Return the page without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


def anchors(path: Path) -> set[str]:
    """Return the anchors of the headings of a page."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", prose(path), re.MULTILINE):
        plain = re.sub(r"[^\w\- ]", "", heading.replace("`", "").lower())
        found.add(plain.strip().replace(" ", "-"))
    return found


def links(path: Path) -> list[str]:
    """Return where the links of the page lead to inside the project."""
    found = re.findall(r"\]\(([^)\s]+)\)", prose(path))
    return [target for target in found if not target.startswith(("http://", "https://"))]
