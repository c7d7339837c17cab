"""``elib et``, which is ``et`` by another name."""

from __future__ import annotations

from typing import Annotated

from cyclopts import App, Parameter

from elib.et import execute

ABOUT = "Copy, count and time the rows of a robot's log."


def build() -> App:
    """Return the parser of ``elib et``, which hands all words on as they are."""
    app = App(help=ABOUT, help_flags=[], version_flags=[], end_of_options_delimiter="")

    @app.default
    def command(*words: Annotated[str, Parameter(allow_leading_hyphen=True, show=False)]) -> None:
        execute(words, "elib et")

    return app
