"""Lengths of a robot's infrared rays at many poses, computed by the simulator's own raycast."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from elib.base.infrared import SPACING
from elib.simulator.physics import Pose, Scene
from elib.simulator.physics.engine import engine_named
from elib.simulator.physics.floor import floor_of
from elib.simulator.physics.geometry import unit
from elib.simulator.physics.neighbours import is_stale
from elib.simulator.physics.profiles import COUNT, SHARES, Profile, profile
from elib.simulator.physics.raycast import cast, see_near
from elib.simulator.physics.sensors.proximity import aim
from elib.simulator.physics.spawning import stand
from elib.simulator.physics.state import State
from elib.studies.series import Numbers


def depths(scene: Scene, poses: Numbers, reach: float) -> tuple[Numbers, Numbers]:
    """Return the depth of each ray, as the response curve needs it, and the weights of the rays.

    The depth is the length along the sensor's axis divided by the reflectance of the surface, as in the simulator.
    Obstacles are where the scene puts them; there are no other robots.

    Args:
        scene: Scene with walls, boxes and cylinders.
        poses: x (m), y (m) and heading (rad) in each row.
        reach: Depth of a ray that hits nothing, m.

    Returns:
        Depths, m, of the shape (poses, sensors, rays), and the weights of the rays, which add up to 1.
    """
    state = _alone_in(scene, reach)
    shares = SHARES[scene.model.rays]
    found = np.full((len(poses), COUNT, len(shares)), reach)
    for row, (x, y, heading) in zip(found, poses.tolist(), strict=True):
        stand(state.world.robots[0], x, y, *unit(heading))
        if is_stale(state.world):
            state.list_near()
        _look(state, row)
    return np.minimum(found, reach), np.array([share for _, share in shares])


@lru_cache(maxsize=1)
def _alone_in(scene: Scene, reach: float) -> State:
    """Return the state of *scene* with one robot, whose rays reach *reach*, m."""
    nothing = (0.0,) * (round(reach / SPACING) + 1)
    aperture = profile(scene.model.profile).aperture
    model = replace(scene.model, profile=Profile("depths", nothing, nothing, "", aperture))
    return State(replace(scene, model=model), [Pose(0.0, 0.0)], 0, engine_named("interpreted"), floor_of(scene))


def _look(state: State, row: Numbers) -> None:
    """Write the depths, m, of those rays of the robot that may hit something into *row*."""
    world = state.world
    scratch = see_near(world, 0)
    aim(world.setting[0], world.robots[0], scratch)
    for k in range(world.setting[0].infrared_fans):
        fan = world.fans[k]
        cast(world, scratch, COUNT, fan)
        for s in range(COUNT):
            if scratch.ahead[s] < fan.reach:
                row[s, 0] = scratch.ahead[s] * scratch.absorbs_ahead[s]
            if row.shape[1] > 1 and scratch.left[s] < fan.reach:
                row[s, 2 * k + 1] = scratch.left[s] * scratch.absorbs_left[s] * fan.cosine
            if row.shape[1] > 1 and scratch.right[s] < fan.reach:
                row[s, 2 * k + 2] = scratch.right[s] * scratch.absorbs_right[s] * fan.cosine
