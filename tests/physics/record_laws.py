"""What the robots of 300 random worlds did and read by the physics of commit ccb7641: recording it, and comparing.

The recording is ``laws-ccb7641.npz``. To make it again, with a worktree of that commit and this script:

    git worktree add ../old ccb7641
    cp src/elib/simulator/physics/floor.py ../old/src/elib/simulator/physics  # how a floor is painted is no law
    PYTHONPATH=../old/src .venv/bin/python tests/physics/record_laws.py

Each world runs for one simulated second. Its robots get new wheel speeds a few times, in the middle of a tick too, show
lamps and play sounds. At three moments, the last of them the end of the second, all robots tell their poses and all
sensors; at the end one of them takes a small picture.

A world where rounding grows cannot be compared, so it is left out, and the world of the next seed is drawn instead:
one where the same physics, with every start moved by 1e-12 m, ends more than 1e-7 m away or fails the comparison.
"""

from __future__ import annotations

import math
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Any, TypeAlias

import numpy as np
from random_worlds import random_worlds, window

import elib
from elib.simulator.physics import Colour, Lamps, Pose, Scene, World

COMMIT = "ccb7641"
FILE = Path(__file__).with_name(f"laws-{COMMIT}.npz")
WORLDS = 300
FIRST_SEED = 1000
MOMENTS = 3
NUDGE = 1e-12  # m and rad.

PLACE_TOLERANCE = 1e-6  # m
HEADING_TOLERANCE = 1e-6  # rad. A point on the body's edge then moves by 0.04 micrometres.
DISTANCE_TOLERANCE = 1e-6  # m
# Both come from differences of poses, over a tick and over the square of a tick. Rounding of 1e-15 m gives 1e-10 m/s2
# at the shortest tick; these leave room for a place that differs by 1.5 nm there, or by 24 nm at the usual tick.
ACCELERATION_TOLERANCE = 1e-4  # m/s2
ROTATION_TOLERANCE = 1e-5  # rad/s
COUNT_TOLERANCE = 1
COUNT_SHARE = 0.01
"""Largest share of a sensor's counts that may be one apart. Rounding seldom causes that; another law does."""

PIXEL_SHARE = 0.01
"""Largest share of a picture's pixels that may differ more: a ray that meets an edge may fall to either side of it."""

PARTS = {
    "proximity": slice(0, 8),
    "ambient_light": slice(8, 16),
    "ground": slice(16, 21),
    "microphones": slice(21, 25),
}
"""Where the sensors' counts stand in a row."""

Arrays: TypeAlias = dict[str, Any]  # NumPy's arrays by name.


@dataclass(frozen=True)
class Act:
    """What is done at a time: a call of the world's method *name*, or "look" to record everything."""

    time: float
    name: str
    robot: int = 0
    arguments: tuple[Any, ...] = ()


def plan(scene: Scene, robots: int) -> list[Act]:
    """Return what is done in a world, in order."""
    chance = Random(f"acts {scene.seed}")
    acts = []
    for robot in range(robots):
        acts.append(Act(0.0, "set_speed", robot, (chance.uniform(-300, 1200), chance.uniform(-300, 1200))))
        for _ in range(chance.choice((0, 1, 1, 2, 4))):
            time = chance.uniform(0.0, 1.0)
            if chance.random() < 0.5:
                speeds = chance.uniform(-1200, 1200), chance.uniform(-1200, 1200)
                acts.append(Act(time, "set_speed", robot, chance.choice((speeds, speeds, (0.0, 0.0)))))
            else:
                acts.append(Act(time, "drive", robot, (chance.uniform(-0.14, 0.14), chance.uniform(-0.14, 0.14))))
        if chance.random() < 0.3:
            ring = tuple(Colour(chance.choice((0, 255)), chance.randint(0, 255), 0) for _ in range(8))
            lamps = Lamps(ring, chance.random() < 0.5, chance.random() < 0.5)
            acts.append(Act(chance.uniform(0.0, 1.0), "show", robot, (lamps,)))
        if chance.random() < 0.2:
            acts.append(Act(chance.uniform(0.0, 1.0), "play", robot, (chance.uniform(0, 4095),)))
        if chance.random() < 0.1:
            acts.append(Act(chance.uniform(0.0, 1.0), "set_slot", robot, (chance.uniform(0, 0.05),)))
    looks = [Act(time, "look") for time in (chance.uniform(0.1, 0.5), chance.uniform(0.5, 0.9), 1.0)]
    return sorted(acts + looks, key=lambda act: act.time)


