"""Files of plots by Matplotlib: the check before anything runs for one, and the writing."""

from __future__ import annotations

import importlib.util
import io
import warnings
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import install
from elib.base.files import write_file

SUFFIXES = (".png", ".svg", ".pdf")


def check_plot(path: str | PathLike[str]) -> None:
    """Check that a plot can be drawn into a file of this name."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise ArgumentError(f"a plot cannot become {fspath(path)!r}; its name must end in {', '.join(SUFFIXES)}")
    if importlib.util.find_spec("matplotlib") is None:
        raise Unsupported("plots need Matplotlib, which is not installed", hint=install("plot"))


def save(figure: Any, path: str | PathLike[str]) -> None:
    """Write a figure of Matplotlib into a file, in the form that its name says; an existing one is replaced.

    An SVG has the same bytes on every run: the names of its parts are random without a salt. No text becomes a
    formula, also between two dollars. What UTF-8 cannot write, as in some names of files, becomes a question mark.
    """
    from matplotlib import rc_context
    from matplotlib.text import Text

    form, page = Path(path).suffix.lower().removeprefix("."), io.BytesIO()
    for text in figure.findobj(Text):
        text.set_parse_math(False)
        text.set_text(text.get_text().encode("utf-8", "replace").decode())
    with (
        rc_context({"svg.hashsalt": "elib", "text.parse_math": False}),
        warnings.catch_warnings(action="ignore"),  # characters that the font does not have become boxes
    ):
        figure.savefig(page, format=form, metadata={"Date": None} if form == "svg" else None)
    write_file(path, page.getvalue())
