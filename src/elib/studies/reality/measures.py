"""How each quantity of ``measured.toml`` is measured on one robot: a function for each, or for several of a kind.

The functions know nothing of the simulator's laws. A program could do the same with a real robot, a wall, some paper
and a ruler. Each gets the bench and the name of a condition, and returns what this robot reads: a number, or one for
each sensor.
"""

from __future__ import annotations

import colorsys
import math
import re
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from elib.base.body import LENS, SENSOR_DIRECTIONS, WHEEL_CIRCUMFERENCE
from elib.link.protocol.values import locate_sound
from elib.studies.reality.bench import BLACK, BLUE, DRIVING, GREY, MEMORY, OPEN, PACKET, TURNING, WHITE, Bench, Numbers

Measure: TypeAlias = Callable[[Bench, str], Awaitable[Sequence[float] | Numbers]]
Of: TypeAlias = Literal["median", "mean", "spread"]

AROUND = 10
"""Directions from which a robot hears a sound."""

BEEP = 360.0
"""Volume of the sound at 0.1 m, counts: that of recorded beeps (measured-robots: microphones.with_ears)."""

NOTHING = 8000.0
"""mm: the distance sensor says 8190 where it sees nothing."""

BRIGHT = 235.0
"""Of 255: brighter pixels may be saturated, and have no noise."""

AXES = ("x", "y", "z"), ("red", "green", "blue")
FRONT, DIAGONAL = [0, 7], [1, 6]


@dataclass(frozen=True, slots=True)
class Way:
    """How a quantity is measured."""

    measure: Measure  # what measures one robot
    # what of all robots is compared: the median, the mean (where a robot gives a share), or the standard deviation
    of: Of


WAYS: dict[str, Way] = {}
"""The ways by the keys of their quantities."""


def way(key: str, of: Of = "median") -> Callable[[Measure], Measure]:
    """Register a function as the way to measure a quantity."""

    def register(function: Measure) -> Measure:
        WAYS[key] = Way(function, of)
        return function

    return register


def number(case: str) -> float:
    """Return the last number of a condition in m, if it is one in cm or mm: ``3 cm at 122 mm`` is 0.122."""
    found = re.findall(r"([\d.]+) (\w+)", case)[-1]
    return float(found[0]) * {"cm": 0.01, "mm": 0.001}.get(found[1], 1.0)


def colour_of(case: str) -> str:
    """Return the colour of a condition on paper: ``red #c02020``, or printed ``80 % black``."""
    if black := re.match(r"(\d+) % black", case):
        return "#" + f"{round(255 * (1 - int(black[1]) / 100)):02x}" * 3
    return case.rpartition(" ")[2]


def axis(case: str) -> int | slice:
    """Return the index of x, y, z, or of red, green, blue; all of them of another condition."""
    return next((names.index(case) for names in AXES if case in names), slice(None))


def mean(rows: Numbers) -> Numbers:
    """Return the mean of each column."""
    found: Numbers = rows.mean(axis=0)
    return found


def deviation(rows: Numbers) -> Numbers:
    """Return the standard deviation of each column."""
    found: Numbers = rows.std(axis=0, ddof=1)
    return found


async def series(bench: Bench, name: str, steps: float) -> Numbers:
    """Return :meth:`Bench.series`."""
    return await bench.series(name, steps)


async def distances(bench: Bench, distance: float) -> Numbers:
    """Return the readings of the distance sensor with a wall at *distance*, m; in mm."""
    return (await bench.near("distance", distance, 0.0, 20, 0.12))[:, 0]


async def stills(bench: Bench, colour: str) -> Numbers:
    """Return :meth:`Bench.stills`."""
    return await bench.stills(colour)


# -- series of readings: the mean, and the noise about it -----------------------------------------------------------


def mean_of(name: str, steps: float) -> Measure:
    """Return the measure of a reading's mean, of a robot that drives at *steps* per s, or stands."""

    async def measure(bench: Bench, case: str) -> Numbers:
        return mean(await bench.once(series, name, steps))

    return measure


