"""The odometry of a robot: what the events of its link say about its wheels and its step counters."""

from __future__ import annotations

import math

from elib.base.body import step_rate, wrapped
from elib.base.errors import CommandRejected, LinkError
from elib.base.pose import Pose
from elib.link.protocol.context import Profile
from elib.link.protocol.table import Request
from elib.link.protocol.values import Sensors, Steps
from elib.link.session import (
    Channel,
    Ended,
    Ending,
    Greeted,
    Pushed,
    Resynced,
    SessionOpened,
    TraceEvent,
)
from elib.robot.reckoning import FASTEST, STILL, UNKNOWN, Change, Moment, Pair, Reckoning

SLACK = 100
"""Steps by which the counters may differ from the model without a restart being suspected."""
STREAM_PERIOD = 0.05
"""s that a packet of a stream may be older than its arrival, beside the way: the robot sends 50 a second or fewer."""
STARTUP = 4.0
"""s from a restart to the greeting of an e-puck2, which has no command for it (wire-protocol.md, 1.2)."""
MIN_STARTUP = 1.0
"""s from a restart to the greeting at least: the camera's driver sleeps, or the bootloader listens, as long (1.2)."""
LATEST_STOP = 1.0
"""s after the loss of a link within which the stop that was sent last has arrived, if it has."""

SETTING = ("set_speed", "stop", "set_encoders", "reset", "set_obstacle_avoidance")
"""Calls that change speeds or counters."""
EVENTS = (Ended, Pushed, Greeted, Resynced, Ending, SessionOpened)
"""What odometry has to be told of."""


class Odometry(Reckoning):
    """The pose of one robot, from everything that its link says about its wheels, whichever call asked for it.

    The motors step even if the robot cannot follow, so odometry notices neither slip nor a wall that stops the robot.

    Args:
        channel: The robot's link.
        time: When odometry begins, s.
        counters: The step counters as they were read then; None if they were not.
    """

    def __init__(self, channel: Channel, time: float, counters: Steps | None = None) -> None:
        super().__init__(Pose(0.0, 0.0, time=time), time)
        self._channel = channel
        self._trip = math.inf
        """The shortest round trip so far, s: a command arrives after half of it, however late its answer is."""
        self._heard = time
        self._was_set = False
        """Whether the counters were just set: the next packet of a stream may have been read before that."""
        self._wanted: Pair = STILL
        self._avoids = False
        self._lost: list[tuple[Request[object], float]] = []
        """Calls of SETTING whose answers are lost, and when they were sent: until the robot answers again, it may not
        have taken them yet."""
        self._opened(counters, time)
        self.startup = self._profile.service.get("reset", STARTUP)

    @property
    def _profile(self) -> Profile:
        return self._channel.context.profile

    def observe(self, time: float, event: TraceEvent) -> None:
        """Take an event of the link into account; a trace hook."""
        match event:
            case Ended(round_trip=trip, is_replaced=False) if not math.isnan(trip):
                self._ended(time, event)
            case Pushed(value=value) if (steps := steps_in(value)) is not None:
                if any(request.name in SETTING for request in self._channel.requests):
                    return  # the robot may have read them before it took that, or after
                self._settle(time)
                if not self._was_set:
                    self._read(steps, time - STREAM_PERIOD - self._half, time)
                self._was_set = False
            case Greeted():
                likely, latest = (max(self._heard, time - start) for start in (self.startup, MIN_STARTUP))
                self._restarted(Moment(self._heard, likely, latest))
                self.restarts += 1
            case Resynced():
                self._settle(time)
            case Ending():  # the line takes a last stop, perhaps, and the robot with it
                self._settle(time)
                self.change(Change(Moment(time, time, time + LATEST_STOP), STILL, is_sure=False))
            case SessionOpened(counters=counters):
                self._settle(time)
                self._trip = math.inf
                self._opened(counters, time)
            case _:
                pass

    @property
    def _half(self) -> float:
        return 0.0 if math.isinf(self._trip) else self._trip / 2

    def _ended(self, time: float, event: Ended) -> None:
        """Take the end of a call that was sent into account."""
        sent = time - event.round_trip
        if event.error is None:
            if self._lost:
                self._settle(time)
            self._heard = time
            if not event.request.service:
                self._trip = min(self._trip, event.round_trip)
        if (steps := steps_in(event.value)) is not None:
            self._was_set = False
            self._read(steps, sent, time)
        if event.request.name not in SETTING or isinstance(event.error, CommandRejected):
            return
        if event.overtook_at < sent:
            sent = event.overtook_at  # and was sent again in its turn
        if event.error is None:
            self._set(event.request, Moment(sent, sent + self._half, time), is_sure=True)
        else:
            self._lost.append((event.request, sent))
            if isinstance(event.error, LinkError):
                self._settle(time)

    def _settle(self, time: float) -> None:
        """Take the calls into account whose answers were lost; *time* is the latest at which the robot took them."""
        for request, sent in self._lost:
            self._set(request, Moment(sent, sent + self._half, max(time, sent + 2 * self._half)), is_sure=False)
        self._lost.clear()

    def _set(self, request: Request[object], when: Moment, *, is_sure: bool) -> None:
        """Take a call of SETTING into account."""
        given = request.numbers
        pair = (float(given[0]), float(given[1])) if len(given) == 2 else UNKNOWN
        match request.name:
            case "reset":
                self._restarted(when._replace(ended=when.at + self._half), is_sure=is_sure)  # it restarts at once
            case "set_encoders":
                self._was_set = True
                self.change(Change(when, None, pair, is_sure))
            case "set_obstacle_avoidance":
                self._avoids = bool(given[0])
                self.change(Change(when, UNKNOWN if self._avoids else self._wanted, None, is_sure))
            case "stop":
                self._avoids = False
                self.change(Change(when, STILL, None, is_sure))
            case _:
                rates = [step_rate(speed, self._profile.generation) for speed in pair]
                self._wanted = rates[0], rates[1]
                if math.isnan(pair[0]):
                    self._wanted = UNKNOWN
                self.change(Change(when, UNKNOWN if self._avoids else self._wanted, None, is_sure))

    def _restarted(self, when: Moment, *, is_sure: bool = True) -> None:
        self._was_set, self._wanted, self._avoids = True, STILL, False
        self.change(Change(when, STILL, STILL, is_sure))

    def _opened(self, counters: Steps | None, time: float) -> None:
        if counters is not None:
            self._read(counters, counters.time - self._half, time)

    def _read(self, steps: Steps, sent: float, time: float) -> None:
        when = Moment(sent, max(sent, steps.time - self._half), time)
        self.read((steps.left, steps.right), when, self._profile.counter_bits, steps.time)


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
