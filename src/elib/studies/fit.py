"""Fit of a robot profile to a recorded drive: wheels, link and infrared sensors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from elib.base.body import AXLE
from elib.base.errors import ArgumentError, ElibError
from elib.base.rules import MAX_TEXT
from elib.records.reader import Recording
from elib.simulator.emulator import robotprofile
from elib.simulator.emulator.robotprofile import RobotProfile
from elib.simulator.physics import Scene
from elib.simulator.worlds.files import parse
from elib.studies.comparison import Latencies, latencies_of
from elib.studies.infrared import REACH, CurveFit, fit_curve
from elib.studies.rays import depths
from elib.studies.rerun import Rerun, rerun
from elib.studies.series import Numbers, Series, path_of, readings_of
from elib.studies.wheels import TRUSTWORTHY, WheelFit, fit_wheels, spread

POSES_CURE = (
    "the recording of a virtual robot has them; with a real robot, measure them with a camera above it or a ruler and "
    "call recorder.measured(x, y, heading), twice a second or more"
)
WORLD_CURE = "name a world like the one it drove in, with poses measured in it: --world FILE.toml"
COUNTERS_CURE = "read robot.encoders() while driving, or drive with elib run calibration-drive --record FILE"
ANY_WORLD = "square"
"""World in which a drive without a world is run again to time its answers, which hardly depend on the place."""
SAMPLING = 0.01
"""s by which an infrared reading is older than a reading of the counters, as the fit assumes at first: half a sampling
period of 1/64 s, and more digits to send."""
PASSES = 3
"""Number of reruns to find the latency: an answer of several pieces waits for the slowest piece, which only the
simulation shows."""
LENGTH_DIGITS, TIME_DIGITS = 7, 5
"""Decimals of lengths in m and times in s in a profile: a tenth of a micrometre, and ten microseconds."""
SETTLED = 5e-5
"""s. The latency is found when it changes by less from one rerun to the next."""

Progress = Callable[[str], object]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class LinkFit:
    """The fitted link."""

    latency: float  # latency each way, s
    jitter: float  # standard deviation of the latency, s
    error: float  # standard error of the latency, s
    calls: int  # number of calls that were compared


@dataclass(frozen=True, slots=True)
class NotFitted:
    """A part of the profile that could not be fitted."""

    what: str  # `wheels`, `link` or `infrared`
    why: str  # the reason, in a sentence
    cure: str  # what to do about it


class _Lacking(ArgumentError):
    """The recording lacks what a part of the profile needs; the rest may still be fitted."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """Result of a fit.

    Attributes:
        profile: Profile of the robot.
        wheels: Details of the wheels; None if they could not be fitted.
        link: Details of the link; None if it could not be fitted.
        curve: Details of the infrared sensors; None if they could not be fitted.
        missing: The parts that could not be fitted.
    """

    profile: RobotProfile
    wheels: WheelFit | None
    link: LinkFit | None
    curve: CurveFit | None
    missing: tuple[NotFitted, ...]


def fit_robot(recording: Recording, *, world: str | None = None, progress: Progress = lambda text: None) -> Fitted:
    """Fit wheels, link and infrared sensors as far as the recording allows.

    Args:
        recording: Recording of a drive.
        world: World in which the robot drove, if the recording has none or another one; the measured poses are in its
            frame.
        progress: Called with what is being done.

    Raises:
        ArgumentError: Nothing can be fitted; or the drive has measured poses, but too little motion, or too much slip
            or contact, to find the wheels.
        LinkNotFound: The world does not exist.
        SimulationError: The world file breaks a rule.
    """
    missing: list[NotFitted] = []

    def attempt(what: str, fit: Callable[[], T], mistakes: type[ElibError]) -> T | None:
        try:
            return fit()
        except mistakes as error:
            missing.append(NotFitted(what, error.message, error.hint))
            return None

    readings = readings_of(recording)
    path = path_of(recording, measured=True)
    scene = _scene(recording, world)
    progress("wheels")
    wheels = attempt("wheels", lambda: _fit_wheels(readings.get("encoders"), path), _Lacking)
    about = "".join(each if each.isprintable() else "?" for each in f"fitted from {recording.name}")[:MAX_TEXT]
    rolling = None
    if wheels is not None:
        radii = robotprofile.NOMINAL_RADIUS * wheels.left, robotprofile.NOMINAL_RADIUS * wheels.right
        rolling = robotprofile.Wheels(*(round(each, LENGTH_DIGITS) for each in (*radii, wheels.axle)))
    progress("infrared sensors")
    curve = attempt("infrared", lambda: _fit_curve(readings.get("proximity"), path, scene, wheels), ArgumentError)
    # The link comes last: a reading of more digits takes longer, so a rerun needs sensors that read as the robot's do.
    profile = RobotProfile(about, rolling, None, None if curve is None else curve.infrared)
    progress("link")
    place = world if world or recording.scene else ANY_WORLD
    link = attempt("link", lambda: _fit_link(recording, profile, place), ElibError)
    if wheels is None and link is None and curve is None:
        first = missing[0]
        raise ArgumentError(f"nothing of {recording.name} can be fitted: {first.why}", hint=first.cure)
    if link is not None:
        profile = replace(
            profile, link=robotprofile.LinkDelay(round(link.latency, TIME_DIGITS), round(link.jitter, TIME_DIGITS))
        )
    return Fitted(profile, wheels, link, curve, tuple(missing))


def _scene(recording: Recording, world: str | None) -> Scene | None:
    if world is not None:
        return Scene.load(world)
    return parse(recording.scene.encode(), f"{recording.name}: world.toml") if recording.scene else None


def _fit_wheels(steps: Series | None, path: Series) -> WheelFit:
    if len(path.times) < 2:
        raise _Lacking("the recording has no measured poses", hint=POSES_CURE)
    if steps is None:
        raise _Lacking("the recording has no readings of the step counters", hint=COUNTERS_CURE)
    found = fit_wheels(steps, path)
    for name, scale in (("left wheel", found.left), ("right wheel", found.right), ("axle", found.axle / AXLE)):
        if not robotprofile.MIN_SCALE <= scale <= robotprofile.MAX_SCALE:
            raise ArgumentError(
                f"the {name} would be {scale:.3g} times the nominal one; {robotprofile.MIN_SCALE:g} to "
                f"{robotprofile.MAX_SCALE:g} times are possible for an e-puck: the robot probably slipped or "
                "pushed something all the time, or the poses are wrong",
                hint=TRUSTWORTHY,
            )
    return found


def _fit_link(recording: Recording, profile: RobotProfile, world: str | None) -> LinkFit:
    commands = latencies_of(recording)
    found: LinkFit | None = None
    for _ in range(PASSES):
        if found is not None:
            profile = replace(profile, link=robotprofile.LinkDelay(found.latency, found.jitter))
        with rerun(recording, profile=profile, world=world) as drive:
            there, here = round_trips(commands, drive)
        before, found = found, fit_link(there, here, found)
        if before is not None and abs(found.latency - before.latency) < SETTLED:
            break
    assert found is not None
    return found


def fit_link(recorded: Sequence[float], simulated: Sequence[float], before: LinkFit | None = None) -> LinkFit:
    """Find the latency with which the round trips of the simulator become the recorded ones.

    Args:
        recorded: Round trips in the recording, s.
        simulated: Round trips of the same calls in the simulator, s.
        before: The link of the simulator in that run; None for a link without delay.
    """
    if not len(recorded):
        raise ArgumentError(
            "no call of the recording was answered both there and in the simulator, so the link cannot be fitted",
            hint="record a drive that reads sensors: elib run calibration-drive --record FILE",
        )
    was = LinkFit(0.0, 0.0, 0.0, 0) if before is None else before
    there, here = np.asarray(recorded, dtype=float), np.asarray(simulated, dtype=float)
    # A round trip has two ways. The median ignores single calls that were late, for instance after a lost answer.
    latency = was.latency + (float(np.median(there)) - float(np.median(here))) / 2
    more = spread(there) ** 2 - spread(here) ** 2
    jitter = math.sqrt(max(was.jitter**2 + more / 2, 0.0))
    error = 1.2533 * spread(there) / 2 / math.sqrt(len(there))
    return LinkFit(max(latency, 0.0), jitter, error, len(there))


def round_trips(commands: dict[str, Latencies], drive: Rerun) -> tuple[list[float], list[float]]:
    """Return the round trips, s, of the calls that were answered both in a recording and in its rerun."""
    recorded = {call: trip for each in commands.values() for call, trip in each.trips}
    again = {
        drive.numbers[call - 1]: trip
        for each in latencies_of(drive.recording).values()
        for call, trip in each.trips
        if 1 <= call <= len(drive.numbers)
    }
    both = sorted(recorded.keys() & again.keys())
    return [recorded[call] for call in both], [again[call] for call in both]


def _fit_curve(near: Series | None, path: Series, scene: Scene | None, wheels: WheelFit | None) -> CurveFit:
    if len(path.times) < 2:
        raise _Lacking("the recording has no measured poses", hint=POSES_CURE)
    if wheels is None:
        why = "the recording has no readings of the step counters, which show how old readings are"
        raise _Lacking(why, hint=COUNTERS_CURE)
    if near is None:
        why = "the recording has no readings of the infrared sensors"
        raise _Lacking(why, hint="read robot.proximity() while driving")
    if scene is None:
        why = "the recording has no world, so the distances to the walls are not known"
        raise _Lacking(why, hint=WORLD_CURE)
    delay = wheels.delay + SAMPLING
    # The fitted age may be larger or smaller: readings near an end of the poses are left out.
    is_known = ~np.isnan(path.at(near.times - 4 * max(delay, 0.0) - 0.05)[:, 0])
    is_known &= ~np.isnan(path.at(near.times)[:, 0]) & ~np.isnan(path.at(near.times - delay)[:, 0])
    times, read = near.times[is_known], near.values[is_known]

    def depths_at(age: float) -> tuple[Numbers, Numbers]:
        poses = np.column_stack([np.interp(times - age, path.times, column) for column in path.values.T])
        return depths(scene, poses, REACH)

    if not len(times):
        raise _Lacking("no infrared reading has a measured pose just before and just after it", hint=POSES_CURE)
    return fit_curve(depths_at, read, delay)
