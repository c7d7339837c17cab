"""The camera, by 2.5-D column casting: every surface stands upright on the floor, so one ray a column finds them all.

A pinhole looks level and forward. Picture coordinates are offsets on the sensor from its optical axis in sensor
pixels, to the right and up, so a window, a zoom and the way a chip is mounted are all arithmetic of the caller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elib.physics.body import HEIGHT
from elib.physics.geometry import Colour, Pose, Wall
from elib.physics.scene import Scene

FORWARD = 0.030
"""The lens is this far ahead of the axle, m (Webots)."""

ABOVE = 0.028
"""Height of the lens above the floor, m (Webots)."""

SENSOR = (640, 480)
"""Columns and rows of the chip."""

FIELD = 56.0
"""Horizontal field of view of all 640 columns, degrees (epucklib); other sources lie between 38 and 60."""

FOCAL = SENSOR[0] / 2 / math.tan(math.radians(FIELD / 2))
"""Focal length, sensor pixels."""

FLOOR = Colour(176, 172, 164)
BACKGROUND = Colour(214, 222, 230)
ROBOT_BODY = Colour(58, 62, 66)
ROBOT_RING = Colour(148, 196, 140)  # The translucent ring that carries the LEDs.
RING_BAND = (0.036, 0.046)  # m above the floor, around the LEDs' height of 41 mm (Webots).

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Surface:
    """What one surface hides in each column: *depth* along the axis, m, infinite where it is not met."""

    depth: FloatArray
    low: float
    high: float
    colour: Colour
    shade: FloatArray


class Camera:
    """The eye of every robot of one world."""

    def __init__(self, scene: Scene) -> None:
        """Prepare the fixed surfaces of *scene*."""
        self._walls: tuple[Wall, ...] = scene.edge + scene.surfaces
        self._posts = scene.cylinders
        self._ends = np.array([(wall.x1, wall.y1) for wall in self._walls])
        self._spans = np.array([(wall.x2 - wall.x1, wall.y2 - wall.y1) for wall in self._walls])
        lengths = np.hypot(self._spans[:, 0], self._spans[:, 1])
        # Lit from one side, or two walls that meet in a corner would look like one.
        self._shades = 0.78 + 0.22 * np.abs(self._spans @ (0.9, 0.44)) / lengths

    def picture(
        self, pose: Pose, others: Sequence[tuple[Pose, float]], right: Sequence[float], up: Sequence[float]
    ) -> NDArray[np.uint8]:
        """Return what a robot sees.

        Args:
            pose: Where it stands.
            others: Poses and radii, m, of the other robots.
            right: Offset of each column's centre to the right of the axis, sensor pixels.
            up: Offset of each row's centre above the axis, sensor pixels.

        Returns:
            Red, green, blue, 0..255, in the shape (rows, columns, 3); rows and columns in the order given.
        """
        slope = np.asarray(up, dtype=np.float64)[:, np.newaxis] / FOCAL
        aside = np.asarray(right, dtype=np.float64) / FOCAL
        cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
        eye = np.array((pose.x + FORWARD * cosine, pose.y + FORWARD * sine))
        toward = np.stack((cosine + aside * sine, sine - aside * cosine))

        # Depth of the nearest thing so far: the floor below the horizon, nothing above it.
        below = np.where(slope < 0, slope, -1e-12)
        nearest = np.broadcast_to(np.where(slope < 0, -ABOVE / below, np.inf), (len(slope), len(aside))).copy()
        sky = np.clip(1.0 - 0.5 * slope, 0.6, 1.0)[:, :, np.newaxis] * np.array(BACKGROUND)
        ground = _fade(nearest)[:, :, np.newaxis] * np.array(FLOOR)
        picture = np.where((slope < 0)[:, :, np.newaxis], ground, sky)

        for surface in [*self._seen_walls(eye, toward), *self._seen_posts(eye, toward, others)]:
            depth = np.where(np.isfinite(surface.depth), surface.depth, 1e9)
            height = ABOVE + slope * depth
            seen = (surface.depth < nearest) & (height >= surface.low) & (height <= surface.high)
            nearest = np.where(seen, depth, nearest)
            light = (surface.shade * _fade(depth))[:, np.newaxis] * np.array(surface.colour)
            picture = np.where(seen[:, :, np.newaxis], light, picture)
        counts: NDArray[np.uint8] = np.clip(picture, 0, 255).astype(np.uint8)
        return counts

    def _seen_walls(self, eye: FloatArray, toward: FloatArray) -> list[_Surface]:
        offset_x, offset_y = (self._ends - eye).T[:, :, np.newaxis]
        span_x, span_y = self._spans.T[:, :, np.newaxis]
        crossing = toward[0] * span_y - toward[1] * span_x
        crossing = np.where(crossing == 0.0, 1e-300, crossing)
        with np.errstate(over="ignore"):
            depth = (offset_x * span_y - offset_y * span_x) / crossing
            part = (offset_x * toward[1] - offset_y * toward[0]) / crossing
        depth = np.where((depth > 0.0) & (part >= 0.0) & (part <= 1.0), depth, np.inf)
        return [
            _Surface(depth[k], 0.0, wall.height, wall.colour, np.full(depth.shape[1], self._shades[k]))
            for k, wall in enumerate(self._walls)
            if np.isfinite(depth[k]).any()
        ]

    def _seen_posts(self, eye: FloatArray, toward: FloatArray, others: Sequence[tuple[Pose, float]]) -> list[_Surface]:
        found = []
        for post in self._posts:
            depth, shade = _meet_disc(post.x - eye[0], post.y - eye[1], post.radius, toward)
            found.append(_Surface(depth, 0.0, post.height, post.colour, shade))
        for other, radius in others:
            depth, shade = _meet_disc(other.x - eye[0], other.y - eye[1], radius, toward)
            # The ring lies on the body: it comes first, and the body no longer wins where both are equally near.
            found.append(_Surface(depth, *RING_BAND, ROBOT_RING, shade))
            found.append(_Surface(depth, 0.0, HEIGHT, ROBOT_BODY, shade))
        return [surface for surface in found if np.isfinite(surface.depth).any()]


def _meet_disc(dx: float, dy: float, radius: float, toward: FloatArray) -> tuple[FloatArray, FloatArray]:
    square = toward[0] ** 2 + toward[1] ** 2
    middle = (dx * toward[0] + dy * toward[1]) / square
    under = middle**2 - (dx * dx + dy * dy - radius * radius) / square
    half = np.sqrt(np.maximum(under, 0.0))
    depth = np.where((under >= 0.0) & (middle > half), middle - half, np.inf)
    facing = np.clip(half * np.sqrt(square) / radius, 0.0, 1.0)
    return depth, 0.6 + 0.4 * facing


def _fade(depth: FloatArray) -> FloatArray:
    """Return how bright things look at *depth*, m: a little darker far away, as under a lamp carried along."""
    faded: FloatArray = 0.82 + 0.18 / (1.0 + 2.0 * np.minimum(depth, 100.0))
    return faded
