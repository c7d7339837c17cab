"""Which infrared sensors can see something that lies in a given direction: looked up instead of tried out.

The directions around a robot are cut into :data:`SECTORS`. For each the sensors are listed that a straight wall, or a
disc of a robot's size, can ever reach there; a world computes the lists once. They are generous by :data:`MARGIN_ANGLE`
and :data:`MARGIN`, which also covers a pose that is a few milliseconds old: a sensor too many costs time, a sensor too
few would be blind.
"""

from __future__ import annotations

import math
from typing import Final

from elib.physics.body import RADIUS, SENSOR_RADIUS
from elib.physics.engine import inner_kernel
from elib.physics.geometry import unit

SECTORS: Final = 64
"""A power of two, so that the sector's number is a cheap product."""

LIST: Final = 9
"""Room of one sector: how many sensors, then which."""

MARGIN = 0.003
"""m. A robot moves 1.5 mm while its four pairs are sampled."""

MARGIN_ANGLE = math.radians(5.0)
"""It turns by up to 3.3 degrees meanwhile."""

STRAY: Final = 0.0022
STRAY_ANGLE: Final = 0.07
"""m; rad. What a robot may move and turn meanwhile for the lists to hold: more than its wheels can, and less than the
margins by what the last bits of a contact take."""

TOUCHING: Final = RADIUS - MARGIN
"""m. Discs whose rims come nearer are not looked up: any sensor may see them."""

SAMPLES = 12  # Directions tried in each sector.

FAR: Final = 0.115
"""m. Discs whose centres are farther off have lists of their own, shorter ones."""


@inner_kernel
def sector(x: float, y: float) -> int:
    """Return the sector of a direction, 0..SECTORS - 1; (x, y) need not have length 1 but must not be (0, 0)."""
    share = y / (abs(x) + abs(y))
    around = 1.0 + share if x >= 0.0 else 3.0 - share
    return min(int(around * (SECTORS / 4)), SECTORS - 1)


def _directions(number: int) -> list[tuple[float, float]]:
    """Return directions spread over a sector and its margins."""
    ends = []
    for around in (number * 4 / SECTORS, (number + 1) * 4 / SECTORS):
        y = around - 1 if around <= 2 else 3 - around
        x = (1 - abs(y)) * (1 if around <= 2 else -1)
        ends.append(math.atan2(y, x))
    first, last = ends
    if last < first:
        last += math.tau
    first, last = first - MARGIN_ANGLE, last + MARGIN_ANGLE
    return [unit(first + (last - first) * k / (SAMPLES - 1)) for k in range(SAMPLES)]


def wall_lists(
    places: list[tuple[float, float]], axes: list[tuple[float, float]], aperture: float, reach: float
) -> tuple[list[int], list[float]]:
    """Return for each sector the sensors that can see a wall whose foot lies there, and how far off it may be.

    Args:
        places: Of the eight sensors, m.
        axes: Their directions, unit vectors.
        aperture: Angle of the outermost ray from the axis, rad.
        reach: Of a ray, m.

    Returns:
        :data:`LIST` numbers a sector, the farthest-sighted sensor first; and as many distances of the wall from the
        robot's centre, m.
    """
    lists: list[int] = []
    far: list[float] = []
    widest, spread = unit(aperture)
    for number in range(SECTORS):
        farthest = [-1.0] * len(places)
        for x, y in _directions(number):
            for i, ((place_x, place_y), (axis_x, axis_y)) in enumerate(zip(places, axes, strict=True)):
                closing = x * axis_x + y * axis_y
                turning = abs(y * axis_x - x * axis_y)
                fastest = 1.0 if closing >= widest else closing * widest + turning * spread
                if fastest > 0.0:
                    farthest[i] = max(farthest[i], x * place_x + y * place_y + reach * fastest + MARGIN)
        seeing = sorted((i for i in range(len(places)) if farthest[i] > 0.0), key=lambda i: (-farthest[i], i))
        rest = LIST - 1 - len(seeing)
        lists += [len(seeing), *seeing, *[0] * rest]
        far += [0.0, *(farthest[i] for i in seeing), *[0.0] * rest]
    return lists, far


def disc_lists(
    places: list[tuple[float, float]], axes: list[tuple[float, float]], aperture: float, reach: float
) -> list[int]:
    """Return for each sector the sensors that can see a disc of up to a robot's radius whose centre lies there.

    First the lists for centres nearer than :data:`FAR`, then those for the others.
    """
    lists: list[int] = []
    aperture_cosine, aperture_sine = unit(aperture)
    size = RADIUS + MARGIN
    ranges = (2 * RADIUS - MARGIN, FAR + MARGIN), (FAR - MARGIN, reach + SENSOR_RADIUS + RADIUS + MARGIN)
    for near, far in ranges:
        for number in range(SECTORS):
            seeing = set()
            for x, y in _directions(number):
                for i, ((place_x, place_y), (axis_x, axis_y)) in enumerate(zip(places, axes, strict=True)):
                    # At distance d the centre is d * along - back ahead of the sensor and d * across - off beside it.
                    # How far it is beyond the outermost ray is convex in d: least at an end, or where it is not
                    # beside the axis at all.
                    along, back = x * axis_x + y * axis_y, place_x * axis_x + place_y * axis_y
                    across, off = y * axis_x - x * axis_y, place_y * axis_x - place_x * axis_y
                    distances = [near, far]
                    if across != 0.0 and near < off / across < far:
                        distances.append(off / across)
                    beyond = min(
                        abs(d * across - off) * aperture_cosine - (d * along - back) * aperture_sine for d in distances
                    )
                    if beyond <= size and max(near * along, far * along) - back >= -size:
                        seeing.add(i)
            lists += [len(seeing), *sorted(seeing), *[0] * (LIST - 1 - len(seeing))]
    return lists