def noise_of(name: str, steps: float) -> Measure:
    """Return the measure of a reading's standard deviation."""

    async def measure(bench: Bench, case: str) -> Numbers:
        rows = await bench.once(series, name, steps)
        return np.atleast_1d(deviation(rows)[axis(case)])

    return measure


for key, name, steps in (
    ("infrared.noise_standing", "proximity", 0.0),
    ("ground.noise_standing", "ground", 0.0),
    ("ground.noise_driving", "ground", DRIVING),
    ("accelerometer.noise_standing", "accelerometer", 0.0),
    ("accelerometer.noise_driving", "accelerometer", DRIVING),
    ("gyroscope.noise_standing", "gyroscope", 0.0),
    ("gyroscope.noise_driving", "gyroscope", DRIVING),
):
    way(key)(noise_of(name, steps))

way("microphones.floor_standing")(mean_of("microphones", 0.0))
way("microphones.floor_driving")(mean_of("microphones", DRIVING))

_open_air = mean_of("proximity", 0.0)
way("infrared.open_air")(_open_air)
way("infrared.open_air_spread", of="spread")(_open_air)


@way("ground.noise_memory")
async def _ground_memory(bench: Bench, case: str) -> Sequence[float]:
    rows = await bench.series("ground", DRIVING, count=MEMORY)
    return [float(np.corrcoef(each[1:], each[:-1])[0, 1]) for each in rows.T if each.std() > 0]


@way("accelerometer.noise_by_speed")
async def _acceleration_by_speed(bench: Bench, case: str) -> Sequence[float]:
    rows = await bench.once(series, "accelerometer", number(case))
    return [float(np.linalg.norm(rows, axis=1).std(ddof=1))]


@way("accelerometer.tilt")
async def _tilt(bench: Bench, case: str) -> Sequence[float]:
    x, y, z = (await bench.once(series, "accelerometer", 0.0)).mean(axis=0)
    return [math.degrees(math.atan2(math.hypot(x, y), z))]


@way("gyroscope.offset")
async def _rotation_offset(bench: Bench, case: str) -> Sequence[float]:
    return [float(np.linalg.norm((await bench.once(series, "gyroscope", 0.0)).mean(axis=0)))]


async def _circle(bench: Bench) -> dict[str, float]:
    """Return what a robot that turns on the spot reads of the field, microtesla."""
    x, y, z = (await bench.series("magnetometer", TURNING, is_turning=True, count=60)).T
    a, b, c = np.linalg.lstsq(np.stack([x, y, np.ones_like(x)], axis=1), x * x + y * y, rcond=None)[0]
    radius = math.sqrt(c + a * a / 4 + b * b / 4)
    scatter = float((np.hypot(x - a / 2, y - b / 2) - radius).std(ddof=3))
    return {"offset": math.hypot(a, b) / 2, "radius": radius, "noise": scatter, "upwards": abs(float(z.mean()))}


def of_field(what: str) -> Measure:
    """Return the measure of a property of the circle that the field makes in a turn."""

    async def measure(bench: Bench, case: str) -> Sequence[float]:
        return [(await bench.once(_circle))[what]]

    return measure


for what in ("offset", "radius", "noise", "upwards"):
    way(f"magnetometer.{what}")(of_field(what))


# -- infrared sensors ------------------------------------------------------------------------------------------------


async def above_open_air(bench: Bench, distance: float, bearing: float, count: int = 3) -> Numbers:
    """Return the mean infrared readings near a wall, above those in the open."""
    return mean(await bench.near("proximity", distance, bearing, count)) - await bench.once(_open_air, "")


async def _facing(bench: Bench, distance: float) -> Numbers:
    """Return what each sensor reads of a wall that it faces, above open air."""
    return np.array([(await above_open_air(bench, distance, each))[i] for i, each in enumerate(SENSOR_DIRECTIONS)])


@way("infrared.facing")
async def _facing_at(bench: Bench, case: str) -> Numbers:
    return await bench.once(_facing, number(case))


@way("infrared.touching")
async def _touching(bench: Bench, case: str) -> Numbers:
    return await bench.once(_facing, 0.0) + await bench.once(_open_air, "")


