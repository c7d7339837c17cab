"""All readings at once, in as few writes as the firmware bears."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from elib.protocol import shapes
from elib.protocol.commands import SPECS
from elib.protocol.context import Context, Reply
from elib.protocol.forms import opcode
from elib.protocol.replies import GUARD, Several, guarded, unguarded
from elib.protocol.table import Request
from elib.protocol.values import Sensors

PACKET = 0x08
"""The e-puck2's "all sensors"."""


def sensor_requests(context: Context) -> list[Request[dict[str, object]]]:
    """Return the requests whose answers together are every reading.

    One binary frame asks for what has a binary form; text commands for the rest follow in the same write where the
    receive ring holds them while the robot still sends (every firmware but BTcom 1.1.3), else each in a write of its
    own.
    """
    profile = context.profile
    frame = bytearray()
    names: list[str] = []
    parts: list[Reply[object]] = []
    if profile.sends_packet:
        frame.append(opcode(PACKET))
        names.append("packet")
        parts.append(shapes.PACKET)
    for name in profile.chain:
        form = SPECS[name].binary_form(profile)
        assert form is not None
        assert form.code is not None
        frame.append(form.code)
        names.append(name)
        parts.append(unguarded(form.reply))
    requests = [_request("sensors", bytes(frame) + b"\0" + GUARD, names, parts)]
    for name in profile.tail:
        form = SPECS[name].text
        assert form is not None
        data, reply = form.prepare((), context)
        requests.append(_request(name, data, [name], [reply]))
    if sum(len(request.data) for request in requests) > profile.receive_ring:
        return requests
    replies = [request.reply for request in requests]
    data = b"".join(request.data for request in requests)
    return [Request("sensors()", "sensors", data, Several(tuple(replies), lambda found, context: _merge(found)))]


def _request(
    name: str, data: bytes, names: Sequence[str], parts: Sequence[Reply[object]]
) -> Request[dict[str, object]]:
    def build(found: Sequence[object], context: Context) -> dict[str, object]:
        return dict(zip(names, found, strict=True))

    whole = Several(tuple(parts), build)
    return Request("sensors()", name, data, guarded(whole) if whole.is_binary else whole)


def _merge(found: Sequence[object]) -> dict[str, object]:
    return {name: value for readings in found if isinstance(readings, dict) for name, value in readings.items()}


def combine(found: Mapping[str, object], context: Context) -> Sensors:
    """Return the readings as one value; what single answers say outweighs the packet."""
    readings = dict(found)
    packet = readings.pop("packet", None)
    base = packet if isinstance(packet, Sensors) else Sensors()
    return dataclasses.replace(base, **readings, **context.stamp)  # type: ignore[arg-type]  # each is its field's type
