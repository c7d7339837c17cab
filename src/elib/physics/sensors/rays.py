"""Rays from a robot's rim to the nearest surface: what infrared and time-of-flight sensors share.

A fan of rays is four flat sequences in the robot's frame: the place x and y of each sensor, and the direction x
and y of each ray, unit vectors, as many a sensor for all of them, the middle one along the sensor's axis.
Written, like :mod:`elib.physics.kernels`, for Numba too.
"""

from __future__ import annotations

from math import sqrt

from elib.physics.kernels import Floats


def cast(
    robot: int,
    x: Floats,
    y: Floats,
    heading_x: float,
    heading_y: float,
    radius: Floats,
    walls: Floats,
    discs: Floats,
    place_x: Floats,
    place_y: Floats,
    ray_x: Floats,
    ray_y: Floats,
    spread: float,
    reach: float,
    rim: float,
    distances: Floats,
) -> None:
    """Find how far each ray of *robot* goes before it meets a wall, a disc or another robot.

    Args:
        robot: Index of the robot that looks.
        x: Centres of all robots, m.
        y: Centres of all robots, m.
        heading_x: Cosine of its heading.
        heading_y: Sine of its heading.
        radius: Of all robots, m.
        walls: All walls, five numbers each, seen from both sides.
        discs: Fixed discs, three numbers each.
        place_x: Of the sensors, m.
        place_y: Of the sensors, m.
        ray_x: Of the rays' directions.
        ray_y: Of the rays' directions.
        spread: Sine of the angle between a sensor's axis and its outermost ray.
        reach: How far a ray goes, m.
        rim: Distance from the centre within which all sensors sit, m.
        distances: Out: one a ray, m; *reach* where it meets nothing nearer.
    """
    for k in range(len(distances)):
        distances[k] = reach
    here_x = x[robot]
    here_y = y[robot]
    horizon = reach + rim
    for k in range(0, len(walls), 5):
        dx = walls[k] - here_x
        dy = walls[k + 1] - here_y
        tangent_x = walls[k + 2]
        tangent_y = walls[k + 3]
        offset = tangent_x * dy - tangent_y * dx
        if offset > horizon or offset < -horizon:
            continue
        start = tangent_x * dx + tangent_y * dy
        end = start + walls[k + 4]
        if start > horizon or end < -horizon:
            continue
        # The wall's normal, seen by the robot and turned so that the wall lies ahead of it along the normal.
        forward = tangent_x * heading_y - tangent_y * heading_x
        leftward = tangent_x * heading_x + tangent_y * heading_y
        if offset >= 0.0:
            _meet_wall(forward, leftward, offset, start, end, place_x, place_y, ray_x, ray_y, spread, reach, distances)
        else:
            _meet_wall(
                -forward, -leftward, -offset, -end, -start, place_x, place_y, ray_x, ray_y, spread, reach, distances
            )
    for k in range(0, len(discs), 3):
        dx = discs[k] - here_x
        dy = discs[k + 1] - here_y
        limit = horizon + discs[k + 2]
        if dx * dx + dy * dy < limit * limit:
            forward = dx * heading_x + dy * heading_y
            leftward = dy * heading_x - dx * heading_y
            _meet_disc(forward, leftward, discs[k + 2], place_x, place_y, ray_x, ray_y, reach, distances)
    for k in range(len(x)):
        dx = x[k] - here_x
        dy = y[k] - here_y
        limit = horizon + radius[k]
        if k != robot and dx * dx + dy * dy < limit * limit:
            forward = dx * heading_x + dy * heading_y
            leftward = dy * heading_x - dx * heading_y
            _meet_disc(forward, leftward, radius[k], place_x, place_y, ray_x, ray_y, reach, distances)


def _meet_wall(
    normal_x: float,
    normal_y: float,
    offset: float,
    start: float,
    end: float,
    place_x: Floats,
    place_y: Floats,
    ray_x: Floats,
    ray_y: Floats,
    spread: float,
    reach: float,
    distances: Floats,
) -> None:
    # In the robot's frame the wall's line is where normal . p == offset; its tangent is (normal_y, -normal_x).
    rays = len(ray_x) // len(place_x)
    for i in range(len(place_x)):
        gap = offset - normal_x * place_x[i] - normal_y * place_y[i]
        if gap >= reach:
            continue
        toward_x = normal_x
        toward_y = normal_y
        if gap < 0.0:  # The sensor is beyond the line and looks back at it.
            gap = -gap
            toward_x = -normal_x
            toward_y = -normal_y
        first = i * rays
        axis = first + rays // 2
        if toward_x * ray_x[axis] + toward_y * ray_y[axis] < -spread:
            continue
        for k in range(first, first + rays):
            closing = toward_x * ray_x[k] + toward_y * ray_y[k]
            if gap < distances[k] * closing:
                distance = gap / closing
                foot_x = place_x[i] + distance * ray_x[k]
                foot_y = place_y[i] + distance * ray_y[k]
                if start <= normal_y * foot_x - normal_x * foot_y <= end:
                    distances[k] = distance


def _meet_disc(
    centre_x: float,
    centre_y: float,
    radius: float,
    place_x: Floats,
    place_y: Floats,
    ray_x: Floats,
    ray_y: Floats,
    reach: float,
    distances: Floats,
) -> None:
    rays = len(ray_x) // len(place_x)
    limit = reach + radius
    for i in range(len(place_x)):
        dx = centre_x - place_x[i]
        dy = centre_y - place_y[i]
        square = dx * dx + dy * dy
        if square >= limit * limit:
            continue
        outside = square - radius * radius
        first = i * rays
        for k in range(first, first + rays):
            closing = dx * ray_x[k] + dy * ray_y[k]
            if closing > 0.0 and closing * closing >= outside:
                # A sensor that is pressed into its neighbour by the tolerance of the contact sees it at 0.
                distance = max(closing - sqrt(closing * closing - outside), 0.0)
                if distance < distances[k]:
                    distances[k] = distance
