"""Build the documentation as a site that works without the internet, in the folder ``site``; ``make site`` runs it.

The pages are the Markdown files of this folder. They are copied first, because a few links lead out of ``docs``: what
they lead to becomes a page too. The navigation is the lists of ``docs/README.md``, in their order.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
ROOT = DOCS.parent
sys.path[:0] = [str(ROOT), str(ROOT / "release")]

from hatch_build import NoPage  # noqa: E402
from try_links import LABS, with_links  # noqa: E402

import studio  # noqa: E402

LINK = re.compile(r"(\]\()(?!https?://)([^)\s#]*)(#[^)\s]*)?\)")
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
ENTRY = re.compile(r"(?:-|\d+\.) \[([^]]+)\]\(([^)\s]+)\)")

SHIM = "https://unpkg.com/iframe-worker/shim"
"""What the theme would fetch for a search in a page that was opened as a file; ``site/worker.js`` does that here."""

TRIED = ("tutorial/", "cookbook/", "labs.md")
"""The pages whose programs the studio opens."""

PROMPT = re.compile(r'<span class="gp">([^<]*)</span>')


def install() -> str:
    """Return the page about installing: the section of the README."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(r"^## Install\n.*?(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    if found is None:
        sys.exit('README.md has no section "## Install"')
    return found[0].removeprefix("#")


CLIENTS = {"node/avoid.mjs": "js", "browser/avoid.html": "html", "csharp/Avoid.cs": "csharp", "cpp/avoid.cpp": "cpp"}
"""The example clients of ``elib serve``, and the names of their languages."""


