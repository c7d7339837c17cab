"""The drivers of the stepper motors: the step rates they can make, and the step counters.

A timer that counts whole ticks steps a motor, so only some rates exist (wire-protocol.md, 5.1). The counters count the
steps that were issued, whether or not the wheel could follow.
"""

from __future__ import annotations

from typing import Protocol

from elib.base.body import FASTEST, FASTEST_2, MOTOR_FREQUENCY, MOTOR_TIMER, step_period, step_rate, wrapped


class StepMotor(Protocol):
    """One wheel's motor and its step counter."""

    speed: int
    """The present speed, steps/s, limited to what the driver accepts."""
    steps: int
    """The step counter, as the firmware reads it. May be set."""
    turned: float
    """Steps that the wheel was moved since power-on, backwards negative; nothing sets it, and it never wraps."""

    def set_speed(self, speed: int) -> None:
        """Set the speed, steps/s; beyond the limits the nearest possible speed is taken, without a message."""

    @property
    def rate(self) -> float:
        """The true step rate, steps/s, signed; it differs from the speed by the driver's quantisation."""

    def tick(self, count: int) -> None:
        """Let *count* ticks of 0.1 ms pass."""

    def run(self, seconds: float) -> None:
        """Let *seconds* pass; the part of a timer tick that is left over is kept for the next call."""


class PowerSavingMotor:
    """The e-puck1's motor: an "agenda" that its firmware calls every so many ticks of 0.1 ms, at most 1000 steps/s.

    Below 601 steps/s a step takes two calls: the first powers the coils and moves, the second, 1.5 ms later,
    switches them off and waits for the rest. A new speed changes the wait but not the phase, so the first step
    after a change may come late.
    """

    SAVING_BELOW = 601  # steps/s (wire-protocol.md, 5.1)
    POWERED = 10_000 // 650  # ticks: "only about 1.5 ms per step" (wire-protocol.md, 5.1)

    def __init__(self) -> None:
        self.speed = 0
        self.turned = 0.0
        self._steps = 0
        self._cycle = 0
        self._counter = 0
        self._is_powered = False
        self._rest = 0.0

    @property
    def steps(self) -> int:
        """The step counter, -32768..32767; it wraps."""
        return self._steps

    @steps.setter
    def steps(self, value: int) -> None:
        self._steps = wrapped(value, 16)

    def set_speed(self, speed: int) -> None:
        """Set the speed, steps/s, limited to -1000..1000."""
        self.speed = max(-FASTEST, min(FASTEST, speed))
        self._cycle = step_period(self.speed, 1) if self.speed else 0

    @property
    def rate(self) -> float:
        """The true step rate, steps/s, signed."""
        return step_rate(self.speed, 1)

    def tick(self, count: int) -> None:
        """Let *count* ticks of 0.1 ms pass."""
        if self.speed == 0:
            return
        while count > 0:
            wait = max(1, self._cycle - self._counter)
            if wait > count:
                self._counter += count
                return
            count -= wait
            self._counter = 0
            if self._call():
                count -= self._whole_steps(count)

    def run(self, seconds: float) -> None:
        """Let *seconds* pass."""
        if self.speed == 0:
            return
        self._rest += seconds / MOTOR_TIMER
        whole = int(self._rest)
        self._rest -= whole
        self.tick(whole)

    def _call(self) -> bool:
        """Run the agenda once; return whether it made a step."""
        saves = abs(self.speed) < self.SAVING_BELOW
        if self._is_powered and saves:
            self._is_powered = False
            self._cycle = step_period(self.speed, 1) - self.POWERED
            return False
        self._step(1)
        if saves:
            self._is_powered = True
            self._cycle = self.POWERED
        return True

    def _whole_steps(self, count: int) -> int:
        """Make as many whole steps as fit into *count* ticks, and return the ticks used."""
        period = step_period(self.speed, 1)
        whole = count // period
        self._step(whole)
        return whole * period

    def _step(self, count: int) -> None:
        moved = count if self.speed > 0 else -count
        self.turned += moved
        self.steps = self._steps + moved


class MicrostepMotor:
    """The e-puck2's motor: two microsteps a step from a timer of 100 kHz, at most 1100 steps/s.

    The timer keeps running when the speed changes and while the motor stands, so its count shortens the first microstep
    of the new speed, but never more than that one.
    """

    HALTED = 1_000  # ticks: the timer's period while the motor stands

    def __init__(self) -> None:
        self.speed = 0
        self.turned = 0.0
        self._microsteps = 0
        self._interval = self.HALTED
        self._counter = 0
        self._rest = 0.0

    @property
    def steps(self) -> int:
        """The step counter: half the 32-bit counter of microsteps, so 31 bits, rounded towards zero."""
        return int(self._microsteps / 2)

    @steps.setter
    def steps(self, value: int) -> None:
        self._microsteps = wrapped(2 * value, 32)

    def set_speed(self, speed: int) -> None:
        """Set the speed, steps/s: cut to 16 bits first, then limited to -1100..1100."""
        self.speed = max(-FASTEST_2, min(FASTEST_2, wrapped(speed, 16)))
        self._interval = step_period(self.speed, 2) if self.speed else self.HALTED
        if self._counter > self._interval:
            self._counter = self._interval + self._counter % self._interval

    @property
    def rate(self) -> float:
        """The true step rate, steps/s, signed."""
        return step_rate(self.speed, 2)

    def tick(self, count: int) -> None:
        """Let *count* ticks of 0.1 ms pass."""
        self._advance(count * (MOTOR_FREQUENCY // 10_000))

    def run(self, seconds: float) -> None:
        """Let *seconds* pass."""
        self._rest += seconds * MOTOR_FREQUENCY
        whole = int(self._rest)
        self._rest -= whole
        self._advance(whole)

    def _advance(self, ticks: int) -> None:
        made, self._counter = divmod(self._counter + ticks, self._interval)
        if self.speed:
            moved = made if self.speed > 0 else -made
            self.turned += moved / 2
            self._microsteps = wrapped(self._microsteps + moved, 32)
