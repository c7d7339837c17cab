"""The submissions in a folder: what counts as one, and which of its files is the program."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass, field
from pathlib import Path

from elib.base.errors import ArgumentError
from elib.base.files import open_file, reason_of
from elib.lab.result import ENDING, read_result

MAX_FILES, MAX_BYTES = 200, 16 << 20
"""Files of a submission, and bytes of them together, at most."""
MAIN_FILES = ("main.py", "start.py")
"""Names of the program if a folder has several; a file that is called like the folder is one too."""


@dataclass(frozen=True, slots=True)
class Submission:
    """What one student handed in."""

    name: str  # its file or folder, as it is called in the folder of all submissions
    folder: Path  # the folder of all submissions
    main: str = ""  # the program among its files
    files: dict[str, bytes] = field(default_factory=dict)  # the content of its files by their paths within it
    problem: str = ""  # why it cannot be run, or an empty string

    @property
    def text(self) -> str:
        """All its Python, as text."""
        return "\n".join(
            content.decode(errors="replace") for name, content in sorted(self.files.items()) if name.endswith(".py")
        )


def find_submissions(folder: Path) -> list[Submission]:
    """Return the submissions in *folder*: each Python file or result of a check, and each folder with a Python file.

    Names that begin with a dot or an underscore are passed over.
    """
    try:
        places = sorted(place for place in folder.iterdir() if place.name[0] not in "._")
    except OSError as error:
        raise ArgumentError(
            f"{folder} cannot be read: {reason_of(error)}", hint="name the folder with all that was handed in"
        ) from None
    found = [
        read_submission(place)
        for place in places
        if place.name.endswith((".py", ENDING)) or (place.is_dir() and (place.is_symlink() or any(place.glob("*.py"))))
    ]
    if not found:
        raise ArgumentError(
            f"{folder} has no submissions",
            hint="a submission is a file such as anna.py, or a folder with a main.py",
        )
    return found


def read_submission(place: Path) -> Submission:
    """Return what lies in a file or a folder as a submission."""
    name = place.name.encode(errors="replace").decode()
    if place.is_symlink():  # it could lead to another one's work, or to the teacher's
        return Submission(name, place.parent, problem="it is a link, not a file")
    try:
        if place.name.endswith(ENDING):
            return Submission(name, place.parent, "program.py", {"program.py": read_result(place).program.encode()})
        if not place.is_dir():
            return Submission(name, place.parent, name, {name: _content(place, MAX_BYTES)})
        files = _files(place)
    except (OSError, ValueError) as error:
        return Submission(name, place.parent, problem=reason_of(error))
    programs = [file for file in files if file.endswith(".py") and "/" not in file]
    for wanted in (*MAIN_FILES, f"{place.name}.py", *(programs if len(programs) == 1 else ())):
        if wanted in programs:
            return Submission(name, place.parent, wanted, files)
    return Submission(name, place.parent, problem="it has several programs, and none is called main.py")


def _files(place: Path) -> dict[str, bytes]:
    """Return the content of all regular files in a folder; links are left out."""
    files: dict[str, bytes] = {}
    room = MAX_BYTES
    for folder, folders, names in os.walk(place):
        folders[:] = sorted(name for name in folders if name != "__pycache__")
        for name in sorted(names):
            path = Path(folder) / name
            if not stat.S_ISREG(path.lstat().st_mode):
                continue
            if len(files) == MAX_FILES:
                raise ValueError(f"it has more than {MAX_FILES} files")
            key = path.relative_to(place).as_posix().encode(errors="replace").decode()
            files[key] = _content(path, room)
            room -= len(files[key])
    return files


def _content(path: Path, room: int) -> bytes:
    with open_file(path) as stream:
        content = stream.read(room + 1)
    if len(content) > room:
        raise ValueError(f"it has more than {MAX_BYTES >> 20} MB")
    return content
