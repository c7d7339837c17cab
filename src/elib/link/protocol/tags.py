"""Find AprilTags in a picture, and how far away they are. Needs OpenCV, the extra ``vision``."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from elib.base.body import FOCAL
from elib.base.errors import Unsupported
from elib.base.extras import install
from elib.base.infrared import NINE_IN_TEN
from elib.base.tags import codes
from elib.link.protocol.lines import brightness

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

ENLARGED: Final = 4
"""Pixels of the searched picture for one of the robot's: OpenCV finds no tag whose cells are two pixels wide, but finds
them in the enlarged picture."""

CORNER_ERROR: Final = 0.2
"""Standard deviation of where a corner is found, pixels of the robot's picture: twice what pictures of the simulated
camera have (benchmarks/tags.py), because real ones blur."""

LENS_ERROR: Final = 0.048
"""Part by which the focal length may be wrong: 47 degrees, give or take 2 (measured-robots: camera.focal_length)."""


class Tag(NamedTuple):
    """An AprilTag in a picture."""

    number: int
    distance: float  # from the camera to its middle, m
    bearing: float  # its direction, rad from straight ahead, positive to the left
    distance_error: float  # by how much the distance may be wrong, m: nine times in ten it is less
    bearing_error: float  # by how much the bearing may be wrong, rad, in the same way


@functools.cache
def _detector(family: str) -> Any:
    try:
        import cv2
    except ImportError:
        raise Unsupported(
            "tags are found with the package opencv-python-headless, which is not installed", hint=install("vision")
        ) from None
    rules = cv2.aruco.DetectorParameters()
    rules.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG  # five times as exact; counts from pixels' edges
    rules.errorCorrectionRate = 0.0  # with the few cells of 16h5, much looks like a tag that has one wrong
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{family}"))
    return cv2.aruco.ArucoDetector(dictionary, rules)


def find(pixels: NDArray[numpy.uint8], zoom: int, size: float, family: str) -> list[Tag]:
    """Return the tags in an upright picture, the nearest first.

    Tags and camera stand upright, so the left and the right edge of a tag say how far away they are.

    Args:
        pixels: A picture, in grey or in colours.
        zoom: Pixels of the chip for one of it.
        size: Side of the black square, m.
        family: ``16h5`` or ``36h11``.

    Raises:
        ArgumentError: There is no such family.
        Unsupported: OpenCV is not installed.
    """
    codes(family)  # refuses a wrong one
    detector = _detector(family)
    import cv2

    grey = brightness(pixels).round().astype("u1")
    width = grey.shape[1]
    large = cv2.resize(grey, None, fx=ENLARGED, fy=ENLARGED, interpolation=cv2.INTER_CUBIC)
    corners, numbers, _ = detector.detectMarkers(large)
    if numbers is None:
        return []
    found = []
    for number, four in zip(numbers.ravel(), corners, strict=True):
        places = sorted((x / ENLARGED - width / 2, y / ENLARGED) for x, y in four[0].tolist())
        found.append(_seen(int(number), places, zoom / FOCAL, size))
    return sorted(found, key=lambda tag: tag.distance)


def _seen(number: int, places: Sequence[tuple[float, float]], pixel: float, size: float) -> Tag:
    """Return a tag whose corners are there, from left to right, pixels right of the axis; a pixel sees so many rad."""
    heights = [abs(places[k][1] - places[k + 1][1]) for k in (0, 2)]
    depths = [size / (max(height, 1.0) * pixel) for height in heights]
    asides = [depth * (places[k][0] + places[k + 1][0]) / 2 * pixel for depth, k in zip(depths, (0, 2), strict=True)]
    ahead, aside = sum(depths) / 2, sum(asides) / 2
    distance, tangent = math.hypot(ahead, aside), aside / ahead
    height = sum(heights) / 2
    corner = NINE_IN_TEN * CORNER_ERROR
    return Tag(
        number,
        distance,
        -math.atan(tangent),
        distance * math.hypot(LENS_ERROR, corner / height),
        math.hypot(LENS_ERROR * tangent, corner * pixel),
    )
