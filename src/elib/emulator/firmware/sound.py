"""The e-puck1's sounds: slices of one recording, and an amplifier with a memory of its own (protocol.md, 5.9)."""

from __future__ import annotations

from dataclasses import dataclass

SLICES = {1: (0, 2112), 2: (2116, 1760), 3: (3878, 3412), 4: (7294, 3732), 5: (11_028, 8016)}
"""First sample and length of each sound, samples at 7200 Hz (protocol.md, 5.9)."""


@dataclass(slots=True)
class Amplifier:
    """Amplifier and codec.

    Attributes:
        is_on: Whether sound can be heard.
        is_initialised: Whether the firmware believes it is on; a camera set-up switches it off unnoticed.
        inits: How often it was initialised.
        plays: How many sounds were started.
        closes: How often it was switched off.
        start: First sample of the last sound, -1 before any.
        length: Samples of the last sound, -1 before any.
    """

    is_on: bool = False
    is_initialised: bool = False
    inits: int = 0
    plays: int = 0
    closes: int = 0
    start: int = -1
    length: int = -1

    def play(self, number: int) -> int:
        """Carry out ``T`` with *number*.

        Returns:
            The sound now heard, 1..5, or 0 for silence.
        """
        if not self.is_initialised:
            self.inits += 1
            self.is_initialised = self.is_on = True
        if number not in SLICES:
            self.closes += 1
            self.is_initialised = self.is_on = False
            return 0
        self.plays += 1
        self.start, self.length = SLICES[number]
        return number if self.is_on else 0

    def cut_off(self) -> None:
        """Switch off behind the firmware's back."""
        self.is_on = False

    def report(self) -> dict[str, int]:
        """Return the state in the form of ``hw["sound"]`` in the golden files."""
        return {
            "on": int(self.is_on),
            "inits": self.inits,
            "plays": self.plays,
            "closes": self.closes,
            "start": self.start,
            "len": self.length,
        }
