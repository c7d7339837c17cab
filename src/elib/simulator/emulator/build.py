"""The hardware of each kind of robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from elib.link.protocol.image import Mounting
from elib.link.protocol.profiles import ASERCOM_1_2_2
from elib.link.protocol.profiles import EPUCK2 as EPUCK2_PROFILE

RECORDINGS = {1: 2112 / 7200, 2: 1760 / 7200, 3: 3412 / 7200, 4: 3732 / 7200, 5: 8016 / 7200}
"""Length of each of the e-puck1's recordings, s: samples at 7200 Hz (wire-protocol.md, 5.9)."""

MELODY = 10.0
"""Length of a melody of the e-puck2, s. It is a guess: no source gives it."""

MELODIES_AND_TONES = {1: MELODY, 2: MELODY, 3: MELODY, 4: math.inf, 5: math.inf}
"""Length of the e-puck2's sounds, s: three melodies, and two tones that go on until they are stopped
(wire-protocol.md, 5.9)."""


TONES = {4: 4000.0, 5: 10_000.0}
"""Frequencies of the e-puck2's two tones, Hz. Its melodies and the e-puck1's voices are heard as noise."""


@dataclass(frozen=True, slots=True)
class Build:
    """The hardware of one kind of robot."""

    hw13: bool  # whether it is hardware revision 1.3 of the e-puck1
    camera_chip: int  # number of the camera chip
    # how its camera sits. The PO3030 of the e-puck1 delivers pictures that need a quarter turn to the left as BTcom
    # drives it, both mirrors on; as asercom leaves it, without them, a quarter turn to the right.
    mounting: Mounting
    # signs of the digital accelerometer's x, y, z, and which of the robot's axes each is: 0 forward, 1 to the left, 2
    # up
    inertial_axes: tuple[tuple[int, int], tuple[int, int], tuple[int, int]] = ((1, 0), (1, 1), (1, 2))
    counts_per_degree: float = 1000 / 8.75  # scale of the gyroscope, counts per degree/s
    battery: tuple[int, int] = ASERCOM_1_2_2.battery_counts  # raw readings at 3.4 V and at 4.2 V, counts
    has_time_of_flight: bool = False  # whether it has the distance sensor
    slot: float = 1 / 256  # time between the samplings of two pairs of infrared sensors, s
    sounds: Mapping[int, float] = field(default_factory=lambda: RECORDINGS)  # how long each sound lasts, s
    tones: Mapping[int, float] = field(default_factory=dict)  # frequencies of the sounds that are tones, Hz
    generation: int = 1  # 1, or 2 for the e-puck2: whose pictures its camera takes
    # position of the rotary switch at first: where the firmware talks on the link that it is driven by
    selector: int = 3


EPUCK1 = Build(hw13=False, camera_chip=0x3030, mounting=Mounting.QUARTER_LEFT)
"""The classic one, with an analog accelerometer. Its infrared pairs take turns, 64 times a second each
(wire-protocol.md, 5.3)."""

EPUCK1_HW13 = Build(hw13=True, camera_chip=0x3030, mounting=Mounting.QUARTER_LEFT)
"""Revision 1.3. Its gyroscope gives 8.75 mdeg/s a count (wire-protocol.md, 5.5)."""

EPUCK2 = Build(
    hw13=False,
    camera_chip=0x8030,
    mounting=Mounting.UPRIGHT,
    # The chip sits upside down, turned so that the firmware gets the e-puck1's axes by (-x, y, -z).
    inertial_axes=((-1, 1), (1, 0), (-1, 2)),
    counts_per_degree=131.0,
    battery=EPUCK2_PROFILE.battery_counts,
    has_time_of_flight=True,
    slot=0.0025,
    sounds=MELODIES_AND_TONES,
    tones=TONES,
    generation=EPUCK2_PROFILE.generation,
)
"""Its four infrared pairs are read 100 times a second (wire-protocol.md, 5.3)."""
