"""Reads a log as a table of its calls, for pandas and NumPy."""

from __future__ import annotations

import os
from array import array
from collections.abc import Iterable, Iterator
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from elib.base.errors import ArgumentError
from elib.base.files import open_file, reason_of
from elib.records.et.pairing import COMMAND, EVENT, Pairing
from elib.records.et.rows import Block, RowError, blocks_of, text_of
from elib.records.log import Vocabulary, check_names, logged_name
from elib.records.lognames import python_name

NOT_SENT, NOT_ANSWERED = -2, -1
"""Columns, counted from the end."""


def read_log(path: str | os.PathLike[str], *, names: Vocabulary = "python") -> dict[str, NDArray[Any]]:
    """Read a log as a table: a row for each call, an array for each column.

    ``pandas.DataFrame(elib.read_log("run.log"))`` takes it as it is. The columns are ``time`` (s, when the call was
    made), ``robot``, ``command``, ``outcome`` (``ok``, ``ko``, or empty if the log does not say), ``seconds`` (from the
    call to its outcome, nan without one), and ``not_sent`` and ``not_answered``, the other calls at that moment.

    Logs with either kind of names are read, those of 2011 too. A last line that was cut off is left out.

    Args:
        path: The log.
        names: How ``command`` names the commands: as Python does, or as the library of 2011 did.

    Raises:
        ArgumentError: There are no such names, the file cannot be read, or a row is not one of a log. Then the message
            names its line.
    """
    check_names(names)
    pairing = Pairing()
    calls, seconds, are_ok = array("q"), array("d"), bytearray()
    robots: dict[bytes, int] = {}
    commands: dict[bytes, int] = {}
    columns = [[np.zeros(0, kind)] for kind in ("f8", "i4", "i4", "i8", "i8")]
    for block in _whole_blocks(path):
        for pair in pairing.pairs(block):
            calls.append(pair.call)
            seconds.append(pair.latency)
            are_ok.append(pair.event == b"ok")
        is_call = np.array([word == b"call" for word in block.words(EVENT)], bool)
        rows = [block.rows[place].split(b" ", 1)[1].rsplit(b" ", -EVENT) for place in np.flatnonzero(is_call)]
        found = (
            block.numbers(0)[is_call],
            _codes((row[0] for row in rows), robots),
            _codes((row[COMMAND] for row in rows), commands),
            block.numbers(NOT_SENT)[is_call].astype("i8"),
            block.numbers(NOT_ANSWERED)[is_call].astype("i8"),
        )
        for column, part in zip(columns, found, strict=True):
            column.append(part)
    time, robot, command, not_sent, not_answered = map(np.concatenate, columns)
    outcomes, waited = np.zeros(len(time), np.int8), np.full(len(time), np.nan)
    outcomes[calls] = 2 - np.frombuffer(are_ok, np.int8)
    waited[calls] = seconds
    shown = [logged_name(python_name(text_of(word)), names) for word in commands]
    return {
        "time": time,
        "robot": np.array([unquote(text_of(word)) for word in robots], str)[robot],
        "command": np.array(shown, str)[command],
        "outcome": np.array(["", "ok", "ko"])[outcomes],
        "seconds": waited,
        "not_sent": not_sent,
        "not_answered": not_answered,
    }


def _codes(words: Iterable[bytes], known: dict[bytes, int]) -> NDArray[np.int32]:
    """Return a number for each word; *known* grows by the words that are new."""
    return np.fromiter((known.setdefault(word, len(known)) for word in words), np.int32)


def _whole_blocks(path: str | os.PathLike[str]) -> Iterator[Block]:
    """Yield the lines of a log, without a last one that was cut off."""
    name = os.fspath(path)
    try:
        with open_file(path) as stream:
            for block in blocks_of(stream.read, str(name)):
                if block.is_whole or _is_row(block):
                    yield block
    except RowError:
        raise
    except (OSError, ValueError) as error:
        raise ArgumentError(f"the log {name!r} cannot be read: {reason_of(error)}", hint="check its path") from None


def _is_row(block: Block) -> bool:
    try:
        list(Pairing().pairs(block))
        block.numbers(NOT_SENT), block.numbers(NOT_ANSWERED)
    except RowError:
        return False
    return True
