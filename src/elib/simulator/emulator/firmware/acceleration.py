"""How the firmwares compute with the accelerometer: scales, zeros, spherical values (wire-protocol.md, 5.4)."""

from __future__ import annotations

import math
import struct

GRAVITY_ANALOG = 768
"""1 g as the firmwares assume it, counts of the 12-bit ADC (wire-protocol.md, 5.4)."""

GRAVITY_INERTIAL = 16_384
"""1 g of the digital chips at +-2 g, counts (wire-protocol.md, 5.4)."""

LEVEL = 2_048
"""0 g of the analog accelerometer, counts (wire-protocol.md, 5.4)."""

DEGREES_PER_RADIAN = 180.0 / 3.1415
"""The firmwares' pi (wire-protocol.md, 5.4)."""


def single(value: float) -> float:
    """Round to a 32-bit float, with which the dsPIC computes."""
    rounded: float = struct.unpack("<f", struct.pack("<f", value))[0]
    return rounded


def scaled(counts: int) -> int:
    """Convert counts of a digital chip to the analog scale: a sixteenth minus a quarter of that, rounded down."""
    return (counts >> 4) - (counts >> 6)


def with_signed_low_byte(counts: int) -> int:
    """Return what the e-puck1's driver reads from a register pair, whose low byte it takes as signed."""
    return counts - 256 if counts & 0x80 else counts


def attitude_single(x: int, y: int, z: int) -> bytes:
    """Return magnitude, orientation and inclination as the dsPIC packs them, all arithmetic in single precision."""
    degrees = single(DEGREES_PER_RADIAN)
    magnitude = single(math.sqrt(single(x * x + y * y + z * z)))
    level = single(math.sqrt(single(x * x + y * y)))
    inclination = single(90.0 - single(single(math.atan2(z, level)) * degrees))
    orientation = 0.0
    if 5 <= inclination <= 160:
        orientation = single(single(single(math.atan2(x, y)) * degrees) + 180.0)
    return struct.pack("<3f", magnitude, orientation, inclination)


def attitude_double(x: int, y: int, z: int) -> bytes:
    """Return the same as the e-puck2 packs it, with products in double precision."""
    magnitude = math.sqrt(single(x * x + y * y + z * z))
    level = single(math.sqrt(single(x * x + y * y)))
    inclination = single(90.0 - single(math.atan2(z, level)) * DEGREES_PER_RADIAN)
    orientation = 0.0
    if 5 <= inclination <= 160:
        orientation = single(math.atan2(x, y)) * DEGREES_PER_RADIAN + 180.0
    return struct.pack("<3f", magnitude, orientation, inclination)
