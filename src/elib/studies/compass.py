"""A compass from the magnetometer: fit to a turn on the spot, and what it corrects.

Iron and magnets that turn with the robot add a constant field to the Earth's, and soft iron bends that. So on a turn on
the spot the tip of the measured field, seen from above, runs round an ellipse instead of a circle about zero. The fit
finds the ellipse; a :class:`Compass` moves its middle to zero and makes it round.

What a turn on the spot cannot tell:

* The upright part of both errors. It does not matter while the robot stands level.
* How the chip is turned in the robot. A chip that is mirrored is recognised, because the robot turned left; one that is
  rotated makes every heading wrong by the same angle, which :meth:`Compass.aligned` takes out. No source says how the
  axes of the e-puck2's chips lie.
* Iron that does not turn with the robot: a table's frame, a cable in the floor. Calibrate where you drive.
* What the motors' currents add. They are the same in a steady turn, and others on a straight line.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from elib.base.body import AXLE, WHEEL_CIRCUMFERENCE
from elib.base.errors import ArgumentError, Unsupported
from elib.link.protocol.values import MagneticField
from elib.robot.aio import Epuck

MIN_READINGS = 16
"""Readings that a fit needs: three times the five unknowns of an ellipse, and one for the sense of the turn."""
WIDEST_GAP = math.radians(60)
"""Largest part of the ellipse without a reading. With a wider gap the noise decides how the ellipse closes."""
MIN_STRENGTH = 1e-6
"""T. The horizontal field of the Earth is 10 to 40 uT; with less, the chip is off, or shielded."""
MAX_DEVIATION = 0.1
"""Largest deviation of a reading from the ellipse, root mean square, as a share of the field: 6 degrees of heading."""
TURNS = 1.2
"""Turns on the spot: one, and some more because wheels and times are not exact."""
TURN_RATE = 0.5
"""rad/s. The slower chip measures 8 times a second: then a turn has 100 readings."""
ADVICE = "turn the robot to the left on the spot, once round at an even speed, away from iron, and read all the time"


@dataclass(frozen=True, slots=True)
class Compass:
    """The correction of a robot's magnetometer; :func:`fit_compass` finds it.

    Attributes:
        centre: The constant field of the robot itself, forward and to the left, T (hard iron).
        matrix: What makes the ellipse round, after *centre* was subtracted; two rows of two (soft iron).
        strength: Horizontal field after that, T.
        deviation: How far the readings were from the ellipse, root mean square, as a share of the strength.
        zero: Angle that is added to every heading, rad.
    """

    centre: tuple[float, float]
    matrix: tuple[tuple[float, float], tuple[float, float]]
    strength: float
    deviation: float = 0.0
    zero: float = 0.0

    def corrected(self, field: MagneticField) -> MagneticField:
        """Return *field* without the robot's own part, T; the upright part stays as it is."""
        x, y = field.x - self.centre[0], field.y - self.centre[1]
        (xx, xy), (yx, yy) = self.matrix
        return replace(field, x=xx * x + xy * y, y=yx * x + yy * y)

    def north(self, field: MagneticField) -> float:
        """Return the direction of magnetic north, rad, 0 ahead of the robot, positive to the left, -pi to pi."""
        right = self.corrected(field)
        return math.remainder(math.atan2(right.y, right.x) - self.zero, math.tau)

    def heading(self, field: MagneticField) -> float:
        """Return the robot's heading, rad, -pi to pi, positive to the left, on a map with north upwards.

        As in :class:`elib.Pose`, x is to the right: 0 is east, pi/2 is magnetic north.
        """
        return math.remainder(math.pi / 2 - self.north(field), math.tau)

    def aligned(self, field: MagneticField, heading: float) -> Compass:
        """Return a compass whose heading for *field* is *heading*, rad: for a chip that is turned in the robot.

        Args:
            field: A reading.
            heading: Where the robot looked at that time.
        """
        return replace(self, zero=math.remainder(self.zero + heading - self.heading(field), math.tau))


