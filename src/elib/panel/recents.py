"""The robots that were connected before, remembered from one run to the next."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import tempfile
from pathlib import Path

import msgspec
from msgspec import Struct

from elib.base.errors import ArgumentError, ElibError
from elib.base.files import write_file
from elib.link.transport import parse_url

MAX_KEPT = 12
"""Robots that are remembered."""
MAX_URL = 500
"""Characters of a URL."""
MAX_BYTES = 64_000
"""Bytes of the file that are read; ours has some thousand at most."""
FILE = "recent-robots.json"


def state_folder() -> Path:
    """Return elib's own folder among those where programs of this system keep their state; it may not exist."""
    home = Path.home()
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or os.environ.get("APPDATA") or home / "AppData/Local") / "elib"
    if sys.platform == "darwin":
        return home / "Library/Application Support/elib"
    chosen = os.environ.get("XDG_STATE_HOME", "")
    # A relative path is to be ignored (XDG base directory specification).
    return (Path(chosen) if os.path.isabs(chosen) else home / ".local/state") / "elib"


class _Kept(Struct):
    """What the file holds."""

    robots: list[object]


class RecentRobots:
    """The URLs of robots, the newest first. Nothing here fails: a file that cannot be read or written is empty."""

    def __init__(self, path: str | Path | None = None) -> None:
        if path is None:
            try:
                path = state_folder() / FILE
            except RuntimeError:  # a user without a home
                path = Path(tempfile.gettempdir()) / FILE
        self.path = Path(path)  # the file; in the user's state folder unless given

    @property
    def urls(self) -> list[str]:
        """The URLs, the newest first; none if the file is missing or damaged."""
        return self._read()[0]

    def add(self, url: str) -> bool:
        """Remember a robot as the newest; return whether that was written. An ArgumentError refuses what is no URL."""
        check_url(url)
        urls, is_damaged = self._read()
        return self._write([url, *(each for each in urls if each != url)][:MAX_KEPT], is_damaged)

    def remove(self, url: str) -> bool:
        """Forget a robot; return whether that could be written."""
        urls, is_damaged = self._read()
        return self._write([each for each in urls if each != url], is_damaged)

    def _read(self) -> tuple[list[str], bool]:
        """Return the URLs, and whether the file holds something else."""
        try:
            with open(self.path, "rb") as file:
                data = file.read(MAX_BYTES + 1)
        except FileNotFoundError:
            return [], False
        except OSError:
            return [], True
        try:
            found = msgspec.json.decode(data[:MAX_BYTES], type=_Kept).robots
        except (ValueError, RecursionError):  # a bad byte is not an error of msgspec
            return [], True
        urls: dict[str, None] = {}
        for each in found:
            with contextlib.suppress(ElibError):
                check_url(each)
                urls[str(each)] = None
        return list(urls)[:MAX_KEPT], False

    def _write(self, urls: list[str], is_damaged: bool) -> bool:
        """Replace the file in one step, so that another program never reads half of it."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if is_damaged:  # a person may want to see what it was
                self.path.replace(self.path.with_suffix(".damaged"))
            write_file(self.path, json.dumps({"robots": urls}, indent=1, ensure_ascii=False).encode())
        except (OSError, UnicodeError, ElibError):
            return False
        return True


def check_url(url: object) -> None:
    """Raise an ArgumentError if this is not the URL of a robot."""
    if not isinstance(url, str) or not url.strip() or len(url) > MAX_URL or not url.isprintable():
        raise ArgumentError(f"a robot's URL is one line of 1 to {MAX_URL} characters")
    parse_url(url)
