"""The binary commands of each firmware as a listener needs them: those of the table, and those elib never sends."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from elib.decoding.lines import Argument, Call
from elib.protocol import shapes, values
from elib.protocol.actuators import ACTUATORS, AVOID, BODY, FRONT
from elib.protocol.commands import SPECS
from elib.protocol.context import Context, Form, Profile, Reply
from elib.protocol.everything import PACKET
from elib.protocol.forms import opcode
from elib.protocol.replies import Guarded, Nothing, Packed
from elib.protocol.table import Parameter

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class BinaryCommand:
    """One opcode of one firmware.

    Attributes:
        name: The row of the table, or what there is instead.
        parameters: Format of its parameters, as ``struct`` takes it.
        reply: Shape of what it adds to the answer; None where it adds nothing.
        at_once: Shape of what is sent before the session ends; None but for the microphones' samples.
    """

    name: str
    parameters: str = ""
    reply: Reply[object] | None = None
    at_once: Reply[object] | None = None

    @property
    def length(self) -> int:
        """Bytes of its parameters."""
        return struct.calcsize("<" + self.parameters)

    def call(self, parameters: bytes, profile: Profile) -> Call:
        """Return the call that these parameters are."""
        numbers = struct.unpack("<" + self.parameters, parameters)
        match self.name:
            case "set_led" if profile.name != "btcom-1.1.3" and numbers[0] in (BODY, FRONT):
                # Lamps 8 and 9 are the body and the front everywhere but on BTcom 1.1.3 (protocol.md, 3.1).
                name = "set_body_led" if numbers[0] == BODY else "set_front_led"
                return Call(name, named(SPECS[name].parameters, numbers[1:]))
            case "set_rgb_led":
                return Call(self.name, _rgb(numbers))
            case "set_actuators":
                return Call(self.name, _actuators(numbers))
            case "rgb_panel":
                return Call(self.name)
        spec = SPECS.get(self.name)
        return Call(self.name, named(spec.parameters, numbers) if spec is not None else ())


def named(parameters: Sequence[Parameter], numbers: Sequence[int]) -> tuple[Argument, ...]:
    """Return numbers of the wire as the arguments they stand for, in their units."""
    return tuple(_argument(parameter, number) for parameter, number in zip(parameters, numbers, strict=False))


def _argument(parameter: Parameter, number: int) -> Argument:
    quantity = parameter.quantity
    if quantity.names is not None:
        names = {int(member): member.name for member in quantity.names}
        return Argument(parameter.name, names.get(number, number))
    return Argument(parameter.name, number / quantity.scale if quantity.scale else number, quantity.unit)


def _rgb(percents: Sequence[int]) -> tuple[Argument, ...]:
    return tuple(
        Argument(f"led{led}", "/".join(f"{percent}" for percent in percents[at : at + 3]), "%")
        for led, at in ((1, 0), (3, 3), (5, 6), (7, 9))
    )


def _actuators(numbers: Sequence[int]) -> tuple[Argument, ...]:
    """Return the fields of the e-puck2's packet of all actuators (protocol.md, 3.5)."""
    flags, left, right, lamps, *rest = numbers
    if flags & 4:
        wheels = [Argument("left", left, "steps"), Argument("right", right, "steps")]
    else:
        wheels = list(named(SPECS["set_speed"].parameters, (left, right)))
    doing = [Argument(name, "ON") for name, bit in (("calibrate", 1), ("set_obstacle_avoidance", AVOID)) if flags & bit]
    return (*doing, *wheels, Argument("lamps", f"{lamps:06b}"), *_rgb(rest[:12]), Argument("sound", rest[12]))


def _samples(numbers: Sequence[int | float], context: Context) -> NDArray[numpy.int16]:
    import numpy as np

    return np.array(numbers, np.uint16).astype(np.int16).reshape(shapes.MICROPHONES, shapes.SAMPLES)


RINGS = Packed(f"<{shapes.MICROPHONES * shapes.SAMPLES}H", _samples)
"""The microphones' samples as they are sent, ahead of the session's own answer (protocol.md, 3.3)."""
SLOT = Packed("<B", lambda numbers, context: int(numbers[0]))
"""And what the answer then holds: which slot of each ring is the oldest."""

PARAMETERS: Mapping[str, str] = {
    "set_speed": "2h",
    "set_encoders": "2h",
    "set_led": "2B",
    "i2c_write": "3B",
    "i2c_read": "2B",
    "rgb_panel": "35B",
    "set_actuators": "B2hB12BB",
    "set_rgb_led": "12B",
    "start_magnetometer": "B",
    "set_proximity_rate": "B",
    "set_distance_sensor": "B",
}
"""Parameters of each binary command that has any (protocol.md, 3.1)."""

_GCTRONIC: Mapping[int, BinaryCommand] = {
    opcode("P"): BinaryCommand("set_encoders", PARAMETERS["set_encoders"]),
    opcode("W"): BinaryCommand("i2c_write", PARAMETERS["i2c_write"]),
    opcode("w"): BinaryCommand("rgb_panel", PARAMETERS["rgb_panel"]),
}
_NOT_SENT: Mapping[str, Mapping[int, BinaryCommand]] = {
    "btcom-1.1.3": {},
    "btcom-2.0": {opcode("W"): BinaryCommand("turret")},
    "asercom-1.2.2": _GCTRONIC,
    "epuck2": {
        **_GCTRONIC,
        opcode("Y"): BinaryCommand(
            "i2c_read", PARAMETERS["i2c_read"], Packed("<B", lambda numbers, context: int(numbers[0]))
        ),
        opcode("M"): BinaryCommand("ground", reply=shapes.packed_counts("<4h", values.Ground)),
        opcode(ACTUATORS): BinaryCommand("set_actuators", PARAMETERS["set_actuators"]),
    },
}
"""What other programs send and elib does not, having a text form (protocol.md, 3.1)."""
_MISSING: Mapping[str, tuple[int, ...]] = {"btcom-1.1.3": (opcode("a"), opcode("E"), opcode("u"))}
"""Readings that a firmware has as text only."""


def binary_commands(profile: Profile) -> dict[int, BinaryCommand]:
    """Return the binary commands of a firmware by opcode."""
    found: dict[int, BinaryCommand] = {
        opcode(spec.letter): BinaryCommand(spec.name, PARAMETERS[spec.name])
        for spec in (SPECS["set_speed"], SPECS["set_led"])
    }
    for spec in SPECS.values():
        if spec.name in profile.absent:
            continue
        for form in (spec.binary, profile.binary_forms.get(spec.name), profile.forms.get(spec.name)):
            if form is not None and form.code is not None:
                found[form.code] = _listed(spec.name, form)
    if profile.sends_packet:
        found[opcode(PACKET)] = BinaryCommand("sensors", reply=shapes.PACKET)
    for code in _MISSING.get(profile.name, ()):
        del found[code]
    return {**found, **_NOT_SENT[profile.name]}


def _listed(name: str, form: Form[object]) -> BinaryCommand:
    if name == "microphone_samples":
        return BinaryCommand(name, "", SLOT, RINGS)
    reply = form.reply.reply if isinstance(form.reply, Guarded) else form.reply
    return BinaryCommand(name, PARAMETERS.get(name, ""), None if isinstance(reply, Nothing) else reply)
