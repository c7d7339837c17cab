"""The options ``--log``, ``--log-names`` and ``--record``, which several commands share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.cli.arguments import option
from elib.records.log import Vocabulary
from elib.robot.runner import Records

LogNames = Annotated[Vocabulary, option("--log-names NAMES", "Names of the commands in the log: python or 2011.")]


@dataclass(frozen=True)
class RecordOptions(Records):
    """What is recorded of a run: each field is an option."""

    log: Annotated[str | None, option("--log FILE", "Append a line for each call and its outcome to this file.")] = None
    log_names: LogNames = "python"
    record: Annotated[str | None, option("--record FILE.mcap", "Record everything that happens on the link.")] = None


Kept = Annotated[RecordOptions, Cli(name="*")]
NOTHING_KEPT = RecordOptions()


def own_name(path: str, word: str) -> str:
    """Return the file of one robot of several: ``run-WORD.mcap``."""
    word = "".join(letter if letter.isalnum() or letter in "-_." else "-" for letter in word)
    file = Path(path)
    return str(file.with_name(f"{file.stem}-{word}{file.suffix}"))
