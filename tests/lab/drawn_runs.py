"""Runs of robots drawn at random, and goals for them: on the edges of zones, at exact bounds, of one tick, of many."""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

Place = tuple[float, float, float]
"""x and y, m, and heading, rad."""

COMMANDS = ("proximity", "set_speed", "image", "encoders")


@dataclass
class DrawnRun:
    """What happened in a run, in plain values: the meaning of each is that of the same field of a trace."""

    step: float
    poses: list[list[Place]]
    touching: list[set[int]]
    lit: list[list[int]]
    speeds: list[tuple[float, float]]
    boxes: list[tuple[str, float, float]]
    cylinders: list[tuple[str, float, float]]
    zones: dict[str, tuple[float, float, float, float, float]]
    stripes: list[list[tuple[float, float]]]
    requests: Counter[str]
    output: str
    time: float
    has_ended: bool
    exit_code: int | None
    goals: list[tuple[str, dict[str, object]]] = field(default_factory=list)


def drawn_run(seed: int) -> DrawnRun:
    """Return a run and about forty goals for it; the same seed gives the same."""
    rng = random.Random(seed)
    robots = rng.choice((1, 1, 2, 3, 5))
    ticks = rng.choice((1, 2, 3, rng.randrange(4, 40), rng.randrange(40, 160)))
    zones = {name: _zone(rng) for name in ("a", "b", "c")}
    paths = [_path(rng, ticks, zones) for _ in range(robots)]
    ended = rng.random() < 0.7
    run = DrawnRun(
        step=rng.choice((1 / 64, 1 / 50, 0.1)),
        poses=[list(row) for row in zip(*paths, strict=True)],
        touching=_touching(rng, robots, ticks),
        lit=[[rng.choice((0, 1, 17, 255, rng.randrange(256))) for _ in range(robots)] for _ in range(ticks)],
        speeds=[rng.choice(((0.0, 0.0), (0.05, -0.0004), (0.0, 0.1))) for _ in range(robots)],
        boxes=[("crate", *_spot(rng, zones)), ("", *_spot(rng, zones))],
        cylinders=[("ball", *_spot(rng, zones))],
        zones=zones,
        stripes=[_stripe(rng) for _ in range(2)],
        requests=Counter({name: rng.randrange(1, 20) for name in COMMANDS if rng.random() < 0.6}),
        output=rng.choice(("", "\n", "far\n12 cm\n", "done", "x" * 100)),
        time=rng.choice((0.0, 1.5, round(rng.uniform(0, 20), 3))),
        has_ended=ended,
        exit_code=rng.choice((0, 0, 1, -9)) if ended else None,
    )
    run.goals = _goals(rng, run)
    return run


def _zone(rng: random.Random) -> tuple[float, float, float, float, float]:
    x, y = (rng.choice((0.5, 0.25, rng.uniform(0, 1))) for _ in range(2))
    radius = rng.choice((0.05, 0.25, rng.uniform(0.01, 0.4)))
    return (x, y, radius, 0.0, 0.0) if rng.random() < 0.6 else (x, y, 0.0, radius, rng.choice((0.1, 0.5, 2 * radius)))


def _spot(rng: random.Random, zones: dict[str, tuple[float, float, float, float, float]]) -> tuple[float, float]:
    """Return a place: anywhere, in a zone, or on the edge of one, as well as floats can say."""
    x, y, radius, width, depth = rng.choice(list(zones.values()))
    match rng.randrange(5):
        case 0:
            return rng.uniform(0, 1), rng.uniform(0, 1)
        case 1:
            return x + rng.gauss(0, 0.05), y + rng.gauss(0, 0.05)
        case 2:
            return x + rng.choice((-1, 1)) * (radius or width / 2), y + rng.uniform(-1, 1) * depth / 2
        case _:
            angle, reach = rng.uniform(-math.pi, math.pi), radius or min(width, depth) / 2
            return x + reach * math.cos(angle), y + reach * math.sin(angle)


def _path(rng: random.Random, ticks: int, zones: dict[str, tuple[float, float, float, float, float]]) -> list[Place]:
    x, y = _spot(rng, zones)
    heading = rng.choice((0.0, math.pi, -math.pi, math.pi / 2, rng.uniform(-math.pi, math.pi)))
    path, jumps = [], rng.choice((0.0, 0.1, 0.6))
    while len(path) < ticks:
        way, turn = rng.choice((0.0, 0.002, 0.02)), rng.choice((0.0, 0.05, -0.3, math.pi))
        for _ in range(rng.randrange(1, 30)):
            path.append((x, y, heading))
            if rng.random() < jumps:
                x, y = _spot(rng, zones)
            x, y = x + way * math.cos(heading), y + way * math.sin(heading)
            heading = math.remainder(heading + turn, math.tau)
    return path[:ticks]


def _touching(rng: random.Random, robots: int, ticks: int) -> list[set[int]]:
    often = rng.choice((0.0, 0.0, 0.02, 0.3))
    return [{robot for robot in range(robots) if rng.random() < often} for _ in range(ticks)]


def _stripe(rng: random.Random) -> list[tuple[float, float]]:
    points = [(rng.uniform(0, 1), rng.uniform(0, 1)) for _ in range(rng.choice((2, 3, 6)))]
    return [*points, points[-1]] if rng.random() < 0.2 else points


