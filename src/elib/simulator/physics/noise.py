"""Noise that is looked up, not drawn: a pure function of seed, robot, tick and channel.

So a reading depends neither on threads nor on which sensors were read before nor on how many robots there
are beside. All integers stay below 2**63 before they are masked to 32 bits, so Python and compiled code
agree to the last bit.
"""

from __future__ import annotations

from statistics import NormalDist
from typing import Final

from elib.simulator.physics.engine import kernel

MASK: Final = 0xFFFFFFFF
STRIDE: Final = 0x9E3779B1  # A prime near 2**32 / golden ratio: spreads neighbouring channels over all bits.
SPREAD: Final = 147.80054127099805  # sqrt(4 * (256**2 - 1) / 12): deviation of a sum of four bytes.

# Channels of one robot in one tick. Each sensor owns a block, so a new one disturbs no old one.
MOTOR: Final = 0  # 0 left, 1 right
PROXIMITY: Final = 16  # +0..7
AMBIENT: Final = 32  # +0..7
DISTANCE: Final = 48
MICROPHONE: Final = 56  # +0..3
GROUND: Final = 64  # +0..4
ACCELEROMETER: Final = 72  # +0..2
GYROSCOPE: Final = 80  # 0 forward axis, 1 leftward axis, 2 upright axis
GLITCH: Final = 88  # +0..7
MAGNETOMETER: Final = 100  # +0..2
MOTOR_SOUND: Final = 104
NO_ECHO: Final = 108
PICTURE: Final = 112  # +0..1: whether a row of it is broken, and which.
PIXELS: Final = 114  # Where the noise of a picture's pixels begins.

DEFECT: Final = -64  # +0..38: below 0, because the noise of pixels has no end.

# Channels of one robot for good; they are keyed without a tick.
GAIN: Final = 0  # +0..7
OFFSETS: Final = 8  # +0..7
WHEEL: Final = 16  # 0 left, 1 right
AXLE_LENGTH: Final = 18
PLACE: Final = 32
BOARD_PHASE: Final = 40
GROUND_BLACK: Final = 48  # +0..4
GROUND_BLACKS: Final = 53  # Shared by the five.
GROUND_WHITE: Final = 56  # +0..4
MICROPHONE_GAIN: Final = 64  # +0..3
TILT: Final = 72  # 0 forward, 1 to the left
GYROSCOPE_OFFSET: Final = 76  # +0..2
DISTANCE_OFFSET: Final = 80
CAMERA: Final = 84  # 0 red, 1 green, 2 blue
HARD_IRON: Final = 88  # +0..2
LOUDNESS: Final = 92
SATURATION: Final = 96  # +0..7
BROKEN: Final = 104  # 0 whether something is broken, 1 what
SAMPLES_OF_SOUND: Final = 1024  # + the number of the source; 0 is the room.
PAIR: Final = 4096  # + the number of another robot: a key of the messages from it.


@kernel
def mix(word: int) -> int:
    """Return *word*, 32 bits, scrambled one to one.

    The constants are hash-prospector's best of two rounds, both below 2**31.
    """
    word = ((word ^ (word >> 16)) * 0x21F0AAAD) & MASK
    word = ((word ^ (word >> 15)) * 0x735A2D97) & MASK
    return word ^ (word >> 15)


def seed_key(seed: int) -> int:
    """Return 32 bits made of a 64-bit *seed*."""
    return mix(mix(seed & MASK) ^ ((seed >> 32) & MASK))


@kernel
def numbered_key(key: int, robot: int) -> int:
    """Return the key of one robot's noise, 32 bits, from that of the seed."""
    return mix((key + (robot + 1) * STRIDE) & MASK)


def robot_key(seed: int, robot: int) -> int:
    """Return the key of one robot's noise, 32 bits, from a 64-bit *seed*."""
    return numbered_key(seed_key(seed), robot)


@kernel
def tick_key(robot: int, tick: int) -> int:
    """Return the key of one tick's noise, 32 bits, from a robot's key.

    It repeats after 2**32 ticks: two years.
    """
    # Scrambling the tick first keeps the sequences of two robots from being shifted copies of each other.
    return mix(robot ^ mix((tick * STRIDE + 1) & MASK))


@kernel
def bits(key: int, channel: int) -> int:
    """Return 32 random bits of *channel*."""
    return mix((key + channel * STRIDE) & MASK)


@kernel
def uniform(key: int, channel: int) -> float:
    """Return a number evenly spread over 0 <= u < 1."""
    return bits(key, channel) / 4294967296.0


@kernel
def gauss(key: int, channel: int) -> float:
    """Return a number of mean 0 and deviation 1, near normal: the sum of four bytes, so never beyond 3.46."""
    word = bits(key, channel)
    pairs = (word & 0xFF00FF) + ((word >> 8) & 0xFF00FF)
    return ((pairs & 0xFFFF) + (pairs >> 16) - 510) / SPREAD


@kernel
def spread_between(spread: float, given: float, typical: float) -> float:
    """Return how much something differs between robots.

    Args:
        spread: Factor on what typical robots have.
        given: What the world says itself, or below 0.
        typical: What typical robots have.
    """
    return given if given >= 0.0 else spread * typical


def quantiles() -> list[float]:
    """Return 1024 equally likely values of a normal distribution, mean 0 and deviation 1, in rising order.

    Looked up with ten bits each: three from one word, where :func:`gauss` needs a word each. They are rounded, so
    that they do not depend on the last bit of a machine's logarithm.
    """
    normal = NormalDist()
    values = [normal.inv_cdf((k + 0.5) / 1024) for k in range(512, 1024)]
    scale = (2 * sum(value * value for value in values) / 1024) ** -0.5
    upper = [round(value * scale, 12) for value in values]
    return [-value for value in reversed(upper)] + upper
