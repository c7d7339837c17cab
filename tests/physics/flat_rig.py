"""A scene laid out flat, on which kernels are called directly, interpreted or compiled."""

from functools import lru_cache

import pytest

from elib.physics import Scene
from elib.physics import layout as at
from elib.physics.engine import engine_named
from elib.physics.floor import floor_of
from elib.physics.sensors import distance
from elib.physics.state import State

painted = lru_cache(maxsize=8)(floor_of)


class Flat:
    """Everything that a sensor's kernel may ask for; robots have stood still so far."""

    def __init__(self, scene: Scene, seed: int = 0, engine: str = "interpreted") -> None:
        if engine == "compiled":
            pytest.importorskip("numba")
        self.engine = engine_named(engine)
        state = State(scene, scene.starts, seed, self.engine)
        self.fixed, self.robots, self.numbers, self.scratch = state.fixed, state.robots, state.numbers, state.scratch
        self.walls, self.discs, self.lights, self.sounds = state.walls, state.discs, state.lamps, state.tones
        self.eye = self.engine.floats(distance.eye())
        self.floor = painted(scene)
        self.pixels = self.engine.ints(self.floor.pixels)

    def call(self, kernel, *arguments):
        """Run a kernel as the engine does."""
        return self.engine.ready(kernel)(*arguments)

    def numbers_out(self, count):
        return self.engine.ints([0] * count)

    def floats_out(self, count):
        return self.engine.floats([0.0] * count)

    def at_tick(self, tick):
        self.numbers[at.TICK] = tick
        return self

    def set(self, robot, **fields):
        """Set fields of a robot's record by their names in the layout."""
        for name, value in fields.items():
            self.robots[robot * at.ROBOT + getattr(at, name)] = value


flat_of = lru_cache(maxsize=64)(Flat)
"""One for each scene: for tests that change nothing but the tick, or what they set anew each time."""
