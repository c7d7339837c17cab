"""The command ``elib et``, which does the same as the program ``et``."""

from __future__ import annotations

from typing import Annotated

from cyclopts import App, Parameter

from elib.records.et import execute

app = App(name="et", help_flags=[], version_flags=[], end_of_options_delimiter="")


@app.default
def et(*words: Annotated[str, Parameter(allow_leading_hyphen=True)]) -> None:
    """Hand all words on to ``et`` as they are."""
    execute(words, "elib et")