def play(seed: int, *, nudge: float = 0.0) -> Arrays:
    """Return all that the world of *seed* shows within a second.

    Args:
        seed: Seed of the world.
        nudge: How far every robot is moved before it starts, m along both axes, and turned, rad.

    Returns:
        A row for each moment and robot: ``poses`` (x, y, heading), ``encoders``, ``touching``, ``counts`` of the
        sensors :data:`PARTS`, ``distance``, ``inertia`` (acceleration, rotation). And one ``picture``.
    """
    ((scene, robots),) = random_worlds(1, first=seed, pushables=False)
    acts = plan(scene, robots)
    world = World(scene, robots=robots)
    if nudge:
        starts = [Pose(pose.x + nudge, pose.y + nudge, pose.heading + nudge) for pose in world.poses]
        world = World(replace(scene, starts=tuple(starts)))
    rows: dict[str, list[Any]] = {
        name: [] for name in ("poses", "encoders", "touching", "counts", "distance", "inertia")
    }
    for act in acts:
        if act.name == "drive":
            drive = world.set_wheel_speeds
            drive(act.robot, *act.arguments, at=act.time)
            continue
        world.run_to(act.time)
        if act.name != "look":
            name = "set_step_rates" if act.name == "set_speed" and hasattr(world, "set_step_rates") else act.name
            getattr(world, name)(act.robot, *act.arguments)
            continue
        for robot, pose in enumerate(world.poses):
            rows["poses"].append((pose.x, pose.y, pose.heading))
            rows["encoders"].append(world.encoders(robot))
            rows["touching"].append(world.touching(robot))
            rows["counts"].append([count for sensor in PARTS for count in getattr(world, sensor)(robot)])
            rows["distance"].append(world.distance(robot))
            rows["inertia"].append((*world.acceleration(robot), world.rotation(robot)))
    chance = Random(f"picture {seed}")
    picture = world.picture(chance.randrange(robots), *window(chance.choice((4.0, 10.0, 20.0))))
    return {name: np.array(values) for name, values in rows.items()} | {"picture": picture}


def differences(recorded: Arrays, now: Arrays, seed: int) -> list[str]:
    """Return what is not equal within the tolerances, a line for each reading, which names world and sensor."""
    robots = len(recorded["poses"]) // MOMENTS
    if now["poses"].shape != recorded["poses"].shape:
        return [f"world {seed}: {len(now['poses']) // MOMENTS} robots instead of {robots}"]
    found = []
    turns = np.abs(np.remainder(now["poses"][:, 2] - recorded["poses"][:, 2] + math.pi, math.tau) - math.pi)
    gaps = np.abs(now["inertia"] - recorded["inertia"])
    off = {  # Written with "not within", so that nan is found, too.
        "place": ~(np.hypot(*(now["poses"] - recorded["poses"])[:, :2].T) <= PLACE_TOLERANCE),
        "heading": ~(turns <= HEADING_TOLERANCE),
        "encoders": np.any(now["encoders"] != recorded["encoders"], axis=1),
        "touching": now["touching"] != recorded["touching"],
        "distance": ~(np.abs(now["distance"] - recorded["distance"]) <= DISTANCE_TOLERANCE),
        "acceleration": ~np.all(gaps[:, :3] <= ACCELERATION_TOLERANCE, axis=1),
        "rotation": ~(gaps[:, 3] <= ROTATION_TOLERANCE),
    }
    shown = {"place": "poses", "heading": "poses", "acceleration": "inertia", "rotation": "inertia"}
    apart = np.abs(now["counts"].astype(int) - recorded["counts"])
    for sensor, part in PARTS.items():
        off[sensor] = np.any(apart[:, part] > COUNT_TOLERANCE, axis=1)
    for sensor, rows in off.items():
        for row in np.flatnonzero(rows):
            name = shown.get(sensor, "counts" if sensor in PARTS else sensor)
            was, is_now = recorded[name][row].tolist(), now[name][row].tolist()
            where = f"world {seed}, moment {row // robots}, robot {row % robots}"
            found.append(f"{where}: {sensor}: {name} {is_now} instead of {was}")
    pixels = np.abs(now["picture"].astype(int) - recorded["picture"]).max(axis=2) > COUNT_TOLERANCE
    if pixels.mean() > PIXEL_SHARE:
        found.append(f"world {seed}: picture: {pixels.sum()} of {pixels.size} pixels differ")
    return found


