"""What a recorded drive tells about a robot's link: by how much its round trips are longer than the simulator's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elib.calibration.fitting import spread
from elib.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class LinkFit:
    """What was found about the link.

    Attributes:
        latency: Each way, s.
        jitter: Standard deviation of that, s.
        error: Standard error of the latency, s.
        calls: That were compared.
    """

    latency: float
    jitter: float
    error: float
    calls: int


def fit_link(recorded: Sequence[float], simulated: Sequence[float], before: LinkFit | None = None) -> LinkFit:
    """Find the latency with which the simulator's round trips become the recorded ones.

    Args:
        recorded: Round trips of the recording, s.
        simulated: Of the same calls in the simulator, s.
        before: What the simulator's link was set to for these; None for no delay at all.

    Raises:
        ArgumentError: There is nothing to compare.
    """
    if not len(recorded):
        raise ArgumentError(
            "no call of the recording was answered both there and in the simulator, so the link cannot be fitted",
            hint="record a drive that reads sensors: elib run calibration-drive --record FILE",
        )
    was = LinkFit(0.0, 0.0, 0.0, 0) if before is None else before
    there, here = np.asarray(recorded, dtype=float), np.asarray(simulated, dtype=float)
    # Two ways make a round trip. Medians: a lost answer's neighbour or a late one says nothing about the usual.
    latency = was.latency + (float(np.median(there)) - float(np.median(here))) / 2
    more = spread(there) ** 2 - spread(here) ** 2
    jitter = math.sqrt(max(was.jitter**2 + more / 2, 0.0))
    error = 1.2533 * spread(there) / 2 / math.sqrt(len(there))
    return LinkFit(max(latency, 0.0), jitter, error, len(there))
