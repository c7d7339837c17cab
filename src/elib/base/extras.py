"""What to type where the packages of an extra are missing: the command names the files that elib was installed from."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from elib.base.errors import Unsupported
from elib.base.files import PACKAGE, PAGE

if TYPE_CHECKING:
    from importlib.metadata import Distribution

NAME = "elib-epuck"


def check_web() -> None:
    """Check that what the page in the browser needs is installed.

    Raises:
        Unsupported: The extra ``web`` is not installed.
    """
    try:
        import aiohttp  # noqa: F401
    except ImportError:
        raise Unsupported(
            "the page in the browser needs the package aiohttp, which is not installed",
            hint=install("web"),
        ) from None


def page_folder() -> Path:
    """Return the folder of the page in the browser.

    Raises:
        Unsupported: The page is not built.
    """
    folder, checkout = PACKAGE / PAGE, PACKAGE.parents[1]
    if (folder / "index.html").exists():
        return folder
    if (checkout / "page").exists():
        raise Unsupported("the page in the browser is not built", hint=f"build it, in the folder {checkout}: make page")
    raise Unsupported(
        "the page in the browser is not built",
        hint="install elib again where npm's registry can be reached, or from a wheel that has the page",
    )


def install(extra: str) -> str:
    """Return the hint for an extra whose packages are not installed: a command that can be pasted as it is."""
    if sys.platform == "emscripten":  # a page of a browser has no pip
        return "run this program on a computer: the studio has no such packages"
    return f"install the extra {extra}: {_installer()} {_what(extra)}"


def _installer() -> str:
    """Return the call of pip that installs for this Python; pip alone may be that of another one."""
    python = Path(sys.executable)
    quoted = f'"{python}"' if " " in str(python) else str(python)
    if importlib.util.find_spec("pip") is None and shutil.which("uv"):
        return f"uv pip install --python {quoted}"
    found = shutil.which("pip")
    return "pip install" if found and Path(found).parent == python.parent else f"{quoted} -m pip install"


def _what(extra: str) -> str:
    """Return what to install: elib with the extra from where it came from, or else the packages of the extra."""
    from importlib.metadata import PackageNotFoundError, distribution  # it takes longer to import than all of ours

    try:
        installed = distribution(NAME)
    except PackageNotFoundError:  # the folder src is on the path
        return f'-e "{PACKAGE.parents[1]}[{extra}]"'
    source, is_editable = _source(installed)
    if source is not None and source.exists():
        return f'{"-e " * is_editable}"{source}[{extra}]"'
    needed = [line.partition(";") for line in installed.requires or ()]
    of_extra = re.compile(rf"""\bextra\s*==\s*["']{extra}["']""")
    return " ".join(f'"{package.strip()}"' for package, _, marker in needed if of_extra.search(marker))


def _source(installed: Distribution) -> tuple[Path | None, bool]:
    """Return the folder or file that elib was installed from, if it was one, and whether Python reads it there."""
    from urllib.parse import urlsplit
    from urllib.request import url2pathname

    direct = json.loads(installed.read_text("direct_url.json") or "{}")
    url = urlsplit(direct.get("url", ""))
    path = Path(url2pathname(url.path)) if url.scheme == "file" else None
    return path, direct.get("dir_info", {}).get("editable", False)
