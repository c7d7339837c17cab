"""The lamps: the one command whose words differ by generation, and what is known of the lamps' state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from elib.protocol.context import Context
from elib.protocol.quantities import LedAction
from elib.protocol.replies import GUARD, Nothing, Reply, acknowledgement, guarded
from elib.protocol.table import Form, opcode, text_form

RING, BODY, FRONT = range(8), 8, 9
ALL = 8
RGB_RED = 10
"""Percent. What ``L`` lights an RGB LED of the e-puck2 with (protocol.md, 5.2)."""
ACKNOWLEDGED: Reply[None] = acknowledgement("L")


@dataclass(frozen=True, slots=True)
class LedForm(Form[None]):
    """``L,n,action``; on the e-puck1 "all, toggle" would switch all off, so eight commands go in one binary frame.

    These answer nothing, so nothing has to wait in a receive ring meanwhile, however small.
    """

    def prepare(self, numbers: Sequence[int], context: Context) -> tuple[bytes, Reply[None]]:
        """Return the bytes and the shape of their answer."""
        led, action = numbers
        if led == ALL and action == LedAction.TOGGLE and not context.profile.toggles_all:
            commands = (bytes((opcode("L"), each, action)) for each in RING)
            return b"".join(commands) + b"\0" + GUARD, guarded(Nothing())
        return self.encode(numbers, context), self.reply


LED_FORM = LedForm(text_form("L", ACKNOWLEDGED).encode, ACKNOWLEDGED)


def _switch(context: Context, lamp: int, action: int) -> None:
    lamps = context.last_set.lamps
    lamps[lamp] = 1 - lamps[lamp] if action == LedAction.TOGGLE else action
    if context.profile.name == "epuck2" and lamp in (1, 3, 5, 7):
        at = lamp // 2 * 3
        rgb = context.last_set.rgb
        red = 0 if action == LedAction.OFF or (action == LedAction.TOGGLE and rgb[at]) else RGB_RED
        rgb[at : at + 3] = [red, rgb[at + 1], rgb[at + 2]] if action == LedAction.TOGGLE else [red, 0, 0]


def remember_led(numbers: Sequence[int], context: Context) -> None:
    """Note what ``L`` has switched."""
    led, action = numbers
    for lamp in RING if led == ALL else (led,):
        _switch(context, lamp, action)


def remember_body(numbers: Sequence[int], context: Context) -> None:
    """Note what ``B`` has switched."""
    _switch(context, BODY, numbers[0])


def remember_front(numbers: Sequence[int], context: Context) -> None:
    """Note what ``F`` has switched."""
    _switch(context, FRONT, numbers[0])


def remember_rgb(numbers: Sequence[int], context: Context) -> None:
    """Note the colour of one RGB LED."""
    led, *colour = numbers
    context.last_set.rgb[led // 2 * 3 : led // 2 * 3 + 3] = colour


def remember_dark_ring(context: Context) -> None:
    """Note that all ring LEDs are off."""
    context.last_set.lamps[:8] = [0] * 8
    context.last_set.rgb[:] = [0] * 12
