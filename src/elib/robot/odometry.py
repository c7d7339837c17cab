"""The pose of a robot by its step counters, from every reading of them on the link, whichever call asked for it."""

from __future__ import annotations

from elib.body import wrapped
from elib.pose import Pose, advanced
from elib.protocol.table import Request
from elib.protocol.values import Sensors, Steps
from elib.session import Called, Ended, Greeted, Pushed, TraceEvent

FASTEST = 1200
"""steps/s that no wheel exceeds (e-puck.md, 1): counters that change faster were reset."""
SLACK = 100
"""Steps by which the counters may differ from the model without a restart being suspected."""
TOLERANCE = 60
"""Steps by which a counter may differ from its wheel's commands: 60 ms of a late command at full speed."""

WHEELS = ("set_speed", "stop", "set_encoders", "reset")
"""Calls that change what the next reading of the counters may be."""


class Odometry:
    """Adds up the steps of the wheels, and the path that they make on nominal wheels.

    Counters wrap at 16 bits, and a reset sets them to 0. Differences are taken modulo 65536; counters that fell back to
    about 0 faster than wheels can turn are counted from 0. The motors step even if the robot cannot follow, so odometry
    notices neither slip nor a wall that stops the robot.

    Attributes:
        pose: Where the robot is, with the time of the reading; it begins at (0, 0), looking along x.
        left: Steps of the left wheel since the beginning, backwards negative.
        right: Steps of the right wheel since the beginning, backwards negative.
        restarts: How often the robot has restarted, as far as it was noticed.
    """

    def __init__(self) -> None:
        self.pose = Pose(0.0, 0.0, 0.0)
        self.left = self.right = 0
        self.restarts = 0
        self._before: Steps | None = None
        self._pending: Steps | None = None
        self._commanded = (0, 0)
        self._slowest = self._fastest = (0, 0)
        self._under_way = 0
        """Calls of WHEELS that have not ended."""
        self._was_set = False
        """Whether the counters were just set: the next packet of a stream may have been read before that."""

    def observe(self, time: float, event: TraceEvent) -> None:
        """Take an event of the link into account; a trace hook."""
        if isinstance(event, Called | Ended) and event.request.name in WHEELS:
            self._under_way = max(0, self._under_way + (1 if isinstance(event, Called) else -1))
        match event:
            case Greeted():
                self.restarts += 1
                self._set(0, 0, time)
            case Called(request=Request(name="set_speed", numbers=(left, right))):
                self._command(int(left), int(right))
            case Called(request=Request(name="stop")):
                self._command(0, 0)
            case Ended(error=None, request=request) if request.name == "reset":
                self._set(0, 0, time)
            case Called(request=Request(name="set_encoders", numbers=(left, right))) if self._before is not None:
                # Whether it was done is unknown before its answer, and stays unknown if the answer is lost.
                self._pending = Steps(int(left), int(right), time=self._before.time)
            case Ended(error=None, request=Request(name="set_encoders", numbers=(left, right))):
                self._set(int(left), int(right), time)
            case Ended(value=value) if (steps := steps_in(value)) is not None:
                self.count(steps)
                self._pending = None
            case Pushed(value=value) if (steps := steps_in(value)) is not None:
                if self._was_set:
                    self._was_set = False
                else:
                    self.count(steps)
            case _:
                pass

    def count(self, steps: Steps) -> None:
        """Take a reading of the counters into account."""
        before, self._before = self._before, steps
        pending, self._was_set = self._pending, False
        if before is None:
            left = right = 0
        elif not self._is_strange(before, steps):
            left, right = wrapped(steps.left - before.left), wrapped(steps.right - before.right)
        elif pending is not None and not self._is_strange(pending, steps):
            left, right = wrapped(steps.left - pending.left), wrapped(steps.right - pending.right)
            self._pending = None
        elif fell_back(before, steps) or all(abs(wrapped(count)) <= TOLERANCE for count in steps):
            self.restarts += 1
            left, right = steps.left, steps.right
        else:  # another program drives the robot
            left, right = wrapped(steps.left - before.left), wrapped(steps.right - before.right)
        self.left += left
        self.right += right
        self.pose = advanced(self.pose, left, right, steps.time)
        if not self._under_way:  # otherwise the robot may not have taken the command yet
            self._slowest = self._fastest = self._commanded

    def _is_strange(self, before: Steps, now: Steps) -> bool:
        """Return whether the wheels cannot have turned from one reading to the other by their commands."""
        seconds = now.time - before.time
        return any(
            not least * seconds - TOLERANCE <= wrapped(new - old) <= most * seconds + TOLERANCE
            for new, old, least, most in zip(now, before, self._slowest, self._fastest, strict=True)
        )

    def _command(self, left: int, right: int) -> None:
        """Record a command; until the next reading the wheels may have any speed between the commands."""
        self._commanded = left, right
        self._slowest = min(self._slowest[0], left, 0), min(self._slowest[1], right, 0)
        self._fastest = max(self._fastest[0], left, 0), max(self._fastest[1], right, 0)

    def _set(self, left: int, right: int, time: float) -> None:
        self._before, self._pending = Steps(left, right, time=time), None
        self._was_set = True


def steps_in(value: object) -> Steps | None:
    """Return the step counters in an answer, alone or among other readings; None if there are none."""
    if isinstance(value, dict):
        return steps_in(value.get("encoders")) or steps_in(value.get("packet"))
    if isinstance(value, Sensors):
        return value.encoders
    return value if isinstance(value, Steps) else None


def fell_back(before: Steps, now: Steps) -> bool:
    """Return whether the counters fell back to about 0 faster than wheels can turn: the robot has restarted."""
    reach = FASTEST * max(0.0, now.time - before.time) + SLACK
    is_jump = any(abs(wrapped(new - old)) > reach for new, old in zip(now, before, strict=True))
    return is_jump and all(abs(wrapped(new)) <= reach for new in now)


def fell_back_over_gap(before: Steps, now: Steps) -> bool:
    """Return whether the counters are near 0 but were not: the robot was probably switched off in a gap."""
    return all(abs(count) <= SLACK for count in now) and any(abs(count) > 2 * SLACK for count in before)
