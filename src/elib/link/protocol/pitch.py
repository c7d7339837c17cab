"""The pitch of a sound, from the samples of an e-puck1's microphones.

The robot goes on sampling into its rings while it sends them, nine times slower than it samples. So each ring arrives
in pieces from different moments. Which sample is in which slot follows from the slot that was to be written next and
the speed of the robot's UART. A sine wave of each frequency is fitted to the samples at those times: a least-squares
spectrum, which needs no even spacing as an FFT does, and over 50 ms tells frequencies apart that 6 ms could not.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from elib.base.body import MICROPHONE_RATE
from elib.link.protocol import values as v
from elib.link.protocol.context import Context

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

WORD_TIME: Final = 20 / 115200
"""s in which the robot's UART sends a sample of two bytes (wire-protocol.md, 1.1), however fast the link is said to
be."""

LOWEST, HIGHEST, STEP = 150.0, 8000.0, 8.0
"""Hz. The spectrum: from one wave in a ring to just below half the rate, in a third of the width of a peak."""

ERROR: Final = 6.0
"""Hz to which a clear tone is right: more than 99 % of 6,000 tones drawn from 150 to 7900 Hz were, at the times of the
simulator, from the noise of a quiet room upwards. Loud ones were right to 2 Hz."""

CLEAR: Final = 0.4
"""Least part of what is heard that a clear tone makes. White noise gives 0.06 to 0.09, a tone as loud as the noise of a
quiet room 0.5."""


def sent_samples(following: float, microphones: int, samples: int) -> NDArray[np.int64]:
    """Return the numbers of the samples that are sent: one row a microphone, slot by slot.

    Each slot is sent with the sample that it holds at that time, while the rings are filled on.

    Args:
        following: The number of the sample that is to be taken next when the sending begins. Sample 0 is in slot 0.
        microphones: How many there are.
        samples: How many of each are sent.
    """
    import numpy as np

    slots = np.arange(microphones * samples)
    taken = np.floor(following + slots * WORD_TIME * MICROPHONE_RATE).astype(np.int64)
    return np.reshape(taken - 1 - (taken - 1 - slots) % samples, (microphones, samples))


def found_pitch(rings: NDArray[np.int16], oldest: int, context: Context) -> v.Pitch:
    """Return the pitch that the rings of the microphones hold.

    Args:
        rings: Their samples, one row a microphone, slot by slot.
        oldest: The slot that was to be written next when the sending began.
        context: What the connection knows of the robot.
    """
    import numpy as np

    waves = rings - rings.mean(axis=1, keepdims=True)
    heard = float(np.sum(waves**2))
    frequencies = np.arange(LOWEST, HIGHEST, STEP)
    power = np.zeros(len(frequencies))
    for numbers, wave in zip(sent_samples(oldest, *rings.shape), waves, strict=True):
        angles = 2 * math.pi * np.outer(frequencies, numbers / MICROPHONE_RATE)
        basis = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        basis -= basis.mean(axis=2, keepdims=True)  # A low tone's samples do not add up to 0.
        found = basis @ wave
        fit = np.linalg.solve(basis @ basis.transpose(0, 2, 1), found[..., np.newaxis])[..., 0]
        power += np.sum(found * fit, axis=1)
    best = int(np.argmax(power))
    share = min(1.0, float(power[best]) / heard) if heard else 0.0
    if share < CLEAR:
        return v.Pitch(0.0, 0.0, share, **context.stamp)
    offset = 0.0
    if 0 < best < len(power) - 1:  # The top of the parabola through the three highest points.
        before, top, after = power[best - 1 : best + 2]
        offset = 0.5 * (before - after) / (before - 2 * top + after)
    frequency = float(frequencies[best] + STEP * offset)
    return v.Pitch(frequency, ERROR, share, **context.stamp)
