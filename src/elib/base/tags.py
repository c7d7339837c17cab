"""AprilTags: squares of black and white cells that carry a number, as simulator, printed sheet and pictures know them.

The cells of a number are those of the families tag16h5 and tag36h11 (april.eecs.umich.edu/software/apriltag).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from elib.base.errors import ArgumentError

_16H5: Final = """
    d8c4 a574 562c 9da2 659e d6fe 1acd a2e7 9a7f b6a8 d01c d50f 21b0 6ce2 4e31 08f5 3c90 2dc9 c0a5 f162 ec87 a9ea 42fb
    b838 3b97 b5ce fab5 0cab 53e0 74f5
"""
_36H11: Final = """
    21a146bab 92d18fe9b 7089014bb 193979e27 44153d3d7 35cd5b8cf a10ba56a0 2b874a608 b57fb8d44 4e20b5a64 61d897f2c
    ab3469ffc 594ca45c2 fa1c2d2e2 97c24b972 75928624a 1caafe99a 3236ddc16 884e527d6 5771a8c7e f52925b81 2e59cc1a1
    7fa58ab31 eb43384f9 3913d5345 d79b1a3b5 0dfbe768d 5cd7a031d b9c8f7a4b 46987e06b 6e0c5d527 5bc567bb4 1e6302bc2
    8ac7d046a a65fe2326 5400eb616 f7a066836 2dd0afdf6 3b9cb60b1 ad6a1caf9 93b62efb5 bb210d93d dee55094b a0cd1479b
    2a23abb27 4f67f4b5f 58a815818 743427d64 1dec40874 892ab3a02 38d5742ee 0c43567a1 5db311cb1 c957ca1f9 a22457823
    29ace98f3 ccc52c528 da8b3578c d5b4b9e36 ac9cdd3ce cbdaa8391 1986256b1 bae6cc889 df91b10e5 a1a9d5a75 2b651aa9d
    4d5c2e19d 5b163736b f753d60a8 5e84b37d2 fce43a9f2 bb926d1a6 ed8d236e5 6af846f37 ea56a5138 5d497146c 470360eca
    8c4bcd67a 295f3901e f6b577e97 520602f5a b5119492e 48e299ab7 b79f5737a a814c683e 2da900583 d4aba4797 982a0e65c
    f480ccc15 0b20ea732 a9506710a 0486e2ee1 b0a972615 e73f3a257 17e205b98 ec9ab2b24 d9339e076 eb8874f99 9420a55cc
    e364ff992
"""

FAMILIES: Final[Mapping[str, tuple[int, tuple[int, ...]]]] = {
    "16h5": (4, tuple(int(each, 16) for each in _16H5.split())),
    "36h11": (6, tuple(int(each, 16) for each in _36H11.split())),
}
"""Of each family the cells in a row of its code, and the codes of its numbers: all 30 of 16h5, the first 100 of 587 of
36h11. The highest bit is the upper left cell; 1 is white."""


def codes(family: str) -> tuple[int, tuple[int, ...]]:
    """Return the cells in a row of a family's code, and its codes.

    Raises:
        ArgumentError: There is no such family.
    """
    try:
        return FAMILIES[family]
    except (KeyError, TypeError):
        raise ArgumentError(
            f"there is no family {family!r} of tags", hint=f"choose one of {', '.join(FAMILIES)}"
        ) from None


def cells(family: str, number: int) -> list[list[bool]]:
    """Return the cells of a tag, row by row from above, with its black border: whether each is white.

    Raises:
        ArgumentError: There is no such tag.
    """
    side, known = codes(family)
    if not 0 <= number < len(known):
        raise ArgumentError(f"there is no tag {number} of {family}; its numbers are 0 to {len(known) - 1}")
    bits = [bool(known[number] >> place & 1) for place in reversed(range(side * side))]
    rows = [[False, *bits[k : k + side], False] for k in range(0, side * side, side)]
    edge = [False] * (side + 2)
    return [edge, *rows, edge]


FACES: Final = (
    "",
    *(f"tag:{number}" for number in range(len(FAMILIES["16h5"][1]))),
    *(f"tag36h11:{number}" for number in range(len(FAMILIES["36h11"][1]))),
)
"""What a surface of a world may show: nothing, or a tag."""


def face_cells(face: str) -> list[list[bool]]:
    """Return the cells of one of :data:`FACES`, with a white rim of one cell; none of nothing."""
    if not face:
        return []
    kind, _, number = face.partition(":")
    found = cells(kind.removeprefix("tag") or "16h5", int(number))
    rim = [True] * (len(found) + 2)
    return [rim, *([True, *row, True] for row in found), rim]
