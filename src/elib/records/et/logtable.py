"""Reads a log as a table of its calls, for pandas and NumPy."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from elib.base.errors import ArgumentError
from elib.base.files import open_file, reason_of
from elib.records.et.groups import text_of
from elib.records.et.pairing import COMMAND, EVENT, Pair, Pairing
from elib.records.et.rows import Block, RowError, blocks_of
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
    calls: list[tuple[float, bytes, bytes]] = []
    queues: list[NDArray[np.float64]] = []
    pairs: list[Pair] = []
    for block in _whole_blocks(path):
        pairs += pairing.pairs(block)
        is_call = np.array([word == b"call" for word in block.words(EVENT)], bool)
        numbers = np.stack([block.numbers(NOT_SENT), block.numbers(NOT_ANSWERED)])
        for place, time in zip(np.flatnonzero(is_call), block.numbers(0)[is_call].tolist(), strict=True):
            row = block.rows[place].split(b" ", 1)[1].rsplit(b" ", -EVENT)
            calls.append((time, row[0], row[COMMAND]))
        queues.append(numbers[:, is_call])
    waiting = np.concatenate([np.zeros((2, 0)), *queues], axis=1).astype(np.int64)
    outcomes, seconds = np.full(len(calls), "", "<U2"), np.full(len(calls), np.nan)
    for pair in pairs:
        outcomes[pair.call], seconds[pair.call] = text_of(pair.event), pair.latency
    shown = {word: logged_name(python_name(text_of(word)), names) for word in {word for *_, word in calls}}
    return {
        "time": np.array([time for time, _, _ in calls], np.float64),
        "robot": np.array([unquote(text_of(robot)) for _, robot, _ in calls], str),
        "command": np.array([shown[command] for *_, command in calls], str),
        "outcome": outcomes,
        "seconds": seconds,
        "not_sent": waiting[0],
        "not_answered": waiting[1],
    }


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
