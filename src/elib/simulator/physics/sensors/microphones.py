"""The microphones: how loud each hears the sounds of the world.

A source of volume V, in counts peak to peak at 0.1 m, at distance r from a microphone and under the angle a from the
direction in which the microphone faces, adds

    V (0.1 m / r) (1 + 0.12 cos a) / 1.12

to the noise of the room. The pressure of a point source falls with 1/r; the body shades the far side a little
(measured-robots: microphones.with_ears, microphones.bare_turning; from 0 to 0.45 fits one of them). Peaks add up: tones
of different pitch meet peak on peak within the 6 to 10 ms over which the robots look for their maximum and minimum.
Walls neither stop nor reflect sound. In real robots the microphones are not equally loud, and they hear the motors.

No loudness of an e-puck's own speaker was ever published (e-puck.md, 7). The e-puck1 has three microphones, right, left
and rear; the longest delays its demo allows, 6 samples at 33 kHz from left to right and 5 to the rear, fit the places
of the e-puck2's.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.base.body import MICROPHONES
from elib.simulator.physics.defects import MICROPHONES_AT, spoiled
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import LOUDNESS, MICROPHONE, MICROPHONE_GAIN, MOTOR_SOUND, gauss, tick_key
from elib.simulator.physics.records import Records, Robot

COUNT: Final = 4

PLACE_X: Final = tuple(x for x, _ in MICROPHONES)
PLACE_Y: Final = tuple(y for _, y in MICROPHONES)
"""Right, left, rear, front, m."""

_LENGTHS = [sqrt(x * x + y * y) for x, y in zip(PLACE_X, PLACE_Y, strict=True)]
FACING_X: Final = tuple(x / length for x, length in zip(PLACE_X, _LENGTHS, strict=True))
FACING_Y: Final = tuple(y / length for y, length in zip(PLACE_Y, _LENGTHS, strict=True))
"""Each faces away from the middle of the robot."""

SHADE: Final = 0.12
"""Part by which a microphone that faces a source hears more than one in its shade, each against one beside it
(measured-robots: microphones.with_ears)."""

FLOOR: Final = 4.0
"""Noise of a quiet room, counts peak to peak (measured-robots: microphones.quiet)."""

FLOOR_SPREAD: Final = 2.0
"""Spread between robots of that (measured-robots: microphones.quiet: one robot 3.8, another 7.5)."""

MOTORS: Final = 3.7
MOTORS_SWING: Final = 2.3
"""What a driving robot hears of its motors, counts: a part that is always there, and the mean of one that comes and
goes, in all microphones at once (measured-robots: microphones.quiet: 5 to 28 counts, median 9, mean 10.1)."""

GAIN: Final = 0.08
"""Spread between microphones of how loud they hear (measured-robots: microphones.with_ears)."""

REFERENCE: Final = 0.1  # m. Where volumes are given.

NEAREST: Final = 0.01
"""No source comes nearer to a microphone, m: it has a size."""

FLOOR_DEVIATION: Final = 2.0
"""Noise of a reading in a quiet room, counts (measured-robots: microphones.quiet, 1.4 to 2.6)."""

RELATIVE_DEVIATION: Final = 0.05
"""Noise of a reading, as a part of what is heard (measured-robots: microphones.with_ears, from beep to beep)."""


@kernel
def read(world: Records, i: int) -> None:
    """Read the microphones of robot *i*: right, left, rear, front, counts peak to peak, 0..4095.

    counts = 4 + sum of V (0.1 m / r) (1 + 0.12 cos a) / 1.12 over the world's sounds and all robots that play. The
    loudspeaker is in the middle of a robot; its own is heard by every microphone from behind.
    """
    robot = world.robots[i]
    key = tick_key(robot.key, world.setting[0].tick)
    now = world.setting[0].tick * world.setting[0].step
    noise = world.setting[0].sensor_noise
    spread = world.setting[0].spread
    floor = FLOOR
    if spread > 0.0:
        floor += spread * FLOOR_SPREAD * gauss(robot.key, LOUDNESS)
        if robot.left_speed != 0.0 or robot.right_speed != 0.0:
            swing = gauss(key, MOTOR_SOUND)
            floor += spread * (MOTORS + MOTORS_SWING * swing * swing)
    for s in range(COUNT):
        place_x, place_y, facing_x, facing_y = placed(robot, s)
        heard = 0.0
        for k in range(len(world.tones)):
            tone = world.tones[k]
            if (tone.switch < 0 or world.zones[tone.switch].is_on) and sounds(tone.every, tone.lasts, now):
                heard += tone.volume * share(tone.x - place_x, tone.y - place_y, facing_x, facing_y)
        for k in range(len(world.robots)):
            other = world.robots[k]
            if other.volume > 0.0 and now < other.silent_from:
                heard += other.volume * share(other.x - place_x, other.y - place_y, facing_x, facing_y)
        if spread > 0.0 and heard > 0.0:
            heard *= max(1.0 + spread * GAIN * gauss(robot.key, MICROPHONE_GAIN + s), 0.0)
        level = floor + heard
        if noise > 0.0:
            level += noise * (FLOOR_DEVIATION + RELATIVE_DEVIATION * heard) * gauss(key, MICROPHONE + s)
        level = spoiled(world.setting[0], robot, MICROPHONES_AT + s, level)
        world.views[i].microphones[s] = int(min(max(level, 0.0), 4095.0) + 0.5)


@kernel
def placed(robot: Robot, s: int) -> tuple[float, float, float, float]:
    """Return where microphone *s* of a robot is, m, and the unit vector in which it faces."""
    return (
        robot.x + PLACE_X[s] * robot.heading_x - PLACE_Y[s] * robot.heading_y,
        robot.y + PLACE_X[s] * robot.heading_y + PLACE_Y[s] * robot.heading_x,
        FACING_X[s] * robot.heading_x - FACING_Y[s] * robot.heading_y,
        FACING_X[s] * robot.heading_y + FACING_Y[s] * robot.heading_x,
    )


@kernel
def sounds(every: float, lasts: float, now: float) -> bool:
    """Return whether a source sounds *now*, s, that begins again after *every* s and then *lasts* so long."""
    return every <= 0.0 or now - every * int(now / every) < lasts


@kernel
def share(dx: float, dy: float, facing_x: float, facing_y: float) -> float:
    """Return what part of a source's volume is heard of it, from a microphone to (dx, dy), m, away."""
    distance = sqrt(dx * dx + dy * dy)
    if distance < NEAREST:
        return REFERENCE / NEAREST
    return REFERENCE / distance * (1.0 + SHADE * (dx * facing_x + dy * facing_y) / distance) / (1.0 + SHADE)