def examples() -> str:
    """Return a page with every example, in order."""
    parts = [
        "# Examples\n\nShort programs, one idea each, in order. They are the files of the folder `examples`. Each "
        "takes the URL of a robot on its command line, and a virtual robot without one. Programs 17 and 18 need the "
        "extra `record`."
    ]
    for path in sorted((ROOT / "examples").glob("*.py")):
        text = path.read_text(encoding="utf-8")
        first, _, _ = (ast.get_docstring(ast.parse(text)) or "").partition("\n")
        title = path.stem[3:].replace("_", " ").capitalize()
        parts.append(f"## {title}\n\n{first} The file is `{path.name}`.\n\n```python\n{text.rstrip()}\n```")
    for name, language in CLIENTS.items():
        text = (ROOT / "examples/clients" / name).read_text(encoding="utf-8")
        parts.append(f"## A client in another language: {name}\n\n```{language}\n{text.rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


def licence() -> str:
    """Return the page with elib's licence."""
    return f"# Licence\n\n```text\n{(ROOT / 'LICENSE').read_text(encoding='utf-8').rstrip()}\n```\n"


OUTSIDE = {
    "README.md#install": ("install.md", install),
    "README.md": ("index.md", None),
    "examples": ("examples.md", examples),
    **{f"examples/clients/{name}": ("examples.md", examples) for name in CLIENTS},
    "CONTRIBUTING.md": ("contributing.md", lambda: (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")),
    "LICENSE": ("licence.md", licence),
    "tests/golden/README.md": (
        "golden.md",
        lambda: (ROOT / "tests/golden/README.md").read_text(encoding="utf-8"),
    ),
}
"""Where links that leave ``docs`` lead: the page of the site, and what makes it."""


def page_of(path: Path, anchor: str) -> tuple[str, str]:
    """Return the page of the site, and the anchor on it, for a file or folder of the project."""
    if path.is_relative_to(LABS) and path.suffix == ".svg":
        return f"images/labs/{path.parent.name}.svg", ""
    if path == DOCS / "decisions":
        return "index.md", "#decisions"
    if path.is_relative_to(DOCS):
        name = path.relative_to(DOCS).as_posix()
        return ("index.md" if name == "README.md" else name), anchor
    name = path.relative_to(ROOT).as_posix()
    if name + anchor in OUTSIDE:
        return OUTSIDE[name + anchor][0], ""
    if name in OUTSIDE:
        return OUTSIDE[name][0], anchor
    sys.exit(f"a link leads to {name}{anchor}, which the site does not have; add it to OUTSIDE in docs/make_site.py")


def relinked(text: str, source: Path, page: str) -> str:
    """Return a page's text with its links leading to the pages of the site; code blocks stay as they are."""

    def replace(link: re.Match[str]) -> str:
        target, anchor = link[2], link[3] or ""
        if not target:
            return link[0]
        name, anchor = page_of((source.parent / target).resolve(), anchor)
        return f"{link[1]}{os.path.relpath(name, Path(page).parent).replace(os.sep, '/')}{anchor})"

    parts, end = [], 0
    for block in FENCE.finditer(text):
        parts += [LINK.sub(replace, text[end : block.start()]), block[0]]
        end = block.end()
    return "".join([*parts, LINK.sub(replace, text[end:])])


def navigation() -> list[Any]:
    """Read the navigation from the lists of ``docs/README.md``.

    A heading is a section. A line such as "Simulate:" above a list is a section within it.
    """
    nav: list[Any] = []
    place = chapter = nav
    before = ""
    for line in (DOCS / "README.md").read_text(encoding="utf-8").splitlines():
        if heading := re.match(r"(##+) (.*)", line):
            place = []
            (nav if heading[1] == "##" else chapter).append({heading[2]: place})
            if heading[1] == "##":
                chapter = place
        elif entry := ENTRY.match(line):
            if before.endswith((":", "?")) and not before.startswith(("-", "#")) and len(before) < 40:
                place = []
                chapter.append({before.rstrip(":"): place})
            target, _, anchor = entry[2].partition("#")
            page, _ = page_of((DOCS / target).resolve(), f"#{anchor}" if anchor else "")
            title = entry[1].replace("`", "")
            place.append(page if title.isdecimal() else {title: page})
        if line:
            before = line
    return [entry for entry in nav if isinstance(entry, str) or any(entry.values())]


def pages_in(nav: list[Any]) -> set[str]:
    """Return the pages that a navigation leads to."""
    found: set[str] = set()
    for entry in nav:
        for value in entry.values() if isinstance(entry, dict) else [entry]:
            found |= {value} if isinstance(value, str) else pages_in(value)
    return found


def stage(folder: Path, *, has_studio: bool = False) -> None:
    """Write the sources of the site into *folder*; with the studio, programs have links that open them there."""
    nav = [{"Start": ["index.md"]}, *navigation()]
    docs = folder / "docs"
    for path in sorted([*DOCS.rglob("*"), *LABS.glob("*/world.svg")]):
        name = page_of(path, "")[0]
        if path.suffix == ".md":
            text = path.read_text(encoding="utf-8")
            if has_studio and name.startswith(TRIED):
                text = with_links(text, name)
            write(docs / name, relinked(text, path, name))
        elif path.suffix in (".svg", ".png", ".webp", ".css", ".js", ".ipynb"):
            (docs / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, docs / name)
    for key, (name, make) in OUTSIDE.items():
        if make is not None:
            write(docs / name, relinked(make(), ROOT / key.partition("#")[0], name))
    if unlisted := sorted({path.relative_to(docs).as_posix() for path in docs.rglob("*.md")} - pages_in(nav)):
        sys.exit(f"docs/README.md does not list {', '.join(unlisted)}")
    settings = (DOCS / "site/zensical.toml").read_text(encoding="utf-8")
    write(folder / "zensical.toml", settings.replace("[project]\n", f"[project]\nnav = {as_toml(nav)}\n", 1))


def as_toml(value: Any) -> str:
    """Return a list, a dict or a text as TOML on one line."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{as_toml(key)} = {as_toml(each)}" for key, each in value.items()) + "}"
    return "[" + ", ".join(as_toml(each) for each in value) + "]"


def write(path: Path, text: str) -> None:
    """Write a file and the folders that it is in."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def build(target: Path) -> int:
    """Build the site into *target*, in place of what is there; return the exit code."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            studio.build(folder / "studio")
        except NoPage as error:
            print(f"The site has no studio. {error}", file=sys.stderr)
        has_studio = (folder / "studio").exists()
        stage(folder, has_studio=has_studio)
        command = [sys.executable, "-m", "zensical", "build", "--strict"]
        if code := subprocess.run(command, cwd=folder, check=False).returncode:
            return code
        built = folder / "site"
        for path in built.rglob("*.html"):
            script = os.path.relpath(built / "site/worker.js", path.parent).replace(os.sep, "/")
            text = path.read_text(encoding="utf-8").replace(SHIM, script)
            # A style sheet writes the prompts, so that the button "copy" leaves them out.
            path.write_text(PROMPT.sub(r'<span class="gp" data-prompt="\1"></span>', text), encoding="utf-8")
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(built, target)
        if has_studio:
            shutil.copytree(folder / "studio", target / "studio")
    return 0


def main() -> int:
    """Read the command line and build the site; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--to", type=Path, default=ROOT / "site", help="the folder to write, in place of what is there")
    target: Path = parser.parse_args().to
    if target.exists() and any(target.iterdir()) and not (target / "site/worker.js").exists():
        sys.exit(f"{target} holds something else than the site; name another folder")
    code = build(target)
    if code == 0:
        print(f"Open {target / 'index.html'} in a browser.")
    return code


if __name__ == "__main__":
    sys.exit(main())