@way("infrared.gain_spread")
async def _gain_spread(bench: Bench, case: str) -> Sequence[float]:
    near = [await bench.once(_facing, distance) for distance in (0.01, 0.02)]
    return [float(np.mean([each.std() / each.mean() for each in near]))]


@way("infrared.front")
async def _front(bench: Bench, case: str) -> Numbers:
    return (await bench.once(above_open_air, number(case), 0.0))[FRONT]


@way("infrared.diagonal")
async def _diagonal(bench: Bench, case: str) -> Numbers:
    return (await bench.once(above_open_air, number(case), 0.0))[DIAGONAL]


async def _ratios(bench: Bench) -> Numbers:
    """Return readings above open air over their running median of 9, backing away from a wall."""
    rows = await bench.leaving() - await bench.once(_open_air, "")
    medians = [np.median(rows[k : k + 9], axis=0) for k in range(len(rows) - 8)]
    return rows[4:-4] / np.maximum(medians, 1.0)


def glitches(least: float, greatest: float) -> Measure:
    """Return the measure of the share of readings whose ratio to the running median lies between two."""

    async def measure(bench: Bench, case: str) -> Sequence[float]:
        sensors = FRONT if case.startswith("front") else DIAGONAL
        ratios = (await bench.once(_ratios))[:, sensors]
        return [float(((least < ratios) & (ratios < greatest)).mean())]

    return measure


way("infrared.low_glitches", of="mean")(glitches(-math.inf, 0.3))
way("infrared.high_glitches", of="mean")(glitches(1.5, math.inf))

STEP = math.radians(10)
"""Between two angles at which the robot is put to a wall."""


async def _turned(bench: Bench) -> Numbers:
    """Return what the sensors read above open air as the robot touches a wall at every angle."""
    return np.array([await above_open_air(bench, 0.0, k * STEP, 2) for k in range(round(math.tau / STEP))])


@way("infrared.angle")
async def _angle(bench: Bench, case: str) -> Sequence[float]:
    turned, aside = await bench.once(_turned), math.radians(number(case))
    places = np.arange(len(turned)) * STEP
    return [
        float(np.interp(centre + side * aside, places, each, period=math.tau))
        for each, centre in zip(turned.T, _middles(turned), strict=True)
        for side in (-1, 1)
    ]


def _middles(turned: Numbers) -> list[float]:
    """Return for each sensor the middle of the angles, rad, at which it has more than half of its most light."""
    places, fine = np.arange(len(turned)) * STEP, np.radians(np.arange(360))
    found = []
    for each in turned.T:
        seen = np.interp(fine, places, each, period=math.tau)
        found.append(float(np.angle(np.exp(1j * fine[seen > seen.max() / 2]).sum())))
    return found


@way("infrared.directions")
async def _directions(bench: Bench, case: str) -> Sequence[float]:
    middles = _middles(await bench.once(_turned))
    turn = middles[int(case.rpartition(" ")[2])] - middles[0]
    return [math.degrees(math.remainder(turn, math.tau)) - 17.0]


# -- ground sensors --------------------------------------------------------------------------------------------------


async def ground(bench: Bench, colour: str) -> Numbers:
    """Return the mean readings of the ground sensors on a colour."""
    if colour == WHITE:
        return mean(await bench.once(series, "ground", 0.0))
    await bench.stand_on(colour)
    return mean(await bench.readings("ground", 8, PACKET))


@way("ground.black")
@way("ground.black_spread", of="spread")
@way("ground.white")
@way("ground.black_tape")
async def _ground(bench: Bench, case: str) -> Numbers:
    return await bench.once(ground, colour_of(case))


@way("ground.coloured_tape")
@way("ground.dull_tape")
async def _below_white(bench: Bench, case: str) -> Numbers:
    return await bench.once(ground, WHITE) - await bench.once(ground, colour_of(case))


@way("ground.printed_grey")
async def _printed_grey(bench: Bench, case: str) -> Numbers:
    black, white = await bench.once(ground, BLACK), await bench.once(ground, WHITE)
    return (await bench.once(ground, colour_of(case)) - black) / (white - black)


# -- microphones -----------------------------------------------------------------------------------------------------


