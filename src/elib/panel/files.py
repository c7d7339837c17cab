"""Names of files that a page asks for: they lie in one folder, and no name leads out of it."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

from elib.base.errors import ArgumentError

LOG, RECORDING, WORLD, MAP = ".log", ".mcap", ".toml", ".png"
MAX_NAME = 80
"""Characters of a name; file systems take 255 bytes, and four bytes make a character at most."""
DEVICES = frozenset(
    ("con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in "0123456789"))
)
"""Names that mean devices on Windows, with any ending."""
FORBIDDEN = frozenset('/\\:*?"<>|%$~`')
"""Characters that separate folders on some system, name drives or streams, or mean something to a shell."""


class Folder:
    """The one folder that a page may name files in."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path).resolve()
        if not self.path.is_dir():
            raise ArgumentError(f"{str(path)!r} is not a folder", hint="make it first, or name another")

    def file(self, name: str, suffix: str) -> Path:
        """Return the path of a file of this folder.

        An ArgumentError says that it is not a plain name, has another ending, or that a link or a folder has that name.

        Args:
            name: As typed; the ending may be left out.
            suffix: The ending it must have, like ``.log``.
        """
        path = self.path / plain_name(name, suffix)
        # A link could lead anywhere; a pipe or a device would never take the bytes.
        if path.is_symlink() or (path.exists() and not path.is_file()):
            raise ArgumentError(f"{path.name!r} is not a plain file there", hint="take another name")
        return path

    def free(self, stem: str, suffix: str) -> str:
        """Return a name that no file has: ``run.log``, ``run-2.log`` and so on.

        *stem* is any text; characters that a name cannot have become dashes.
        """
        kept = "".join(letter if letter.isalnum() or letter in "_-" else "-" for letter in stem)
        clean = re.sub("-+", "-", kept).strip("-")[: MAX_NAME - 20] or "run"
        clean = f"{clean}-1" if clean.lower() in DEVICES else clean
        for number in itertools.count(1):
            name = f"{clean}{suffix}" if number == 1 else f"{clean}-{number}{suffix}"
            if not (self.path / name).exists():
                return name
        raise AssertionError("numbers never end")

    def new_file(self, name: str, suffix: str) -> Path:
        """Return the path of a file that must not exist yet, as :meth:`file` does."""
        path = self.file(name, suffix)
        if path.exists():
            raise ArgumentError(f"{path.name!r} exists", hint=f"{self.free(path.stem, suffix)!r} is free")
        return path


def plain_name(name: str, suffix: str) -> str:
    """Return *name* with its ending; an ArgumentError says that it is not the plain name of such a file."""
    text = name.strip()
    if not text:
        raise ArgumentError("the file has no name", hint=f"like run{suffix}")
    if len(text) > MAX_NAME:
        raise ArgumentError(f"the name of the file has {len(text)} characters; it may have {MAX_NAME}")
    if not text.isprintable() or FORBIDDEN & set(text) or text.startswith((".", "-")) or text.endswith("."):
        raise ArgumentError(
            f"{text!r} is not a name for a file here",
            hint=f"it must not have {' '.join(sorted(FORBIDDEN))}, nor begin with a dot or a dash",
        )
    stem, dot, ending = text.rpartition(".")
    if not dot:
        stem, text = text, text + suffix
    elif f".{ending}".lower() != suffix:
        raise ArgumentError(f"{text!r} must end in {suffix}")
    if stem.partition(".")[0].strip().lower() in DEVICES:
        raise ArgumentError(f"{text!r} is the name of a device on Windows", hint="take another name")
    return text
