"""What the microphones' converter samples: the waveforms of all sounds, in counts.

How loud a source is at a microphone is the law of :mod:`elib.simulator.physics.sensors.microphones`. A tone is a sine
wave that travels at the speed of sound; a source without a tone, and the room, are white noise.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from elib.base.body import MICROPHONE_RATE
from elib.simulator.physics.defects import MICROPHONES_AT, left_of
from elib.simulator.physics.noise import MASK, SAMPLES_OF_SOUND, STRIDE, mix
from elib.simulator.physics.sensors import microphones

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elib.simulator.physics.state import State

SPEED_OF_SOUND: Final = 343.0
"""m/s, in air of 20 degrees C."""


def waveform(state: State, i: int, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return samples of robot *i*'s microphones, counts around 0.

    Args:
        state: The world; its sources and robots are taken to be where they are now.
        i: Index of the robot.
        numbers: Which samples, counted from the start: one row a microphone, right, left, rear, front.
    """
    import numpy as np

    world = state.world
    robot, times = world.robots[i], numbers / MICROPHONE_RATE
    total = microphones.FLOOR / 2 * world.setting[0].sensor_noise * _noise(robot.key, 0, numbers)
    now = world.setting[0].tick * world.setting[0].step
    sources: list[tuple[Any, float, float]] = [(a, a.every, a.lasts) for a in state.switched(state.sounds)]
    sources += [(each, 0.0, 0.0) for each in world.robots if now < each.silent_from]
    for number, (source, every, lasts) in enumerate(sources, 1):
        if source.volume <= 0.0:
            continue
        sounding = np.ones(numbers.shape) if every <= 0.0 else times % every < lasts
        for s in range(len(numbers)):
            x, y, facing_x, facing_y = microphones.placed(robot, s)
            part = microphones.share(source.x - x, source.y - y, facing_x, facing_y)
            sent = times[s] - math.hypot(source.x - x, source.y - y) / SPEED_OF_SOUND
            tone = np.sin(math.tau * source.frequency * sent)
            wave = tone if source.frequency > 0.0 else _noise(robot.key, number, numbers[s])
            total[s] += source.volume * part / 2 * wave * sounding[s]
    for s in range(len(numbers)):
        total[s] *= left_of(robot, MICROPHONES_AT + s)
    return total


def _noise(key: int, source: int, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return evenly spread numbers from -1 to 1, each made of a sample's number and its source."""
    words: NDArray[np.int64] = mix(mix((int(key) + (SAMPLES_OF_SOUND + source) * STRIDE) & MASK) ^ (numbers & MASK))  # type: ignore[assignment,arg-type]
    return words / (MASK / 2) - 1.0
