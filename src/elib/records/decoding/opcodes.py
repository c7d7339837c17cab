"""The binary commands of each firmware, read off the command table and the profiles, and the calls they are."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

from elib.link.protocol import shapes
from elib.link.protocol.actuators import AVOID, BODY, FRONT
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Form, Profile, Reply
from elib.link.protocol.forms import binary_form, opcode
from elib.link.protocol.replies import NOTHING, Packed
from elib.link.protocol.table import Parameter
from elib.records.decoding.lines import Argument, Call


@dataclass(frozen=True, slots=True)
class BinaryCommand:
    """One opcode of one firmware."""

    name: str  # the row of the table, or a name for what the table does not have
    form: Form[object]  # its form on the wire

    @property
    def length(self) -> int:
        """Bytes of its parameters."""
        return struct.calcsize("<" + self.form.layout)

    @property
    def reply(self) -> Reply[object] | None:
        """The shape of what it adds to the answer of the session; None if it adds nothing."""
        reply = SLOT if self.at_once is not None else self.form.reply
        return None if reply is NOTHING else reply

    @property
    def at_once(self) -> Reply[object] | None:
        """The shape of what is sent before the session ends: the microphones' samples; None for other commands."""
        return RINGS if self.name == "microphone_samples" else None

    def call(self, parameters: bytes, profile: Profile) -> Call:
        """Return the call that has these parameters."""
        numbers = struct.unpack("<" + self.form.layout, parameters)
        match self.name:
            case "set_led" if profile.numbers_body_lamps and numbers[0] in (BODY, FRONT):
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
    """Return numbers of the wire as arguments, in their units."""
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
    """Return the fields of the e-puck2's packet of all actuators (wire-protocol.md, 3.5)."""
    flags, left, right, lamps, *rest = numbers
    if flags & 4:
        wheels = [Argument("left", left, "steps"), Argument("right", right, "steps")]
    else:
        wheels = list(named(SPECS["set_speed"].parameters, (left, right)))
    doing = [Argument(name, "ON") for name, bit in (("calibrate", 1), ("set_obstacle_avoidance", AVOID)) if flags & bit]
    return (*doing, *wheels, Argument("lamps", f"{lamps:06b}"), *_rgb(rest[:12]), Argument("sound", rest[12]))


RINGS = Packed(shapes.RINGS, shapes.samples)
"""The samples of the microphones, sent before the answer of the session (wire-protocol.md, 3.3)."""
SLOT = Packed("<B", lambda numbers, context: int(numbers[0]))
"""What the answer of the session then holds: which slot of each ring is the oldest."""


def binary_commands(profile: Profile) -> dict[int, BinaryCommand]:
    """Return the binary commands of a firmware by opcode."""
    found: dict[int, BinaryCommand] = {}
    for spec in SPECS.values():
        if spec.name in profile.absent:
            continue
        own = None if spec.name in profile.text_only else spec.binary
        for form in (own, profile.binary_forms.get(spec.name), profile.forms.get(spec.name)):
            if form is not None and form.code is not None:
                found[form.code] = BinaryCommand(spec.name, form)
    if profile.sends_packet:
        found[opcode(shapes.PACKET_CODE)] = BinaryCommand("sensors", binary_form(shapes.PACKET_CODE, shapes.PACKET))
    for name, form in profile.unsent.items():
        assert form.code is not None
        found[form.code] = BinaryCommand(name, form)
    return found
