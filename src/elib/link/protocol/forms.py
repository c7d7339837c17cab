"""The bytes of a request: a text line, or a binary frame."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import TypeVar

from elib.link.protocol.context import Context, Encoder, Form, Reply, Special
from elib.link.protocol.replies import GUARD, Guarded, LineReply, LinesReply

T = TypeVar("T")


def text_form(
    reply: LineReply[T] | LinesReply[T], encode: Encoder | None = None, *, special: Special[T] | None = None
) -> Form[T]:
    """Return the form of a text command: the letter and its numbers between commas, ended by a CR alone.

    Never CR LF: the LF would open a line that swallows a binary opcode (wire-protocol.md, trap 1).

    Args:
        reply: The shape of the answer, which has the letter.
        encode: Makes the request, if letter and numbers are not enough.
        special: Makes bytes and shape of the calls that need others.
    """

    def line(numbers: Sequence[int], context: Context) -> bytes:
        guard = GUARD if isinstance(reply, LinesReply) and reply.is_guarded else b""
        return ",".join([reply.letter, *map(str, numbers)]).encode("ascii") + b"\r" + guard

    return Form(encode or line, reply, letter=reply.letter, special=special)


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
    """Return the form of a binary command: opcode, parameters, the zero that ends the session, the guard.

    Args:
        code: The opcode: a letter or a number.
        reply: The shape of the answer.
        encode: Makes the request, if opcode and numbers are not enough.
        layout: What follows the opcode, as a format of :mod:`struct`.
        is_stateful: Whether the request contains what this program set before.
        is_guarded: Whether the guard follows; False if the answer has a header, which is check enough.
    """
    byte = opcode(code)

    def frame(numbers: Sequence[int], context: Context) -> bytes:
        return bytes((byte,)) + struct.pack(f"<{layout}", *numbers) + b"\0"

    return Form(encode or frame, reply, code=byte, layout=layout, is_stateful=is_stateful, is_guarded=is_guarded)


def prepare(form: Form[T], numbers: Sequence[int], context: Context) -> tuple[bytes, Reply[T]]:
    """Return the bytes of a request and the shape of its answer."""
    other = None if form.special is None else form.special(numbers, context)
    if other is not None:
        return other
    data = form.encode(numbers, context)
    return (data + GUARD, Guarded(form.reply)) if form.is_guarded else (data, form.reply)
