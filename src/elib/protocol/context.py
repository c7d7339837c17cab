"""What decoding and encoding need to know besides the bytes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypedDict

if TYPE_CHECKING:
    from elib.protocol.profiles import Profile
    from elib.protocol.values import CameraSettings


@dataclass(slots=True)
class LastSet:
    """What this program last set and the robot confirmed. The firmware offers no way to read it back.

    Attributes:
        speed: Wheel speeds on the wire, steps/s.
        lamps: Ring LEDs 0..7, body (8), front (9): 0 or 1.
        rgb: Red, green, blue of LED2, LED4, LED6, LED8, 0..100; e-puck2 only.
        avoidance: The firmware's obstacle avoidance is on; e-puck2 only.
        camera: Settings of the camera, or None where neither set nor read yet.
    """

    speed: tuple[int, int] = (0, 0)
    lamps: list[int] = field(default_factory=lambda: [0] * 10)
    rgb: list[int] = field(default_factory=lambda: [0] * 12)
    avoidance: bool = False
    camera: CameraSettings | None = None


class Stamp(TypedDict):
    """When and where a value came from."""

    time: float
    origin: str


@dataclass(slots=True)
class Context:
    """One connection's knowledge.

    Attributes:
        profile: The firmware spoken to.
        origin: Where values come from: ``robot``, ``simulator`` or ``replay``.
        time: When the newest bytes came, s on the caller's clock.
        last_set: What this program last set.
        requests: Requests of rows without arguments, made once; see :meth:`elib.protocol.table.Spec.request`.
    """

    profile: Profile
    origin: str = "robot"
    time: float = math.nan
    last_set: LastSet = field(default_factory=LastSet)
    requests: dict[str, object] = field(default_factory=dict, repr=False)

    def forget(self) -> None:
        """Forget what was set: the robot has started anew."""
        self.last_set = LastSet()

    @property
    def stamp(self) -> Stamp:
        """Time and origin of a value decoded now."""
        return {"time": self.time, "origin": self.origin}
