"""The requests that bring some readings, or all, with as few round trips as the firmware allows."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

from elib.link.protocol import shapes, wifi
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context, Reply
from elib.link.protocol.forms import opcode
from elib.link.protocol.replies import GUARD, Guarded, Packed, Several
from elib.link.protocol.table import Request
from elib.link.protocol.values import Reading, Sensors
from elib.robot.snapshot import SENSORS

Found = dict[str, object]

SHOWN = 3
"""Number of names in the text of a request; the others are counted."""


@dataclass(frozen=True, slots=True)
class Poll:
    """A request, and the readings that its answer holds."""

    names: tuple[str, ...]
    request: Request[Found]

    def readings(self, found: Mapping[str, object]) -> dict[str, Reading]:
        """Return the readings in an answer: from answers of their own, and the others from the packet."""
        packet = found.get("packet")
        readings: dict[str, Reading] = {}
        for name in self.names:
            value = found[name] if name in found else getattr(packet, name, None)
            if isinstance(value, Reading):
                readings[name] = value
        return readings


def sensor_polls(context: Context) -> list[Poll]:
    """Return the requests of ``sensors()``: every reading that the firmware has."""
    profile = context.profile
    if profile.codec == "wifi":
        return polls([name for name in SENSORS if name not in profile.absent], context, "sensors()")
    packed = [name for name in SENSORS if name not in (*profile.absent, *profile.chain, *profile.tail)]
    return polls([*packed, *profile.chain, *profile.tail], context, "sensors()")


def polls(names: Sequence[str], context: Context, text: str = "") -> list[Poll]:
    """Return the requests for *names*: a single one if the receive ring of the firmware has room for it.

    Over Wi-Fi one packet has all readings. Elsewhere a single reading is asked for with its own command. Several
    readings share a binary frame if they have a binary form; text commands for the others follow in the same write, or
    in writes of their own if the ring would overflow.

    Args:
        names: Readings that the firmware has.
        context: What the connection knows.
        text: What each request is called; empty for the names of its readings.

    Raises:
        Unsupported: The firmware does not have one of them.
    """
    key = (*names, text)
    known = context.requests.get(key)
    if known is None:
        known = context.requests[key] = _polls(names, context, text)
    return cast("list[Poll]", known)


def _polls(names: Sequence[str], context: Context, text: str) -> list[Poll]:
    profile = context.profile
    if profile.codec == "wifi" and names:
        for name in names:
            SPECS[name].form(context)
        return [_poll(tuple(names), wifi.pair(context), _PACKET, text, make=wifi.pair)]
    if len(names) < 2:
        return [_single(name, context, text) for name in names]
    framed = [name for name in profile.chain if name in names]
    packed = [n for n in names if profile.sends_packet and n not in (*profile.chain, *profile.tail)]
    rest = [name for name in names if name not in (*framed, *packed)]
    parts = [_single(name, context, text) for name in rest]
    if len(framed) == 1 and not packed:
        parts.insert(0, _single(framed[0], context, text))
    elif framed or packed:
        parts.insert(0, _frame(framed, packed, context, text))
    if len(parts) == 1 or sum(len(part.request.data) for part in parts) > profile.receive_ring:
        return parts
    replies = tuple(part.request.reply for part in parts)
    data = b"".join(part.request.data for part in parts)
    return [_poll(tuple(names), data, Several(replies, lambda found, context: _merged(found)), text)]


def _single(name: str, context: Context, text: str) -> Poll:
    request = SPECS[name].request(context)
    reply = Several((request.reply,), lambda found, context: {name: found[0]})
    # It has the name of the command: after a lost answer, the session must not probe with the question that was lost.
    return Poll(
        (name,), Request(text or str(request), name, request.data, reply, service=request.service, is_poll=True)
    )


def _frame(chained: Sequence[str], packed: Collection[str], context: Context, text: str) -> Poll:
    codes = bytearray()
    keys: list[str] = []
    parts: list[Reply[object]] = []
    if packed:
        codes.append(opcode(shapes.PACKET_CODE))
        keys.append("packet")
        parts.append(_WHOLE_READINGS)
    for name in chained:
        form = SPECS[name].binary_form(context.profile)
        assert form is not None
        assert form.code is not None
        codes.append(form.code)
        keys.append(name)
        parts.append(form.reply)
    whole = Several(tuple(parts), lambda found, context: dict(zip(keys, found, strict=True)))
    return _poll((*packed, *chained), bytes(codes) + b"\0" + GUARD, Guarded(whole), text)


def _whole_readings(numbers: shapes.Values, context: Context) -> Sensors:
    """Return the readings of the packet, without those of which the firmware has more in an answer of their own."""
    profile = context.profile
    cut: dict[str, Any] = dict.fromkeys((*profile.chain, *profile.tail))
    return replace(shapes.packet_of(numbers, context), **cut)


_WHOLE_READINGS = Packed(shapes.PACKET_FORMAT, _whole_readings)
_PACKET: wifi.PacketReply[Found] = wifi.PacketReply(wifi.SENSORS, lambda value: {"packet": value})


def _poll(
    names: tuple[str, ...],
    data: bytes,
    reply: Reply[Found],
    text: str,
    *,
    make: Callable[[Context], bytes] | None = None,
) -> Poll:
    shown = names if len(names) <= SHOWN else (*names[:SHOWN], f"and {len(names) - SHOWN} more")
    # It has the name of sensors(): in the trace, both have the same kind of value.
    return Poll(names, Request(text or f"watch({', '.join(shown)})", "sensors", data, reply, make=make, is_poll=True))


def _merged(found: Sequence[object]) -> Found:
    return {name: value for readings in found if isinstance(readings, dict) for name, value in readings.items()}