def shifted(pairs: list[tuple[Arrays, Arrays]]) -> list[str]:
    """Return the sensors of which too many counts are not equal, in pairs of what was recorded and what is now."""
    apart = np.concatenate([now["counts"] != recorded["counts"] for recorded, now in pairs])
    return [
        f"{sensor}: {100 * apart[:, part].mean():.1f} % of the counts differ"
        for sensor, part in PARTS.items()
        if apart[:, part].mean() > COUNT_SHARE
    ]


def load() -> list[tuple[int, Arrays]]:
    """Return the recording: of each world its seed and what :func:`play` returned."""
    with np.load(FILE) as file:
        arrays = {name: file[name] for name in file.files}
    seeds, robots, pictures = (arrays.pop(name) for name in ("seeds", "robots", "picture"))
    recorded = []
    first = 0
    for seed, count, picture in zip(seeds, robots, pictures, strict=True):
        end = first + count * MOMENTS
        recorded.append((int(seed), {name: array[first:end] for name, array in arrays.items()} | {"picture": picture}))
        first = end
    return recorded


def is_steady(seed: int, recorded: Arrays) -> bool:
    """Return whether a world does nearly the same when its robots start a tiny distance away."""
    for nudge in (NUDGE, -NUDGE):
        near = play(seed, nudge=nudge)
        if np.abs(near["poses"][:, :2] - recorded["poses"][:, :2]).max() > 1e-7 or differences(recorded, near, seed):
            return False
    return True


def main() -> None:
    """Record the worlds."""
    source = Path(elib.__file__).parent
    commit = subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=source, check=True, capture_output=True, text=True
    ).stdout.strip()
    changed = subprocess.run(
        ["git", "status", "--porcelain", ".", ":!*/floor.py"], cwd=source, check=True, capture_output=True
    ).stdout
    if not commit.startswith(COMMIT) or changed:
        raise SystemExit(f"{source} is {commit}, changed or not; set PYTHONPATH to the src of a clean {COMMIT}")
    kept: list[Arrays] = []
    seeds: list[int] = []
    seed = FIRST_SEED
    while len(kept) < WORLDS:
        recorded = play(seed)
        if is_steady(seed, recorded):
            kept.append(recorded)
            seeds.append(seed)
        else:
            print(f"world {seed} is left out: rounding grows in it")
        seed += 1
    types = {"encoders": "i4", "counts": "i2", "distance": "f4", "inertia": "f4"}
    together: Arrays = {
        name: np.concatenate([world[name] for world in kept]).astype(types.get(name, kept[0][name].dtype))
        for name in kept[0]
        if name != "picture"
    }
    robots = [len(world["poses"]) // MOMENTS for world in kept]
    pictures = np.array([world["picture"] for world in kept])
    np.savez_compressed(FILE, seeds=np.array(seeds), robots=np.array(robots), picture=pictures, **together)
    touched = sum(bool(world["touching"].any()) for world in kept)
    print(f"{WORLDS} worlds, {sum(robots)} robots, contacts in {touched} worlds, {FILE.stat().st_size} bytes: {FILE}")


if __name__ == "__main__":
    main()
