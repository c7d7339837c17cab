"""Random worlds, the same ones for each seed, and whether both engines compute the same in them.

The worlds differ in everything that a scene can say. Robots often start close to walls, to obstacles and to each other,
so that many of them touch something within a second. Only public names of ``elib.simulator.physics`` are used, and only
arithmetic that gives the same numbers on every machine.

To compare the engines in many worlds:

    python tests/physics/random_worlds.py --worlds 2000
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from random import Random

from elib.simulator.physics import (
    Batch,
    Box,
    Checkers,
    Colour,
    Controller,
    Cylinder,
    EpuckModel,
    Light,
    Patch,
    Pose,
    Print,
    Scene,
    Sound,
    Stripe,
    Wall,
    World,
)
from elib.simulator.physics.body import QUALITIES
from elib.simulator.physics.fittings import Energy, Zone
from elib.simulator.physics.placement import first_taken

RADIUS = 0.037  # m. Of a robot.
GAP = 0.001  # m. Between a start and everything else.
MAX_PAINTED = 1.0  # m2. Painting takes about 0.2 s a square metre.
PICTURE = Path(__file__).with_name("random_floor.png")
STEPS = (1 / 64, 1 / 64, 1 / 64, 1 / 32, 1 / 128, 1 / 256, 0.02, 0.05, 0.1)
COUNTS = ("proximity", "ambient_light", "ground", "microphones")
"""Sensors that read whole numbers."""

MEASURES = ("distance", "acceleration", "rotation")
"""Sensors that read real numbers."""

COLUMNS, ROWS = 32, 24
"""Size of a picture, pixels."""


def random_world(seed: int, *, pushables: bool = True) -> tuple[Scene, int]:
    """Return the scene of a seed, and how many robots drive in it.

    Args:
        seed: Seed of the draw, and of the scene's noise.
        pushables: Whether some boxes and cylinders can be pushed.
    """
    chance = Random(f"world {seed}")
    side = chance.choice((0.5, 0.8, 1.2, 3.0))
    width, depth = chance.uniform(0.7, 1.3) * side, chance.uniform(0.7, 1.3) * side
    robots = min(chance.choice((1, 1, 2, 2, 3, 4, 5, 6, 8, 12)), int(width * depth / 0.03))
    starts = _starts(chance, width, depth, robots)
    # In a large arena there is room enough to let the world choose some of the places.
    named = chance.randint(0, robots) if side > 1 else robots
    is_crowded = chance.random() < 0.5
    return Scene(
        width,
        depth,
        tuple(_walls(chance, width, depth, starts[:named], 25 if is_crowded else 6)),
        tuple(_boxes(chance, width, depth, starts[:named], pushables)),
        tuple(_cylinders(chance, width, depth, starts[:named], pushables)),
        tuple(starts[:named]),
        chance.choice(STEPS),
        seed,
        _model(chance),
        f"random world {seed}",
        tuple(_lights(chance, width, depth)),
        tuple(_sounds(chance, width, depth)),
        _colour(chance),
        _paint(chance, width, depth) if width * depth <= MAX_PAINTED and chance.random() < 0.5 else (),
    ), robots


def random_worlds(count: int, *, first: int = 0, pushables: bool = True) -> Iterator[tuple[Scene, int]]:
    """Yield the worlds of *count* seeds from *first* on, with robots of any quality, and half of them on a grey floor.

    Greys are drawn because to the ground sensors nearly all colours are white.
    """
    for seed in range(first, first + count):
        scene, robots = random_world(seed, pushables=pushables)
        chance = Random(f"robots {seed}")
        model = replace(scene.model, quality=chance.choice(tuple(QUALITIES)))
        if chance.random() < 0.5:  # spreads by the quality
            spreads = dict.fromkeys(("gain_spread", "offset_spread", "wheel_spread", "axle_spread"))
            model = replace(model, profile="measured", **spreads)
        floor = chance.choice((scene.floor, Colour(*[chance.randint(0, 255)] * 3)))
        yield replace(scene, model=model, floor=floor), robots


def random_states(count: int, *, first: int = 0) -> Iterator[tuple[Scene, int]]:
    """Yield the worlds of *count* seeds from *first* on, with zones, energy, doors, pucks, switches and pens."""
    for seed in range(first, first + count):
        scene, robots = random_world(seed)
        yield with_states(scene, Random(f"states {seed}")), robots


def with_states(scene: Scene, chance: Random) -> Scene:
    """Return *scene* with states that are drawn; most zones lie near a robot, so that it enters them soon."""
    if scene.width * scene.depth > 2 * MAX_PAINTED:  # laying out the map of zones takes long
        scene = replace(scene, width=max(scene.width / 3, 0.3), depth=max(scene.depth / 3, 0.3), starts=(), walls=())
    inside = {
        kind: [each for each in getattr(scene, kind) if 0 <= each.x <= scene.width and 0 <= each.y <= scene.depth]
        for kind in ("boxes", "cylinders")
    }
    boxes = [replace(box, name=f"box {k}") for k, box in enumerate(inside["boxes"])]
    cylinders = [replace(post, name=f"post {k}") for k, post in enumerate(inside["cylinders"])]
    keys = ["robots", *(each.name for each in (*boxes, *cylinders) if each.is_pushable)]
    zones = [_zone(chance, scene, f"zone {k}", keys) for k in range(chance.choice((1, 2, 4, 8)))]
    names = [zone.name for zone in zones]
    areas = ["", *(zone.name for zone in zones if zone.outline)]
    switched = {
        kind: tuple(replace(each, switch=chance.choice(("", *names))) for each in getattr(scene, kind))
        for kind in ("lights", "sounds")
    }
    for k, box in enumerate(boxes):
        if not box.is_pushable and chance.random() < 0.7:
            way = {"slide": (chance.uniform(-0.2, 0.2), chance.uniform(-0.2, 0.2)), "swing": chance.uniform(-2, 2)}
            kept = chance.choice((("slide",), ("swing",), ("slide", "swing")))
            takes = chance.uniform(0.1, 2)
            boxes[k] = replace(box, switch=chance.choice(names), takes=takes, **{name: way[name] for name in kept})
    for k, post in enumerate(cylinders):
        if post.is_pushable and chance.random() < 0.7:
            collect, respawn = chance.choice(("robots", *names)), chance.choice(areas)
            numbers = chance.uniform(-3, 3), chance.uniform(-1, 1)
            after = chance.choice((0.0, chance.uniform(0, 0.5)))
            cylinders[k] = replace(
                post, collect=collect, respawn=respawn, score=numbers[0], energy=numbers[1], after=after
            )
    energy = chance.choice((None, Energy(chance.uniform(0, 0.5), chance.uniform(0.1, 1), chance.uniform(0, 5))))
    energies = tuple(chance.choice((None, chance.random())) for _ in scene.starts) if energy else ()
    pens = tuple(chance.choice((None, _colour(chance))) for _ in scene.starts)
    drawn = replace(
        scene,
        boxes=tuple(boxes),
        cylinders=tuple(cylinders),
        zones=tuple(zones),
        energy=energy,
        energies=energies if any(each is not None for each in energies) else (),
        pens=pens if any(pens) else (),
        **switched,
    )
    if first_taken(drawn) is None:
        return drawn
    # A door that is open at the start stands where a robot was to begin.
    return replace(drawn, zones=tuple(replace(zone, is_on=False) for zone in zones))


def _zone(chance: Random, scene: Scene, name: str, keys: list[str]) -> Zone:
    width, depth = scene.width, scene.depth
    x, y = chance.uniform(0, width), chance.uniform(0, depth)
    if scene.starts and chance.random() < 0.7:
        start = chance.choice(scene.starts)
        x, y = start.x + chance.uniform(-0.1, 0.1), start.y + chance.uniform(-0.1, 0.1)
    near = tuple((x + chance.uniform(-0.2, 0.2), y + chance.uniform(-0.2, 0.2)) for _ in range(chance.randint(3, 6)))
    size = {"width": chance.uniform(0.02, 0.3), "depth": chance.uniform(0.02, 0.3)}
    shape: dict[str, object] = chance.choice(
        (
            {"x": x, "y": y, "radius": chance.uniform(0.01, 0.2)},
            {"x": x, "y": y, **size},
            {"points": near},
            {"points": near, "band": chance.uniform(0.01, 0.1)},
            {"x": x, "y": y, "file": str(PICTURE), **size},
            {},
        )
    )
    return Zone(
        name,
        by=chance.choice(("robots", *keys)),
        stays=chance.random() < 0.2,
        is_on=chance.random() < 0.3,
        energy=chance.choice((0.0, chance.uniform(-1, 2))),
        store=chance.choice((None, chance.uniform(0, 0.5))),
        refill=chance.choice((0.0, chance.uniform(0, 0.3))),
        score=chance.choice((0.0, 1.0)),
        rate=chance.choice((0.0, chance.uniform(-1, 1))),
        colour=_colour(chance),
        **shape,  # type: ignore[arg-type]
    )


def window(zoom: float) -> tuple[list[float], list[float]]:
    """Return the offsets of the columns and rows of a picture from the middle of the camera's chip, sensor pixels."""
    right = [(k - (COLUMNS - 1) / 2) * zoom for k in range(COLUMNS)]
    up = [((ROWS - 1) / 2 - k) * zoom for k in range(ROWS)]
    return right, up


