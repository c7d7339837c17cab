"""The I2C bus as ``W``, ``Y`` and ``Z`` see it: ground module and camera; nothing keeps what is written."""

from __future__ import annotations

from collections.abc import Sequence

from elib.emulator.hardware import Hardware

GROUND_MODULE = 0xC0
"""Write address (protocol.md, 5.12)."""

CAMERA = 0xDC
"""Write address of all three camera chips (tests/golden, group "W Y Z i2c")."""

ADDRESSES = range(2, 255, 2)
"""What ``Z`` tries (protocol.md, 2.6)."""

RGB_PANEL_BYTES = 35
"""Parameters of the RGB-panel command (protocol.md, 3.1)."""

GROUND_REGISTERS = 21  # protocol.md, 5.12


def register(hardware: Hardware, chip: int, device: int, number: int) -> int | None:
    """Read a register.

    Args:
        hardware: What the ground module measures.
        chip: Camera on the bus; 0 for none.
        device: Write address, 0..255.
        number: Register, 0..255.

    Returns:
        The byte, or None where nothing answers.
    """
    if device == GROUND_MODULE and hardware.floor_present and number < GROUND_REGISTERS:
        return _ground_registers(hardware)[number]
    if device == CAMERA and chip and number < 2:
        return chip.to_bytes(2, "big")[number]
    return None


def _ground_registers(hardware: Hardware) -> bytes:
    """Lay the values out as the module does: high byte first, the revision between ground and cliff."""
    values, ambient = hardware.ground(), hardware.ground_ambient()
    ground, cliff = _big_endian(values[:3]), _big_endian(values[3:5])
    return ground + _big_endian(ambient[:3]) + b"\0" + cliff + _big_endian(ambient[3:5])


def _big_endian(values: Sequence[int]) -> bytes:
    return b"".join((value & 0xFFFF).to_bytes(2, "big") for value in values)
