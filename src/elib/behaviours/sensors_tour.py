"""A tour of everything that a robot can measure, in the callback style."""

from __future__ import annotations

from elib.behaviours import RunContext, behaviour
from elib.behaviours._run.tours import TIMEOUT, Timeout, TourStep, run_steps
from elib.robot.blocking import BlockingEpuck

STEPS = (
    TourStep("help_text", lambda robot: robot.help_text()),
    TourStep("accelerometer", lambda robot: robot.accelerometer()),
    TourStep("version", lambda robot: robot.version()),
    TourStep("camera", lambda robot: robot.camera()),
    TourStep("encoders", lambda robot: robot.encoders()),
    TourStep("image", lambda robot: robot.image()),
    TourStep("proximity", lambda robot: robot.proximity()),
    TourStep("ir_receiver", lambda robot: robot.ir_receiver()),
    TourStep("ambient_light", lambda robot: robot.ambient_light()),
    TourStep("microphones", lambda robot: robot.microphones()),
    TourStep("selector", lambda robot: robot.selector()),
    TourStep("speed", lambda robot: robot.speed()),
)
"""The order is that of 2011."""


@behaviour(group="samples of 2011")
def tour(robot: BlockingEpuck, run: RunContext, *, timeout: Timeout = TIMEOUT) -> None:
    """Read every sensor once, and tell its values.

    Each request is sent when the one before has ended. Its callback tells OK with the values, or KO with the reason,
    and the time.

    Args:
        robot: The robot.
        run: The run.
        timeout: How long each answer may take; slow commands keep their own timeout.
    """
    run_steps(robot, run, STEPS, timeout)