async def _heard(bench: Bench, distance: float) -> Numbers:
    """Return volumes of a sound at *distance*, m, in the shape (:data:`AROUND` directions, readings, microphones)."""
    await bench.place()
    rows = []
    for k in range(AROUND):
        bench.sound(BEEP, distance, k * math.tau / AROUND)
        await bench.robot.sleep(0.1)
        rows.append(await bench.readings("microphones", 3, PACKET))
    bench.sound(0.0)
    return np.array(rows)


@way("microphones.contrast")
@way("microphones.contrast_near")
async def _contrast(bench: Bench, case: str) -> Numbers:
    heard = (await bench.once(_heard, number(case))).mean(axis=1)
    found: Numbers = heard.max(axis=1) / np.maximum(heard.min(axis=1), 1.0)
    return found


@way("microphones.direction")
async def _direction(bench: Bench, case: str) -> Sequence[float]:
    heard = await bench.once(_heard, number(case))
    errors = [
        math.remainder(locate_sound(each.tolist()).bearing - k * math.tau / AROUND, math.tau)
        for k, readings in enumerate(heard)
        for each in readings
    ]
    return [math.degrees(math.sqrt(np.mean(np.square(errors))))]


@way("microphones.beep_to_beep")
async def _beep_to_beep(bench: Bench, case: str) -> Numbers:
    await bench.place()
    rows = []
    for _ in range(12):
        bench.sound(BEEP, number(case))
        await bench.robot.sleep(0.1)
        rows.append((await bench.readings("microphones", 1))[0])
        bench.sound(0.0)
        await bench.robot.sleep(0.1)
    return deviation(np.array(rows)) / mean(np.array(rows))


# -- camera ----------------------------------------------------------------------------------------------------------


