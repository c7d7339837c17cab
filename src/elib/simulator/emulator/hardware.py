"""The interface between a firmware and the robot's hardware: counts, steps and switches.

A firmware (``firmware``) reads and sets these. ``fixed_hardware`` answers with
constants, ``simulated_hardware`` connects them with the world of ``physics``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from elib.link.protocol.camera import CameraWindow


@dataclass(slots=True)
class Lights:
    """Every lamp of the robot, as the firmware last set it."""

    # eight ring LEDs, 0 or 1; 0 is front centre, then clockwise seen from above
    ring: list[int] = field(default_factory=lambda: [0] * 8)
    # red, green, blue of LED2, LED4, LED6, LED8 (ring 1, 3, 5, 7), 0..100 each; e-puck2 only
    rgb: list[int] = field(default_factory=lambda: [0] * 12)
    body: int = 0  # body LED, 0 or 1
    front: int = 0  # front LED, 0 or 1


class Hardware(Protocol):
    """A robot without its firmware. All readings are raw counts, as the firmware's drivers see them, not SI units."""

    @property
    def hw13(self) -> bool:
        """Hardware revision 1.3 of the e-puck1 (digital accelerometer with gyroscope)."""

    @property
    def eeprom(self) -> int:
        """Identity word, 16 bit."""

    @property
    def camera_chip(self) -> int:
        """Chip number: 0x3030, 0x6030, 0x8030; 0 means no camera answers."""

    @property
    def floor_present(self) -> bool:
        """Whether the ground module is plugged in."""

    def advance(self, time: float) -> None:
        """Let the world run up to *time*, s since the origin of the emulator's caller; time never goes back."""

    def step(self, left: float, right: float) -> None:
        """Record by how many steps each wheel was moved since the last call; a wheel moves by whole steps."""

    def drive(self, left: float, right: float) -> None:
        """Turn the wheels at these step rates from the time of the last :meth:`advance` on, steps/s."""

    def show(self, lights: Lights) -> None:
        """Set all lamps."""

    def play_sound(self, number: int) -> None:
        """Start sound 1..5; 0 is silence."""

    def selector(self) -> int:
        """Return the position of the rotary switch, 0..15."""

    def infrared(self) -> tuple[int, int, int]:
        """Return the last code of the remote control: check, address, data."""

    def reflected_light(self) -> Sequence[int]:
        """Return ambient minus lit reading of each infrared sensor: 8 to 10 counts, higher is nearer."""

    def ambient_light(self) -> Sequence[int]:
        """Return the reading of each infrared sensor with its emitter off: 8 to 10 counts, higher is darker."""

    def acceleration(self) -> Sequence[int]:
        """Return the analog accelerometer's x, y, z: 12-bit counts around 2048 (e-puck1 below revision 1.3)."""

    def inertial_acceleration(self) -> Sequence[int]:
        """Return the digital accelerometer's x, y, z: 16384 counts per g (revision 1.3, e-puck2)."""

    def rotation(self) -> Sequence[int]:
        """Return the gyroscope's x, y, z: 16-bit counts, full scale 250 deg/s."""

    def inertial_zeros(self) -> tuple[Sequence[int], Sequence[int]]:
        """Return what the digital accelerometer and the gyroscope read on average while a firmware calibrates them."""

    def magnetic_field(self) -> Sequence[float]:
        """Return the magnetometer's x, y, z, microtesla."""

    def temperature(self) -> int:
        """Return the temperature of the inertial chip, degrees C."""

    def ground(self) -> Sequence[int]:
        """Return three ground and two cliff sensors, counts."""

    def ground_ambient(self) -> Sequence[int]:
        """Return the same five with their emitters off, counts."""

    def microphones(self) -> Sequence[tuple[int, int]]:
        """Return (base level, peak-to-peak volume) of each of four microphones, ADC counts."""

    def microphone_index(self) -> int:
        """Return the slot of the sample ring written next, 0..99."""

    def microphone_rings(self) -> Sequence[int]:
        """Return three microphones' rings of 100 samples as they are sent from now on, counts."""

    def battery(self) -> int:
        """Return the raw battery reading, ADC counts."""

    def battery_is_low(self) -> bool:
        """Return the state of the battery comparator of the older e-puck1: below 3.4 V."""

    def distance(self) -> int:
        """Return the time-of-flight distance, mm."""

    def button_is_pressed(self) -> bool:
        """Return whether the user button of the e-puck2 is pressed."""

    def has_sd_card(self) -> bool:
        """Return whether a micro SD card was found."""

    def picture(self, window: CameraWindow) -> bytes:
        """Take a picture: rows of pixels as the chip delivers them; 1 byte a pixel when grey, else 2."""