def fit_compass(fields: Iterable[MagneticField]) -> Compass:
    """Find the correction from readings of a turn on the spot to the left.

    Args:
        fields: Readings in the order in which they were taken, once round at least.

    Raises:
        ArgumentError: There are too few readings, they do not go round, or they are not on an ellipse; the message says
            what to do.
    """
    measured = np.array([(field.x, field.y) for field in fields], dtype=np.float64).reshape(-1, 2)
    if len(measured) < MIN_READINGS:
        raise ArgumentError(
            f"there are {len(measured)} readings of the magnetometer; a fit needs {MIN_READINGS}", hint=ADVICE
        )
    middle = measured.mean(axis=0)
    size = float(np.abs(measured - middle).max())
    if size < MIN_STRENGTH:
        raise ArgumentError(
            f"the magnetometer changes by {size * 1e6:.2g} uT only: it is switched off, or the robot did not turn",
            hint="call start_magnetometer() first, and turn the robot while you read",
        )
    # The conic a x2 + b xy + c y2 + d x + e y = 1 in a scale where its numbers are about 1.
    x, y = ((measured - middle) / size).T
    a, b, c, d, e = np.linalg.lstsq(np.column_stack((x * x, x * y, y * y, x, y)), np.ones(len(x)), rcond=None)[0]
    form = np.array(((a, b / 2), (b / 2, c)))
    lengths, axes = np.linalg.eigh(form)
    if lengths[0] <= 0.0:
        raise ArgumentError("the readings of the magnetometer are not on an ellipse", hint=ADVICE)
    centre = -np.linalg.solve(form, (d, e)) / 2
    # To the unit circle, along the axes of the ellipse: like this a round one is only made larger, and not turned.
    to_circle = axes @ np.diag(np.sqrt(lengths / (1.0 + centre @ form @ centre))) @ axes.T
    unit = (np.column_stack((x, y)) - centre) @ to_circle.T
    deviation = float(np.sqrt(np.mean((np.hypot(*unit.T) - 1.0) ** 2)))
    if deviation > MAX_DEVIATION:
        raise ArgumentError(
            f"the readings of the magnetometer are {100 * deviation:.0f} % of the field beside the ellipse that fits "
            f"them best; {100 * MAX_DEVIATION:.0f} % are allowed",
            hint=ADVICE,
        )
    sense = _sense(np.arctan2(unit[:, 1], unit[:, 0]))
    radius = size / math.sqrt(float(np.linalg.det(to_circle)))
    matrix = np.diag((1.0, sense)) @ to_circle * (radius / size)
    offset = middle + size * centre
    return Compass(
        (float(offset[0]), float(offset[1])),
        ((float(matrix[0, 0]), float(matrix[0, 1])), (float(matrix[1, 0]), float(matrix[1, 1]))),
        radius,
        deviation,
    )


def _sense(angles: np.typing.NDArray[np.float64]) -> float:
    """Return -1.0 if the chip is mirrored, else 1.0, from the field's angles of a left turn."""
    order = np.sort(angles)
    gap = float(np.max(np.diff(order, append=order[0] + math.tau)))
    if gap > WIDEST_GAP:
        raise ArgumentError(
            f"{math.degrees(gap):.0f} degrees of the turn have no reading of the magnetometer; "
            f"{math.degrees(WIDEST_GAP):.0f} are allowed",
            hint=ADVICE,
        )
    # The robot turns left, so that north moves to the right as the robot sees it.
    turned = float(np.sum(np.remainder(np.diff(angles) + math.pi, math.tau) - math.pi))
    if abs(turned) < math.tau - WIDEST_GAP:
        raise ArgumentError("the readings of the magnetometer are not in the order of one turn", hint=ADVICE)
    return 1.0 if turned < 0.0 else -1.0


async def calibrate_compass(robot: Epuck) -> Compass:
    """Turn the robot on the spot to the left, 15 s, and return the correction of its magnetometer.

    Args:
        robot: It needs room to turn. It stands at the end, whatever happens.

    Raises:
        Unsupported: The robot does not have a magnetometer.
        ArgumentError: The readings are not those of a turn: the robot was held, or iron is near.
    """
    await robot.magnetometer()  # refused before anything moves
    with contextlib.suppress(Unsupported):  # on a link without that command the chip is on, or cannot be switched on
        await robot.start_magnetometer()
    pace = TURN_RATE * AXLE / 2 / WHEEL_CIRCUMFERENCE
    fields = []
    try:
        await robot.set_speed(-pace, pace)
        end = robot.time + TURNS * math.tau / TURN_RATE
        while robot.time < end:
            fields.append(await robot.magnetometer())
    finally:
        await robot.stop()
    return fit_compass(fields)
