"""A page in the user's browser."""

from __future__ import annotations

import os
import sys
import threading
import webbrowser

VARIABLE = "ELIB_BROWSER"
"""The environment variable that keeps pages from being opened, with the value ``no``."""


def show_page(url: str) -> None:
    """Open a page, if a browser can show it here and the environment does not forbid it."""
    has_display = sys.platform in ("win32", "darwin")
    has_display |= any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")))
    if has_display and os.environ.get(VARIABLE) != "no":
        # In a thread: some browsers return only when they end.
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
