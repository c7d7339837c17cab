"""The step drivers, tick by tick."""

import random
from collections.abc import Callable

import pytest

from elib.base.body import wrapped
from elib.simulator.emulator.motors import MicrostepMotor, PowerSavingMotor, StepMotor


def drive(motor: StepMotor, speed: int, ticks: int) -> int:
    before = motor.steps
    motor.set_speed(speed)
    motor.tick(ticks)
    return motor.steps - before


@pytest.mark.parametrize(
    ("value", "bits", "cut"), [(32767, 16, 32767), (32768, 16, -32768), (-32769, 16, 32767), (2**32 + 5, 32, 5)]
)
def test_integers_wrap_at_their_width(value: int, bits: int, cut: int) -> None:
    assert wrapped(value, bits) == cut


@pytest.mark.parametrize(
    ("speed", "rate"),
    # wire-protocol.md, 5.1
    [(1000, 999.7), (999, 999.7), (950, 999.7), (900, 908.8), (800, 833.1), (700, 714.1), (600, 624.8), (150, 151.5)],
)
def test_the_e_puck1_knows_only_whole_ticks_a_step(speed: int, rate: float) -> None:
    motor = PowerSavingMotor()
    motor.set_speed(speed)
    assert motor.rate == pytest.approx(rate, abs=0.1)
    motor.set_speed(-speed)
    assert motor.rate == pytest.approx(-rate, abs=0.1)


@pytest.mark.parametrize("motor", [PowerSavingMotor(), MicrostepMotor()], ids=["e-puck1", "e-puck2"])
def test_a_halted_motor_makes_no_steps(motor: StepMotor) -> None:
    motor.set_speed(0)
    motor.tick(100_000)
    motor.run(10.0)
    assert (motor.steps, motor.rate) == (0, 0.0)


@pytest.mark.parametrize(
    ("motor", "asked", "taken"),
    [
        (PowerSavingMotor(), 1001, 1000),
        (PowerSavingMotor(), -32768, -1000),
        (MicrostepMotor(), 1101, 1100),
        (MicrostepMotor(), 40_000, -1100),
        (MicrostepMotor(), 65_436, -100),
    ],
)
def test_speeds_are_clipped_after_they_were_cut_to_16_bits(motor: StepMotor, asked: int, taken: int) -> None:
    motor.set_speed(asked)
    assert motor.speed == taken


def test_a_change_of_speed_while_the_coils_are_powered_delays_the_next_step() -> None:
    motor = PowerSavingMotor()
    assert drive(motor, 500, 10_000) == 500
    # 3,333 ticks to switch off, 3,318 to the first step: 29 steps instead of 30.
    assert drive(motor, 3, 100_000) == 29


def test_a_new_speed_does_not_restart_the_agenda() -> None:
    motor = PowerSavingMotor()
    motor.set_speed(1)
    motor.tick(9_999)
    assert drive(motor, 1000, 1) == 1


def test_ticks_one_by_one_and_all_at_once_are_the_same() -> None:
    for speed in (1, 3, 37, 299, 600, 601, 999, -5, -750):
        for make in (PowerSavingMotor, MicrostepMotor):
            at_once, singly = make(), make()
            for motor in (at_once, singly):
                drive(motor, 440, 1_237)
                motor.set_speed(speed)
            at_once.tick(7_777)
            for _ in range(7_777):
                singly.tick(1)
            assert at_once.steps == singly.steps


def test_the_e_puck1_counts_in_16_bits() -> None:
    motor = PowerSavingMotor()
    motor.steps = 32_767
    assert drive(motor, 100, 1_000) == 10 - 65_536
    motor.steps = 40_000
    assert motor.steps == -25_536


def test_the_e_puck2_counts_half_of_32_bits() -> None:
    motor = MicrostepMotor()
    motor.steps = 32_767
    assert drive(motor, 100, 1_000) == 10
    motor.steps = 2**31 - 1
    assert motor.steps == -1
    motor.steps = 1_215_752_191
    assert motor.steps == -931_731_457


def test_half_a_step_is_not_counted_forward_or_backward() -> None:
    motor = MicrostepMotor()
    motor.set_speed(-100)
    motor.tick(50)  # one microstep
    assert motor.steps == 0
    motor.tick(50)
    assert motor.steps == -1


def test_what_the_e_puck2s_timer_has_counted_carries_over() -> None:
    motor = MicrostepMotor()
    drive(motor, 300, 10_000)  # 602 microsteps of 166 ticks, 68 ticks left
    assert motor.steps == 301
    assert drive(motor, 1000, 10_000) == 1000  # 100,068 ticks of 50: 2,001 microsteps


@pytest.mark.parametrize("speeds", [(0, 500), (500,), (-500,), (0, 1100), (7, 0, 300)])
@pytest.mark.parametrize("make", [PowerSavingMotor, MicrostepMotor])
def test_a_slow_speed_never_becomes_a_burst_of_steps_at_the_next_one(
    make: Callable[[], StepMotor], speeds: tuple[int, ...]
) -> None:
    for waited in (0.003, 0.1, 0.25, 0.49):
        motor = make()
        motor.set_speed(1)
        motor.run(waited)
        for speed in speeds[:-1]:
            motor.set_speed(speed)
            motor.run(0.4)
        before = motor.steps
        motor.set_speed(speeds[-1])
        motor.run(2e-4)
        assert abs(motor.steps - before) <= 1


def test_a_motor_makes_no_more_steps_than_its_speeds_allow_whatever_they_were() -> None:
    draw = random.Random(13)
    for make in (PowerSavingMotor, MicrostepMotor):
        motor = make()
        for _ in range(2_000):
            motor.set_speed(draw.choice((0, draw.randint(-5, 5), draw.randint(-1000, 1000))))
            before, seconds = motor.steps, draw.expovariate(10)
            motor.run(seconds)
            assert abs(wrapped(motor.steps - before, 16)) <= abs(motor.rate) * seconds + 2


def test_running_in_small_pieces_loses_no_time() -> None:
    for make in (PowerSavingMotor, MicrostepMotor):
        motor = make()
        motor.set_speed(1000)
        for _ in range(12_345):
            motor.run(81e-6)
        assert motor.steps == pytest.approx(12_345 * 81e-6 * motor.rate, abs=1.01)
