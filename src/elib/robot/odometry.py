"""Where a robot is by its step counters: every reading of them that passes by counts, whoever asked for it."""

from __future__ import annotations

from elib.body import wrapped
from elib.pose import Pose, advanced
from elib.protocol.values import Sensors, Steps
from elib.session import Called, Ended, Greeted, TraceEvent

FASTEST = 1200
"""Steps/s that no wheel exceeds (robot-model.md, 2.1): counters that change faster were set back."""
SLACK = 100
"""Steps that the counters may differ from the model without being suspect."""
TOLERANCE = 60
"""Steps by which a counter may miss what its wheel was told: 60 ms of a late command at full speed."""


class Odometry:
    """Adds up what the wheels were stepped, and the path that makes on nominal wheels.

    Counters wrap at 16 bits and are set back by a reset; differences are taken modulo 65536, and counters that fell
    back to nothing faster than wheels can turn count from nothing. Steps are issued whether or not the robot can
    follow: odometry sees neither slip nor a wall that holds the robot up.

    Attributes:
        pose: Where the robot is, and when that was; it began at (0, 0), looking along x.
        left: Steps of the left wheel since it began, backwards negative.
        right: Steps of the right wheel.
        restarts: Times that the robot was seen to have restarted.
    """

    def __init__(self) -> None:
        self.pose = Pose(0.0, 0.0, 0.0)
        self.left = self.right = 0
        self.restarts = 0
        self._before: Steps | None = None
        self._pending: Steps | None = None
        self._commanded = (0, 0)
        self._slowest = self._fastest = (0, 0)

    def observe(self, time: float, event: TraceEvent) -> None:
        """Follow what happens on the link; a trace hook."""
        match event:
            case Greeted():
                self.restarts += 1
                self._set(0, 0, time)
            case Called(request=request) if request.name in ("set_speed", "stop"):
                left, right = request.numbers if request.name == "set_speed" else (0, 0)
                self._command(int(left), int(right))
            case Ended(error=None, request=request) if request.name == "reset":
                self._set(0, 0, time)
            case Called(request=request) if request.name == "set_encoders" and self._before is not None:
                # Whether it is done is not known before its answer, and never if that is lost.
                left, right = request.numbers
                self._pending = Steps(int(left), int(right), time=self._before.time)
            case Ended(error=None, request=request) if request.name == "set_encoders":
                left, right = request.numbers
                self._set(int(left), int(right), time)
            case Ended(value=value) if (steps := steps_in(value)) is not None:
                self.count(steps)
            case _:
                pass

    def count(self, steps: Steps) -> None:
        """Take a reading of the counters into account."""
        before, self._before = self._before, steps
        pending, self._pending = self._pending, None
        if before is None:
            left = right = 0
        elif not self._is_strange(before, steps):
            left, right = wrapped(steps.left - before.left), wrapped(steps.right - before.right)
        elif pending is not None and not self._is_strange(pending, steps):
            left, right = wrapped(steps.left - pending.left), wrapped(steps.right - pending.right)
        elif fell_back(before, steps) or all(abs(wrapped(count)) <= TOLERANCE for count in steps):
            self.restarts += 1
            left, right = steps.left, steps.right
        else:  # somebody else drives
            left, right = wrapped(steps.left - before.left), wrapped(steps.right - before.right)
        self.left += left
        self.right += right
        self.pose = advanced(self.pose, left, right, steps.time)
        self._slowest = self._fastest = self._commanded

    def _is_strange(self, before: Steps, now: Steps) -> bool:
        """Whether wheels cannot have turned from one reading to the other as they were told."""
        seconds = now.time - before.time
        return any(
            not least * seconds - TOLERANCE <= wrapped(new - old) <= most * seconds + TOLERANCE
            for new, old, least, most in zip(now, before, self._slowest, self._fastest, strict=True)
        )

    def _command(self, left: int, right: int) -> None:
        """Note what the wheels are told; until the next reading they may have any speed between all of these."""
        self._commanded = left, right
        self._slowest = min(self._slowest[0], left, 0), min(self._slowest[1], right, 0)
        self._fastest = max(self._fastest[0], left, 0), max(self._fastest[1], right, 0)

    def _set(self, left: int, right: int, time: float) -> None:
        self._before, self._pending = Steps(left, right, time=time), None


def steps_in(value: object) -> Steps | None:
    """Return the step counters that an answer holds: alone, or among all readings."""
    if isinstance(value, dict):
        return steps_in(value.get("encoders")) or steps_in(value.get("packet"))
    if isinstance(value, Sensors):
        return value.encoders
    return value if isinstance(value, Steps) else None


def fell_back(before: Steps, now: Steps) -> bool:
    """Whether the counters fell back to nothing faster than wheels can turn: the robot restarted meanwhile."""
    reach = FASTEST * max(0.0, now.time - before.time) + SLACK
    is_jump = any(abs(wrapped(new - old)) > reach for new, old in zip(now, before, strict=True))
    return is_jump and all(abs(wrapped(new)) <= reach for new in now)


def fell_back_over_gap(before: Steps, now: Steps) -> bool:
    """Whether the counters stand near nothing although they stood elsewhere: it was switched off in a gap, we guess."""
    return all(abs(count) <= SLACK for count in now) and any(abs(count) > 2 * SLACK for count in before)
