"""How far a robot's infrared rays go before they meet something, for many poses at once."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from elib.physics import Cylinder, Scene, Wall
from elib.physics.geometry import infrared_reflectance
from elib.physics.sensors.proximity import APERTURE, AXES, PLACES, SENSOR_HEIGHT, SHARES

Numbers: TypeAlias = NDArray[np.float64]


def depths(scene: Scene, poses: Numbers, reach: float) -> tuple[Numbers, Numbers]:
    """Return how deep each ray goes, as the response curve takes it, and the rays' weights.

    The depth is the length along the sensor's axis over the surface's reflectance, as the simulator has it. Things
    stand where the scene puts them; other robots are not there.

    Args:
        scene: With walls, boxes and cylinders.
        poses: x (m), y (m) and heading (rad) by row.
        reach: Depth of a ray that meets nothing, m.

    Returns:
        Depths, m, of the shape (poses, sensors, rays), and weights of the rays, which add up to 1.
    """
    cosine, sine = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
    places, axes = np.array(PLACES), np.array(AXES)
    x = poses[:, :1] + cosine * places[:, 0] - sine * places[:, 1]
    y = poses[:, 1:2] + sine * places[:, 0] + cosine * places[:, 1]
    found = []
    for side, _ in SHARES[scene.model.rays]:
        angle = math.radians(side * APERTURE)
        ahead_x = axes[:, 0] * math.cos(angle) - axes[:, 1] * math.sin(angle)
        ahead_y = axes[:, 0] * math.sin(angle) + axes[:, 1] * math.cos(angle)
        along_x, along_y = cosine * ahead_x - sine * ahead_y, sine * ahead_x + cosine * ahead_y
        nearest = np.full(x.shape, np.inf)
        absorbs = np.ones(x.shape)
        for length, reflectance in _lengths(scene, x, y, along_x, along_y):
            is_nearer = length < nearest
            nearest = np.where(is_nearer, length, nearest)
            absorbs = np.where(is_nearer, 1 / reflectance, absorbs)
        found.append(np.minimum(nearest * math.cos(angle) * absorbs, reach))
    return np.stack(found, axis=-1), np.array([share for _, share in SHARES[scene.model.rays]])


def _lengths(
    scene: Scene, x: Numbers, y: Numbers, along_x: Numbers, along_y: Numbers
) -> Iterator[tuple[Numbers, float]]:
    """Yield how far the rays go to each thing, m, infinite where they miss it, and its reflectance."""
    for wall in (*scene.edge, *scene.surfaces):
        if wall.height >= SENSOR_HEIGHT:
            yield _to_wall(wall, x, y, along_x, along_y), _reflectance(wall)
    for post in scene.cylinders:
        if post.height >= SENSOR_HEIGHT:
            yield _to_post(post, x, y, along_x, along_y), _reflectance(post)


def _to_wall(wall: Wall, x: Numbers, y: Numbers, along_x: Numbers, along_y: Numbers) -> Numbers:
    side_x, side_y = wall.x2 - wall.x1, wall.y2 - wall.y1
    to_x, to_y = wall.x1 - x, wall.y1 - y
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = along_x * side_y - along_y * side_x
        length = (to_x * side_y - to_y * side_x) / cross
        place = (to_x * along_y - to_y * along_x) / cross
    meets = (length >= 0) & (place >= 0) & (place <= 1)  # false for what is not a number
    found: Numbers = np.where(meets, length, np.inf)
    return found


def _to_post(post: Cylinder, x: Numbers, y: Numbers, along_x: Numbers, along_y: Numbers) -> Numbers:
    to_x, to_y = post.x - x, post.y - y
    middle = to_x * along_x + to_y * along_y
    beside = to_x * along_y - to_y * along_x
    rest = post.radius * post.radius - beside * beside
    length = middle - np.sqrt(np.maximum(rest, 0))
    found: Numbers = np.where((rest >= 0) & (length >= 0), length, np.inf)
    return found


def _reflectance(thing: Wall | Cylinder) -> float:
    return infrared_reflectance(thing.colour) if thing.reflectance is None else thing.reflectance