def middle(images: Numbers) -> Numbers:
    """Return the middle of pictures, a fifth of their height wide and high."""
    rows, columns = images.shape[1:3]
    half = rows // 10
    return images[:, rows // 2 - half : rows // 2 + half, columns // 2 - half : columns // 2 + half]


@way("camera.grey_room")
async def _grey_room(bench: Bench, case: str) -> Sequence[float]:
    return [float((await bench.pictures(colour_of(case), 0.08, 0.4, 1)).mean())]


async def _hsv(bench: Bench, case: str) -> tuple[float, float, float]:
    """Return the colour of the middle of a box, each from 0 to 1."""
    box = middle(await bench.once(Bench.pictures, colour_of(case)))
    return colorsys.rgb_to_hsv(*np.median(box, axis=(0, 1, 2)) / 255)


@way("camera.bucket_saturation")
@way("camera.block_saturation")
async def _saturation(bench: Bench, case: str) -> Sequence[float]:
    return [(await _hsv(bench, case))[1]]


@way("camera.bucket_hue")
@way("camera.block_hue")
async def _hue(bench: Bench, case: str) -> Sequence[float]:
    hue = 360 * (await _hsv(bench, case))[0]
    return [math.remainder(hue, 360) if case.startswith("red") else hue]


def still_noise(colour: str) -> Measure:
    """Return the measure of the noise between still pictures, where the pixels are not saturated.

    It is the median of the pairs that follow each other: a row that is broken is no noise. How much of a small noise
    rounding leaves depends on the brightness, so of a grey wall all that is around it counts, too.
    """

    async def measure(bench: Bench, case: str) -> Sequence[float]:
        images = await bench.once(stills, colour)
        channel = (images if colour == GREY else middle(images))[..., axis(case)]
        pairs = np.diff(channel, axis=0)[:, channel.mean(axis=0) < BRIGHT]
        return [float(np.median(pairs.std(axis=1))) / math.sqrt(2)] if pairs.size else []

    return measure


way("camera.noise_epuck1")(still_noise(GREY))
way("camera.noise_epuck2")(still_noise(BLUE))


@way("camera.broken_rows", of="mean")
async def _broken_rows(bench: Bench, case: str) -> Sequence[float]:
    images = await bench.once(stills, GREY)
    rows = np.abs(images - np.median(images, axis=0)).mean(axis=(2, 3))
    return [float((rows > 12).any(axis=1).mean())]


@way("camera.white_table")
async def _white_table(bench: Bench, case: str) -> Sequence[float]:
    images = await bench.once(Bench.pictures, BLUE)
    return [float(np.median(images[:, -images.shape[1] // 8 :, :, axis(case)]))]


@way("camera.view")
async def _view(bench: Bench, case: str) -> Sequence[float]:
    width, away = 0.12, 0.25
    await bench.place()
    await bench.robot.set_camera(160, 20, zoom=4, mode="grey")  # all columns
    with bench.box(BLACK, ahead=away + LENS, width=width):
        line = np.median((await bench.robot.image()).pixels.astype(float), axis=0)
    share = int((line < (line.max() + line.min()) / 2).sum()) / len(line)
    return [math.degrees(2 * math.atan(width / (2 * share * away)))]


# -- time of flight --------------------------------------------------------------------------------------------------


async def _standing(bench: Bench, distance: float) -> Numbers:
    """Return the same of a robot that stands there: a recorded one drives by."""
    await bench.face(distance)
    return await bench.once(distances, distance)


def seen(readings: Numbers) -> Numbers:
    """Return the readings of something."""
    return readings[readings < NOTHING]


@way("time_of_flight.reading")
@way("time_of_flight.offset_spread", of="spread")
async def _distance(bench: Bench, case: str) -> Sequence[float]:
    return [float(seen(await bench.once(distances, number(case))).mean())]


@way("time_of_flight.noise")
async def _distance_noise(bench: Bench, case: str) -> Sequence[float]:
    return [float(seen(await bench.once(_standing, number(case))).std(ddof=1))]


@way("time_of_flight.nothing_seen", of="mean")
async def _nothing_seen(bench: Bench, case: str) -> Sequence[float]:
    return [float((await bench.once(_standing, number(case)) >= NOTHING).mean())]


@way("time_of_flight.period")
async def _distance_period(bench: Bench, case: str) -> Sequence[float]:
    await bench.face(number(case))
    readings = (await bench.readings("distance", 100, 0.01))[:, 0]
    changes = int((np.diff(readings) != 0).sum())
    return [10 * len(readings) / changes] if changes else []


@way("time_of_flight.narrow")
async def _narrow(bench: Bench, case: str) -> Sequence[float]:
    away = number(case)
    await bench.place()
    with bench.post(number(case.partition(" at ")[0]), ahead=away):
        await bench.robot.sleep(0.2)
        readings = await bench.readings("distance", 8, 0.12)
    return [float(np.median(readings)) / (1000 * away)]


# -- wheels and links ------------------------------------------------------------------------------------------------


@way("motion.turn")
@way("motion.turn_spread", of="spread")
async def _turn(bench: Bench, case: str) -> Sequence[float]:
    return await bench.once(_steps_of_a_turn)


async def _steps_of_a_turn(bench: Bench) -> Sequence[float]:
    await bench.place()
    before = await bench.robot.encoders()
    await bench.robot.set_speed(-0.2, 0.2)
    await bench.robot.sleep(5.0)
    await bench.robot.stop()
    await bench.robot.sleep(0.1)
    after = await bench.robot.encoders()
    turned = (bench.world.pose(0).heading - OPEN.heading) % math.tau
    return [(after.right - before.right + before.left - after.left) / 2 * math.tau / turned]


@way("motion.distance")
async def _driven(bench: Bench, case: str) -> Sequence[float]:
    await bench.place()
    speed, time = 0.3, number(case) / (0.3 * WHEEL_CIRCUMFERENCE)
    await bench.robot.set_speed(speed, speed)
    await bench.robot.sleep(time)
    await bench.robot.stop()
    await bench.robot.sleep(0.1)
    pose = bench.world.pose(0)
    return [math.hypot(pose.x - OPEN.x, pose.y - OPEN.y) / number(case)]


@way("latency.wifi_packet")
async def _packet(bench: Bench, case: str) -> Numbers:
    return 1000 * np.diff(await bench.packets())


@way("latency.wifi_picture")
async def _picture_time(bench: Bench, case: str) -> Sequence[float]:
    return [1000 * each for each in await bench.picture_times()]
