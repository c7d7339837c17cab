"""The bytes of a request: a text line, or a binary frame."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import TypeVar

from elib.protocol.context import Context, Encoder, Form, Reply, Special
from elib.protocol.replies import GUARD, guarded

T = TypeVar("T")


def text_form(
    letter: str, reply: Reply[T], encode: Encoder | None = None, special: Special[T] | None = None
) -> Form[T]:
    """Return the form of a text command: the letter and its numbers between commas, ended by a CR alone.

    Never CR LF: the LF would open a line that swallows a binary opcode (wire-protocol.md, trap 1).
    """

    def line(numbers: Sequence[int], context: Context) -> bytes:
        return ",".join([letter, *map(str, numbers)]).encode("ascii") + b"\r"

    return Form(encode or line, reply, special=special)


def opcode(code: str | int) -> int:
    """Return the opcode byte of a letter, or of a small number on the e-puck2: 256 minus it (wire-protocol.md, 3)."""
    return 256 - (ord(code) if isinstance(code, str) else code)


def binary_form(
    code: str | int,
    reply: Reply[T],
    encode: Encoder | None = None,
    *,
    layout: str = "",
    is_stateful: bool = False,
    is_guarded: bool = True,
) -> Form[T]:
    """Return the form of a binary command: opcode, parameters, the zero that ends the session, the guard."""
    byte = opcode(code)

    def frame(numbers: Sequence[int], context: Context) -> bytes:
        return bytes((byte,)) + struct.pack(f"<{layout}", *numbers) + b"\0"

    bare = encode or frame
    if not is_guarded:
        return Form(bare, reply, byte, layout, is_stateful=is_stateful)
    return Form(
        lambda numbers, context: bare(numbers, context) + GUARD,
        guarded(reply),
        byte,
        layout,
        is_stateful=is_stateful,
    )
