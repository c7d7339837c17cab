"""A tour of everything that a robot can do, in the callback style."""

from __future__ import annotations

from elib.behaviours import RunContext, behaviour
from elib.behaviours._run.tours import TIMEOUT, Timeout, TourStep, run_steps
from elib.link.protocol.quantities import CameraMode, LedAction
from elib.robot.blocking import BlockingEpuck

ALL_LEDS = 8

STEPS = (
    TourStep("reset", lambda robot: robot.reset(), pause=1.5),
    TourStep("set_body_led", lambda robot: robot.set_body_led(LedAction.TOGGLE)),
    TourStep("calibrate_proximity", lambda robot: robot.calibrate_proximity(), pause=1.0),
    TourStep("set_front_led", lambda robot: robot.set_front_led(LedAction.TOGGLE)),
    TourStep("set_led", lambda robot: robot.set_led(ALL_LEDS, LedAction.TOGGLE)),
    TourStep("set_speed", lambda robot: robot.set_speed(1.0, -1.0)),
    TourStep("play_sound", lambda robot: robot.play_sound(3)),
    TourStep("set_camera", lambda robot: robot.set_camera(40, 40, 8, CameraMode.GREY)),
    TourStep("set_encoders", lambda robot: robot.set_encoders(3001, -3000)),
    TourStep("stop", lambda robot: robot.stop()),
)
"""The order and the pauses are those of 2011."""


@behaviour(group="samples of 2011")
def tour(robot: BlockingEpuck, run: RunContext, *, timeout: Timeout = TIMEOUT) -> None:
    """Call every actuator once, and tell which commands the robot confirmed.

    The robot restarts, calibrates, blinks, turns quickly on the spot and plays a sound: leave it some room. Each
    command is sent when the one before has ended, and its callback tells OK or KO with the time.

    Args:
        robot: The robot.
        run: The run.
        timeout: How long each answer may take; slow commands keep their own timeout.
    """
    run_steps(robot, run, STEPS, timeout)
