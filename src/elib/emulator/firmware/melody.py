"""The e-puck2's sounds: three melodies and two tones (protocol.md, 5.9)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

MELODIES = {1: 3, 2: 2, 3: 4}
"""Sound number to the firmware's melody number; only 1 was recorded, the others are guesses nothing relies on."""

TONES = {4: 4_000, 5: 10_000}
"""Sound number to frequency, Hz (protocol.md, 5.9)."""

STOP_BIT = 0x20
"""In the sound byte of the actuator packet (protocol.md, 3.5)."""


@dataclass(slots=True)
class Player:
    """Melody player and tone generator.

    Attributes:
        melody: The firmware's number of the last melody, -1 before any.
        melody_plays: How many melodies were started.
        melody_stops: How often the player was stopped.
        tone: The last tone, Hz, -1 before any.
        tone_plays: How many tones were started.
        tone_stops: How often the generator was stopped.
    """

    melody: int = -1
    melody_plays: int = 0
    melody_stops: int = 0
    tone: int = -1
    tone_plays: int = 0
    tone_stops: int = 0

    def play(self, number: int) -> int:
        """Carry out ``T`` with *number*; return the sound now heard, 1..5, or 0 for silence."""
        if number in MELODIES:
            self.melody = MELODIES[number]
            self.melody_plays += 1
        elif number in TONES:
            self.tone = TONES[number]
            self.tone_plays += 1
        else:
            self.melody_stops += 1
            self.tone_stops += 1
            return 0
        return number

    def numbers(self, bits: int) -> Iterator[int]:
        """Return the sounds that the sound byte of the actuator packet asks for, in the firmware's order."""
        for number in range(1, 6):
            if bits >> (number - 1) & 1:
                yield number
        if bits & STOP_BIT:
            yield 0

    def report(self) -> dict[str, int]:
        """Return the state in the form of ``hw["sound"]`` in the golden files."""
        return {
            "melody": self.melody,
            "melody_plays": self.melody_plays,
            "melody_stops": self.melody_stops,
            "dac_freq": self.tone,
            "dac_plays": self.tone_plays,
            "dac_stops": self.tone_stops,
        }