def _goals(rng: random.Random, run: DrawnRun) -> list[tuple[str, dict[str, object]]]:
    """Return goals of every kind; many of their bounds are met exactly."""
    ends, starts, ticks = run.poses[-1], run.poses[0], len(run.poses)

    def hold() -> float:
        return rng.choice((0.0, 0.0, run.step, rng.randrange(ticks + 1) * run.step, rng.uniform(0, 3)))

    def stretch() -> dict[str, object]:
        return {"hold": hold(), "at_end": rng.random() < 0.4}

    def some(least: int = 1) -> tuple[str, ...]:
        return tuple(rng.choices("abc", k=rng.randrange(least, 4)))

    def angle() -> float:
        return rng.choice((0.0, math.pi, rng.uniform(-math.pi, math.pi), rng.choice(ends)[2] + 0.1))

    def apart(row: Sequence[Place]) -> float:
        (x, y, _), (u, v, _) = rng.choice(row), rng.choice(row)
        return math.hypot(x - u, y - v)

    x, y = rng.uniform(0, 1), rng.uniform(0, 1)
    robot = rng.randrange(len(ends))
    away = math.hypot(ends[robot][0] - x, ends[robot][1] - y)
    length = math.fsum(math.dist(a[robot][:2], b[robot][:2]) for a, b in zip(run.poses, run.poses[1:], strict=False))
    turned = math.fsum(
        math.remainder(b[robot][2] - a[robot][2], math.tau) for a, b in zip(run.poses, run.poses[1:], strict=False)
    )
    one = {"robot": robot + 1}
    shift = ends[robot][0] - starts[robot][0]
    goals: list[tuple[str, dict[str, object]]] = [
        *(("reach", {"zone": rng.choice("abc"), **stretch(), **rng.choice(({}, one))}) for _ in range(4)),
        *(("visit", {"zones": some(), "ordered": rng.random() < 0.5, **rng.choice(({}, one))}) for _ in range(3)),
        *(("keep-out", {"zones": some(), **rng.choice(({}, one))}) for _ in range(2)),
        ("no-contact", {}),
        ("no-contact", {"most": rng.choice((run.step, rng.randrange(9) * run.step, 0.5)), **one}),
        ("distance", {"least": length, **one}),
        ("distance", {"least": rng.choice((0.0, 0.5)), "most": rng.choice((None, length, 1.0)), **one}),
        ("distance", {"most": rng.uniform(0, 3)}),
        ("turned", {"least": turned, **one}),
        ("turned", {"least": rng.uniform(-9, 9), "most": rng.choice((None, turned, 3.0))}),
        ("pose", {"x": x, "y": y, "within": away, **one}),
        ("pose", {"x": x, "y": y, "within": rng.uniform(0, 1), "heading": angle()}),
        ("pose", {"heading": angle(), "tolerance": rng.choice((0.1, math.pi, rng.uniform(0, 3))), **one}),
        ("moved", {"ahead": shift, "within": rng.choice((0.0, 0.01, 0.3)), **one}),
        ("moved", {"ahead": rng.uniform(-1, 1), "left": rng.uniform(-1, 1), "within": rng.uniform(0, 2)}),
        ("moved", {"within": 9.0, "turn": angle(), "tolerance": rng.uniform(0, 3), **one}),
        ("time", {"most": rng.choice((run.time, rng.uniform(0, 20)))}),
        *(
            (
                "follow-line",
                {
                    "within": rng.choice((0.02, 0.3, rng.uniform(0, 1))),
                    "share": rng.choice((0.0, 0.5, 1.0, rng.uniform(0, 1))),
                    "after": rng.choice((0.0, 0.0, 0.5, hold())),
                    "covered": rng.choice((0.0, 0.1, rng.uniform(0, 1))),
                    "stripe": rng.choice((1, 2)),
                    **rng.choice(({}, one)),
                },
            )
            for _ in range(3)
        ),
        ("requests", {"least": rng.randrange(40), "most": rng.choice((None, 30, 50))}),
        ("requests", {"command": rng.choice(COMMANDS), "least": rng.randrange(3), "most": rng.choice((None, 1, 9))}),
        ("stands", {}),
        ("stands", one),
        ("survives", {}),
        ("lit", {"leds": rng.choice(((0,), (0, 4), (7,))), "times": rng.choice((1, 1, 2, 9)), **rng.choice(({}, one))}),
        ("says", {"text": rng.choice(("^[0-9]+ cm$", "done", "x+"))}),
        ("push", {"thing": rng.choice(("crate", "ball")), "zone": rng.choice("abc")}),
        ("push", {"thing": "crate", "zone": rng.choice("abc")}),
        *(("all-in-zone", {"zone": rng.choice("abc"), "count": rng.choice((None, 1, 2)), **stretch()}) for _ in "12"),
        *(("gathered", {"within": rng.choice((apart(ends), rng.uniform(0, 1))), **stretch()}) for _ in "12"),
        *(("spread", {"least": rng.choice((apart(ends), rng.uniform(0, 1))), **stretch()}) for _ in "12"),
    ]
    for number, (_, keys) in enumerate(goals):
        keys["name"] = str(number)
        if rng.random() < 0.15:
            keys["needs"] = tuple(str(rng.randrange(len(goals))) for _ in "12")
    return goals
