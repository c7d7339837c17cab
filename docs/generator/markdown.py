"""From docstrings to Markdown."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence

SECTIONS = ("Args", "Attributes", "Returns", "Yields", "Raises", "Example")


def inline(text: str) -> str:
    """Return one paragraph of a docstring as Markdown on one line."""
    # The notes on the wire that docstrings cite are not part of these pages.
    text = re.sub(r" \((?:wire-protocol|e-puck)\.md(?:,[^)]*)?\)", "", " ".join(text.split()))
    text = re.sub(r":(\w+):`~?([\w.]+)`", lambda match: f"``{_last(match)}``", text)
    return re.sub(r"``(.+?)``", r"`\1`", text)


def _last(match: re.Match[str]) -> str:
    name = match[2].rpartition(".")[2]
    return f"{name}()" if match[1] in ("func", "meth") else name


def docstring(text: str | None) -> str:
    """Return a whole docstring in Google's convention as Markdown."""
    return "\n\n".join(_blocks(inspect.cleandoc(text or "")))


def _blocks(text: str) -> Iterable[str]:
    section = ""
    for block in re.split(r"\n\s*\n", text):
        if re.match(r"[ ]{4}", block) and not section:
            yield "```text\n" + "\n".join(line[4:] for line in block.splitlines()) + "\n```"
            continue
        head = re.match(r"(\w+):\n", block)
        if head is not None and head[1] == "Example":
            yield "```pycon\n" + inspect.cleandoc(block[head.end() :]) + "\n```"
            continue
        if head is not None and head[1] in SECTIONS:
            section = head[1]
            yield f"**{ {'Args': 'Arguments'}.get(section, section) }**"
            yield entries(block[head.end() :], is_list=section not in ("Returns", "Yields"))
            continue
        section = ""
        if block.startswith("* "):
            yield "\n".join(f"- {inline(each)}" for each in re.split(r"^\* ", block, flags=re.MULTILINE) if each)
            continue
        plain = inline(block).removesuffix(" ::").removesuffix("::")
        if plain and not plain.endswith((".", ":")):
            plain += ":"  # what follows is shown
        if plain:
            yield plain


def entries(body: str, *, is_list: bool = True) -> str:
    """Return a section's entries, each ``name: text`` with its continuation lines further in."""
    lines = [line[4:] for line in body.splitlines()]
    if not is_list:
        return inline(" ".join(lines))
    return "\n".join(f"- `{name}`: {inline(text)}" for name, text in named(lines).items())


def named(lines: Iterable[str]) -> dict[str, str]:
    """Return the entries of a section by name."""
    found: dict[str, str] = {}
    name = ""
    for line in lines:
        if line.startswith(" ") and name:
            found[name] += " " + line.strip()
        else:
            name, _, found_text = line.partition(":")
            found[name] = found_text.strip()
    return found


def section(text: str | None, title: str) -> dict[str, str]:
    """Return the entries of one section of a docstring by name."""
    match = re.search(rf"^{title}:\n((?:[ ]+.*\n?)+)", inspect.cleandoc(text or ""), re.MULTILINE)
    return named(line[4:] for line in match[1].splitlines()) if match else {}


def description(text: str | None) -> str:
    """Return what stands before the first section of a docstring, without blocks of code."""
    text = re.sub(r"\n\n::\n\n(?:[ ]+.*\n+)+", "\n\n", inspect.cleandoc(text or ""))
    return re.split(rf"^(?:{'|'.join(SECTIONS)}):\n", inspect.cleandoc(text or ""), maxsplit=1, flags=re.MULTILINE)[0]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def field_table(told: Mapping[str, str]) -> str:
    """Return the table of the fields that a docstring describes."""
    return table(("Field", "What it is"), ((f"`{name}`", inline(text)) for name, text in told.items()))


def bullets(facts: Iterable[str]) -> str:
    """Return a Markdown list."""
    return "\n".join(f"- {fact}" for fact in facts)


def block(text: str | None) -> str:
    """Return the first block of code of a docstring."""
    shown = re.match(r"(?:    .*\n|\n)*", inspect.cleandoc(text or "").partition("::\n\n")[2] + "\n")
    return textwrap.dedent(shown[0]).strip() if shown else ""


def joined(parts: Iterable[str]) -> str:
    """Return the parts of a page as one text."""
    return "\n\n".join(part.strip() for part in parts)


def markers(text: str) -> list[str]:
    """Return the names of the generated parts of a page."""
    return re.findall(r"^<!-- generated: (\S+) -->$", text, re.MULTILINE)


def replace_marked(text: str, marker: str, new: str) -> str:
    """Return *text* with *new* between ``<!-- generated: marker -->`` and ``<!-- end -->``.

    Raises:
        ValueError: The marker has no end.
    """
    pattern = rf"(<!-- generated: {re.escape(marker)} -->\n).*?(<!-- end -->)"
    found, count = re.subn(pattern, lambda match: f"{match[1]}\n{new}\n\n{match[2]}", text, flags=re.DOTALL)
    if not count:
        raise ValueError(f"the marker {marker!r} has no end")
    return found
