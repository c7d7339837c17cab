"""The e-puck2's threads beside its command loop: obstacle avoidance and the remote control."""

from __future__ import annotations

from collections.abc import Sequence

THREAD_PERIOD = 0.02
"""Period of the avoidance thread, s (wire-protocol.md, 5.1)."""

NOISE = 5
"""Proximity, counts, below which a sensor has no effect (e-puck2_main-processor: src/behaviors.c)."""

FORWARD = (-1.0, -0.5, 0.0, 0.75, 0.75, 0.0, -0.5, -1.0)
SIDEWAYS = (0.5, 0.5, 1.0, 0.5, -0.5, -1.0, -0.5, -0.5)
"""How much each proximity sensor pushes the robot forward and to the left: a simplified field of forces
(e-puck2_main-processor: src/behaviors.c)."""

REMOTE_SPEED = 600
REMOTE_TURNS = {
    **dict.fromkeys((5, 12), (0, 0)),
    **dict.fromkeys((2, 32), (1, 1)),
    **dict.fromkeys((8, 33), (-1, -1)),
    **dict.fromkeys((6, 16), (1, -1)),
    **dict.fromkeys((4, 17), (-1, 1)),
    3: (1, 0),
    1: (0, 1),
    9: (-1, 0),
    7: (0, -1),
}
"""Directions of the wheels for each key of the remote control (wire-protocol.md, 5.10)."""


class Threads:
    """State of both threads.

    Attributes:
        avoids: Whether obstacle avoidance is on.
        target: The speeds asked for while it is on, steps/s.
        due: When it runs next, s.
    """

    def __init__(self) -> None:
        self.avoids = False
        self.target = (0, 0)
        self.due = 0.0
        self._last_code: tuple[int, int, int] | None = None

    def avoidance(self, near: Sequence[int]) -> tuple[int, int]:
        """Return speeds that lead around near obstacles, steps/s.

        Args:
            near: Eight calibrated proximity values, counts.
        """
        seen = [value if value >= NOISE else 0 for value in near]
        forward = int(sum(weight * value for weight, value in zip(FORWARD, seen, strict=True))) >> 1
        sideways = int(sum(weight * value for weight, value in zip(SIDEWAYS, seen, strict=True))) << 2
        left, right = self.target
        left += (forward if left >= 0 else -forward) - sideways
        right += (forward if right >= 0 else -forward) + sideways
        return left, right

    def heard(self, code: tuple[int, int, int]) -> bool:
        """Keep the remote control's last code; return whether it is new and moves the robot.

        Args:
            code: Check bit, address, key; a new press changes the check bit, so a repeated key acts again.
        """
        is_new = self._last_code is not None and code != self._last_code
        self._last_code = code
        return is_new and code[2] in REMOTE_TURNS

    def remote_speeds(self) -> tuple[int, int]:
        """Return the speeds that the last code asks for, steps/s."""
        left, right = REMOTE_TURNS[self._last_code[2]] if self._last_code else (0, 0)
        return left * REMOTE_SPEED, right * REMOTE_SPEED
