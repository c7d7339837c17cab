"""The e-puck2's one packet for all actuators, and what must go with it (protocol.md, 3.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from elib.protocol.context import Context
from elib.protocol.lamps import BODY, FRONT
from elib.protocol.replies import GUARD, Nothing, Reply, Several, acknowledgement, guarded
from elib.protocol.table import Form, opcode, text_form

ACTUATORS = 0x09
AVOID = 2
"""The flag that switches the obstacle avoidance."""
STOPPED: Reply[None] = acknowledgement("S")


def actuators_frame(context: Context, *, avoid: bool, speed: tuple[int, int]) -> bytes:
    """Return the packet with *speed* in steps/s, the lamps as last set and no sound, and the guard behind it."""
    lamps, rgb = context.last_set.lamps, context.last_set.rgb
    bits = sum(lamps[lamp] << bit for bit, lamp in enumerate((0, 2, 4, 6, BODY, FRONT)))
    wheels = b"".join(wheel.to_bytes(2, "little", signed=True) for wheel in speed)
    return bytes((opcode(ACTUATORS), AVOID if avoid else 0, *wheels, bits, *rgb, 0, 0)) + GUARD


@dataclass(frozen=True, slots=True)
class StopForm(Form[None]):
    """``S``, and before it the end of an obstacle avoidance, which ``S`` alone would leave driving."""

    def prepare(self, numbers: Sequence[int], context: Context) -> tuple[bytes, Reply[None]]:
        """Return the bytes and the shape of their answer."""
        line = self.encode(numbers, context)
        if not context.last_set.avoidance:
            return line, self.reply
        answer = Several((guarded(Nothing()), self.reply), lambda values, context: None)
        return actuators_frame(context, avoid=False, speed=(0, 0)) + line, answer


STOP_FORM = StopForm(text_form("S", STOPPED).encode, STOPPED)
