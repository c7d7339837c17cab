"""What a check found, as a file to hand in. It is not trusted: the program in it is judged again."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec

from elib.base.errors import ArgumentError
from elib.base.files import read_file
from elib.lab.labfile import HIDDEN, Lab
from elib.lab.tracer import VariantResult

ENDING = "-result.json"
"""How the name of such a file ends."""
MAX_SIZE = 4_000_000
"""Bytes of such a file."""


class Result(msgspec.Struct, forbid_unknown_fields=True):
    """A program and what was said of it."""

    lab: str  # the name of the lab
    digest: str
    program: str  # the text of the program
    verdicts: dict[str, dict[str, bool]]  # by the names of variants and goals, whether the goal holds there

    @contextmanager
    def unpacked(self) -> Iterator[Path]:
        """Yield a file with the program, which is there while the block lasts."""
        with TemporaryDirectory() as folder:
            file = Path(folder) / "program.py"
            file.write_text(self.program, "utf-8", "replace")
            yield file

    def doubt(self, lab: Lab, runs: Sequence[VariantResult]) -> str:
        """Return what is odd if the file says something else than a check does now; an empty string if it does not."""
        if all(self.verdicts.get(name) == goals for name, goals in _verdicts(runs).items()):
            return ""
        if self.digest != digest_of(lab):
            return "it is of a lab of this name with other goals or worlds"
        return "the check found something else"


def result_of(lab: Lab, program: str, runs: Sequence[VariantResult]) -> str:
    """Return the text of the file."""
    result = Result(lab.name, digest_of(lab), program, _verdicts(runs))
    return msgspec.json.format(msgspec.json.encode(result)).decode() + "\n"


def read_result(path: Path) -> Result:
    """Read such a file."""
    try:
        return msgspec.json.decode(read_file(path, "the result", largest=MAX_SIZE), type=Result)
    except (ValueError, RecursionError) as error:  # a bad byte is not an error of msgspec
        hint = "save it again where the program was checked"
        raise ArgumentError(f"{path} is not the result of a check: {error}", hint=hint) from None


def _verdicts(runs: Sequence[VariantResult]) -> dict[str, dict[str, bool]]:
    """Return which goals hold in which variant."""
    return {run.variant.name: {each.goal.name: each.holds for each in run.goals} for run in runs}


def digest_of(lab: Lab) -> str:
    """Return a digest of a lab's goals and worlds, without the hidden ones, which not everybody has."""
    digest = hashlib.blake2b(digest_size=16)
    for path in sorted(lab.folder.rglob("*.toml")):
        name = path.relative_to(lab.folder)
        if name.parts[0] != HIDDEN.partition("/")[0]:
            digest.update(f"{name.as_posix()}\n".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()