def engines_disagree(scene: Scene, robots: int, *, ticks: int = 60, threads: tuple[int, ...] = (1, 2)) -> list[str]:
    """Return what the interpreted and the compiled engine compute differently; nothing if they agree to the last bit.

    Args:
        scene: The world.
        robots: Number of robots.
        ticks: How long they drive as Braitenberg's vehicles, in three parts with a comparison after each.
        threads: Also compare two compiled worlds that run side by side, with each of these numbers of threads.
    """
    controller = Controller.braitenberg()
    plain, compiled = (World(scene, robots=robots, engine=engine) for engine in ("interpreted", "compiled"))
    batches = [Batch(scene, 2, robots=robots, threads=number) for number in threads]
    found: list[str] = []
    for _ in range(3):
        for one in (plain, compiled):
            one.run(ticks // 3, controller)
        for batch in batches:
            batch.run(ticks // 3, controller)
        where = f"{scene.name}, tick {plain.tick}"
        found += [f"{where}: {what}" for what in _differing(plain, compiled, batches)]
    return found


def _differing(plain: World, compiled: World, batches: list[Batch]) -> Iterator[str]:
    """Yield the names of what differs now between a world of each engine, and the first worlds of batches."""
    if plain.poses != compiled.poses:
        yield "poses"
    digest = plain.hash()
    if compiled.hash() != digest:
        yield "digest"
    for batch in batches:
        if batch[0].hash() != digest:
            yield f"digest with {batch.threads} threads"
    if len({batch.hash() for batch in batches}) > 1:
        yield "digests of a batch with different numbers of threads"
    for robot in range(plain.robots):
        for sensor in COUNTS + MEASURES:
            if getattr(plain, sensor)(robot) != getattr(compiled, sensor)(robot):
                yield f"robot {robot}: {sensor}"
    view = window(8.0)
    if plain.robots and plain.picture(0, *view).tobytes() != compiled.picture(0, *view).tobytes():
        yield "robot 0: picture"


def _starts(chance: Random, width: float, depth: float, robots: int) -> list[Pose]:
    """Place robots anywhere, or in half of the worlds next to the one before."""
    is_cluster = chance.random() < 0.5
    starts: list[Pose] = []
    edge = RADIUS + GAP
    while len(starts) < robots:
        x, y = chance.uniform(edge, width - edge), chance.uniform(edge, depth - edge)
        if is_cluster and starts and chance.random() < 0.9:
            near = chance.choice(starts)
            x, y = near.x + chance.uniform(-0.12, 0.12), near.y + chance.uniform(-0.12, 0.12)
        is_inside = edge <= x <= width - edge and edge <= y <= depth - edge
        if is_inside and all(_square(x - other.x, y - other.y) > (2 * RADIUS + GAP) ** 2 for other in starts):
            starts.append(Pose(x, y, chance.uniform(-math.pi, math.pi)))
    return starts


def _walls(chance: Random, width: float, depth: float, starts: list[Pose], most: int) -> Iterator[Wall]:
    for _ in range(chance.randint(0, most)):
        x, y = _place(chance, width, depth, starts)
        longest = chance.choice((0.05, 0.2, 0.2, 1.0))
        to_x, to_y = x + chance.uniform(-longest, longest), y + chance.uniform(-longest, longest)
        wall = Wall(x, y, to_x, to_y, _height(chance), _colour(chance), _reflectance(chance))
        if all(_distance(start, wall) > RADIUS + GAP for start in starts):
            yield wall


def _boxes(chance: Random, width: float, depth: float, starts: list[Pose], pushables: bool) -> Iterator[Box]:
    for _ in range(chance.choice((0, 0, 1, 3, 6))):
        box = Box(
            *_place(chance, width, depth, starts),
            chance.uniform(0.01, 0.2),
            chance.uniform(0.01, 0.2),
            chance.choice((0.0, chance.uniform(-4, 4))),
            _height(chance),
            _colour(chance),
            _reflectance(chance),
            is_pushable=pushables and chance.random() < 0.5,
            mass=chance.uniform(0.01, 1.0),
        )
        half = max(box.width, box.depth) / 2
        is_free = all(_distance(start, side) > RADIUS + GAP for start in starts for side in box.sides)
        if is_free and all(_square(start.x - box.x, start.y - box.y) > half * half for start in starts):
            yield box


def _cylinders(chance: Random, width: float, depth: float, starts: list[Pose], pushables: bool) -> Iterator[Cylinder]:
    for _ in range(chance.choice((0, 0, 2, 4, 8))):
        cylinder = Cylinder(
            *_place(chance, width, depth, starts),
            chance.uniform(0.005, 0.1),
            _height(chance),
            _colour(chance),
            _reflectance(chance),
            is_pushable=pushables and chance.random() < 0.5,
            mass=chance.uniform(0.01, 1.0),
        )
        room = RADIUS + GAP + cylinder.radius
        if all(_square(start.x - cylinder.x, start.y - cylinder.y) > room * room for start in starts):
            yield cylinder


def _place(chance: Random, width: float, depth: float, starts: list[Pose]) -> tuple[float, float]:
    """Choose a place anywhere, or as often one near a robot."""
    if not starts or chance.random() < 0.5:
        return chance.uniform(0, width), chance.uniform(0, depth)
    start = chance.choice(starts)
    return start.x + chance.uniform(-0.15, 0.15), start.y + chance.uniform(-0.15, 0.15)


def _lights(chance: Random, width: float, depth: float) -> Iterator[Light]:
    for _ in range(chance.choice((0, 0, 1, 2, 4))):
        place = chance.uniform(0, width), chance.uniform(0, depth), chance.uniform(0.02, 0.5)
        yield Light(*place, intensity=chance.choice((0.0, 1.0, chance.uniform(0, 5))))


def _sounds(chance: Random, width: float, depth: float) -> Iterator[Sound]:
    for _ in range(chance.choice((0, 0, 1, 3))):
        yield Sound(chance.uniform(0, width), chance.uniform(0, depth), chance.choice((0.0, chance.uniform(0, 4095))))


def _paint(chance: Random, width: float, depth: float) -> tuple[Stripe | Checkers | Print | Patch, ...]:
    painted: list[Stripe | Checkers | Print | Patch] = []
    if chance.random() < 0.3:
        painted.append(Checkers(chance.uniform(0.02, 0.15), _colour(chance), _colour(chance)))
    for _ in range(chance.randint(1, 4)):
        x, y = chance.uniform(-0.1, width), chance.uniform(-0.1, depth)
        size = chance.uniform(0.02, 0.4), chance.uniform(0.02, 0.4)
        match chance.choice(("stripe", "patch", "hole", "print")):
            case "stripe":
                points = [(chance.uniform(0, width), chance.uniform(0, depth)) for _ in range(chance.randint(2, 5))]
                painted.append(Stripe(tuple(points), chance.uniform(0.005, 0.04), _colour(chance)))
            case "patch":
                painted.append(Patch(x, y, *size, _colour(chance)))
            case "hole":
                painted.append(Patch(x, y, *size))
            case _:
                painted.append(Print(str(PICTURE), x, y, *size))
    return tuple(painted)


def _model(chance: Random) -> EpuckModel:
    return EpuckModel(
        profile=chance.choice(("enki", "webots", "gctronic")),
        rays=chance.choice((1, 3, 3, 5)),
        sensor_noise=chance.choice((0.0, 1.0, chance.uniform(0, 3))),
        gain_spread=chance.choice((0.0, chance.uniform(0, 0.3))),
        offset_spread=chance.choice((0.0, chance.uniform(0, 100))),
        ambient=chance.choice((3750.0, chance.uniform(0, 4095))),
        motor_noise=chance.choice((0.0, chance.uniform(0, 0.2))),
        wheel_spread=chance.choice((0.0, chance.uniform(0, 0.03))),
        axle_spread=chance.choice((0.0, chance.uniform(0, 0.03))),
        ground_module=chance.random() < 0.5,
        generation=chance.choice((1, 2)),
        lens=chance.choice(("measured", "epucklib", "webots")),
    )


def _height(chance: Random) -> float:
    return chance.choice((0.1, chance.uniform(0.005, 0.2)))


def _colour(chance: Random) -> Colour:
    return Colour(chance.randint(0, 255), chance.randint(0, 255), chance.randint(0, 255))


def _reflectance(chance: Random) -> float | None:
    return chance.choice((None, chance.uniform(0.05, 1.0)))


def _square(dx: float, dy: float) -> float:
    return dx * dx + dy * dy


def _distance(start: Pose, wall: Wall) -> float:
    dx, dy = wall.x2 - wall.x1, wall.y2 - wall.y1
    share = ((start.x - wall.x1) * dx + (start.y - wall.y1) * dy) / max(_square(dx, dy), 1e-12)
    share = min(max(share, 0.0), 1.0)
    return math.sqrt(_square(start.x - wall.x1 - share * dx, start.y - wall.y1 - share * dy))


def main() -> None:
    """Compare the engines in as many worlds as asked for, and say where they differ."""
    parser = argparse.ArgumentParser(description="Compare both engines in random worlds, to the last bit.")
    parser.add_argument("--worlds", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first world")
    given = parser.parse_args()
    robots = differing = 0
    for scene, count in random_worlds(given.worlds, first=given.first):
        found = engines_disagree(scene, count)
        robots += count
        differing += bool(found)
        for line in found[:3]:
            print(line)
    print(f"{given.worlds} worlds, {robots} robots, 1 and 2 threads: {differing} worlds differ")
    raise SystemExit(1 if differing else 0)


if __name__ == "__main__":
    main()
