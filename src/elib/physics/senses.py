"""What the robots of a world perceive, and a digest of all that they were told.

A reading is a function of the poses and of noise that is looked up by robot, tick and sensor. A sensor asked twice in
one tick says the same and is counted once.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

from elib.errors import ArgumentError
from elib.physics import layout as at
from elib.physics.floor import Floor
from elib.physics.layout import Ints
from elib.physics.sensors import distance, ground, inertia, infrared, light, proximity, sound
from elib.physics.sensors.optics import lens_named
from elib.physics.sensors.rays import ABSORBS, HITS
from elib.physics.snapshot import Beam
from elib.physics.state import State

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elib.physics.sensors.camera import Camera

Number = TypeVar("Number", int, float)

SENSORS = (
    "proximity",
    "ambient_light",
    "distance",
    "ground",
    "microphones",
    "acceleration",
    "rotation",
    "picture",
)
"""What a digest can be asked for by name."""


@lru_cache(maxsize=8)
def paint_of(ints: Callable[[Sequence[int]], Ints], floor: Floor) -> Ints:
    """Return the floor's picture as the engine takes it: one for all worlds that have the same floor."""
    return ints(floor.pixels)


class Senses:
    """The sensors of all robots of one world."""

    def __init__(self, state: State, floor: Floor) -> None:
        self._state = state
        self._floor = floor
        self._paint = paint_of(state.engine.ints, floor)
        self._lens = lens_named(state.scene.model.lens)
        self._ready = state.engine.ready
        self._eye = state.engine.floats(distance.eye())
        self._whole, self._parts = state.engine.ints([0] * 8), state.engine.floats([0.0] * 3)
        self._camera: Camera | None = None
        self._told: dict[tuple[str, int], tuple[int, bytes]] = {}
        self._look = state.engine.bare(infrared.look)

    def proximity(self, robot: int) -> list[int]:
        """Return the reflected light of the eight infrared sensors, counts, 0..4095, higher is nearer."""
        state = self._state
        state.sense(robot)
        first = at.HEAD + robot * at.NUMBER + at.READINGS
        return [int(state.numbers[k]) for k in range(first, first + proximity.COUNT)]

    def ambient_light(self, robot: int) -> list[int]:
        """Return the infrared sensors' readings with emitters off, counts, 0..4095, higher is darker."""
        return self._tell("ambient_light", robot, self._ambient_light(robot))

    def distance(self, robot: int) -> float:
        """Return what the time-of-flight sensor measures before its bias, m, at most its reach of 2 m."""
        state = self._state
        length = self._ready(distance.measure)(
            robot, state.fixed, state.robots, state.walls, state.discs, state.numbers, self._eye, state.scratch
        )
        return self._tell("distance", robot, [float(length)])[0]

    def ground(self, robot: int) -> list[int]:
        """Return the ground sensors left, centre, right and the cliff sensors left, right, counts, 0..1000."""
        return self._tell("ground", robot, self._ground(robot))

    def microphones(self, robot: int) -> list[int]:
        """Return the microphones right, left, rear, front, counts peak to peak, 0..4095."""
        state, values = self._state, self._whole
        self._ready(sound.listen)(robot, state.fixed, state.robots, state.tones, state.numbers, values)
        return self._tell("microphones", robot, [int(values[k]) for k in range(sound.COUNT)])

    def acceleration(self, robot: int) -> list[float]:
        """Return the acceleration forward, to the left and upwards, m/s2; (0, 0, 9.81) at rest."""
        return self._tell("acceleration", robot, self._acceleration(robot))

    def rotation(self, robot: int) -> float:
        """Return the rate of turn about the upright axis, rad/s, positive to the left."""
        return self._tell("rotation", robot, [self._rotation(robot)])[0]

    def _ambient_light(self, robot: int) -> list[int]:
        state, values = self._state, self._whole
        self._ready(light.ambient)(
            robot,
            state.fixed,
            state.robots,
            state.walls,
            state.discs,
            state.lamps,
            state.numbers,
            state.scratch,
            values,
        )
        return [int(values[k]) for k in range(proximity.COUNT)]

    def _ground(self, robot: int) -> list[int]:
        state, floor, values = self._state, self._floor, self._whole
        self._ready(ground.look_down)(
            robot,
            state.fixed,
            state.robots,
            state.numbers,
            floor.colour,
            floor.columns,
            floor.rows,
            floor.scale,
            self._paint,
            values,
        )
        return [int(values[k]) for k in range(ground.COUNT)]

    def _acceleration(self, robot: int) -> list[float]:
        state, values = self._state, self._parts
        self._ready(inertia.accelerate)(robot, state.fixed, state.robots, state.numbers, values)
        return [float(values[k]) for k in range(3)]

    def _rotation(self, robot: int) -> float:
        state = self._state
        return float(self._ready(inertia.turn_rate)(robot, state.fixed, state.robots, state.numbers))

    def picture(self, robot: int, shown: Ints, right: Sequence[float], up: Sequence[float]) -> NDArray[np.uint8]:
        """Return what the robot's camera sees, upright, while the robots show *shown*."""
        if self._camera is None:
            from elib.physics.sensors.camera import Camera  # Worlds without pictures need no camera.

            self._camera = Camera(self._state.scene, self._state.engine, self._floor, lens=self._lens)
        state = self._state
        pixels = self._camera.picture(
            robot,
            state.robots,
            state.walls,
            state.discs,
            shown,
            state.lamps,
            float(state.fixed[at.ROOM]),
            right,
            up,
        )
        self._tell("picture", robot, [self._camera.digest])
        return pixels

    def beams(self, robot: int) -> tuple[Beam, ...]:
        """Return the middle ray of each infrared sensor as a drawing shows it: without noise, and told to nobody."""
        state = self._state
        self._look(robot, *state.solid, state.scratch)
        r = robot * at.ROBOT
        x, y = state.robots[r + at.X], state.robots[r + at.Y]
        cosine, sine = state.robots[r + at.HEADING_X], state.robots[r + at.HEADING_Y]
        found = []
        for i in range(proximity.COUNT):
            place_x, place_y, axis_x, axis_y = (
                state.fixed[part + i] for part in (at.PLACE_X, at.PLACE_Y, at.AXIS_X, at.AXIS_Y)
            )
            length, absorbs = state.profile.reach, 1.0
            if state.scratch[HITS + i] > 0.0:
                length, absorbs = state.scratch[i], state.scratch[ABSORBS + i]
            entry = min(int(length * (absorbs if length < state.profile.reach else 1.0) / proximity.SPACING), 10**6)
            counts = state.profile.counts[min(entry, len(state.profile.counts) - 1)]
            far_x, far_y = place_x + length * axis_x, place_y + length * axis_y
            found.append(
                Beam(
                    (float(x + cosine * place_x - sine * place_y), float(y + sine * place_x + cosine * place_y)),
                    (float(x + cosine * far_x - sine * far_y), float(y + sine * far_x + cosine * far_y)),
                    min(1.0, float(counts) / proximity.FULL_SCALE),
                )
            )
        return tuple(found)

    def now(self, robot: int) -> bytes:
        """Return what the infrared, inertial and ground sensors of a robot read at this tick, without telling it."""
        state, n = self._state, at.HEAD + robot * at.NUMBER
        seen, digest = state.numbers[n + at.SEEN], state.numbers[n + at.DIGEST]
        state.sense(robot)
        near = [int(state.numbers[n + at.READINGS + k]) for k in range(proximity.COUNT)]
        state.numbers[n + at.SEEN], state.numbers[n + at.DIGEST] = seen, digest
        whole = [*near, *self._ambient_light(robot), *self._ground(robot)]
        return struct.pack(f"<{len(whole)}q4d", *whole, *self._acceleration(robot), self._rotation(robot))

    def told(self, sensors: Sequence[str]) -> bytes:
        """Return a digest of all that the named sensors told so far.

        Raises:
            ArgumentError: There is no such sensor.
        """
        digest = hashlib.blake2b(digest_size=16)
        state = self._state
        for sensor in sensors:
            if sensor not in SENSORS:
                raise ArgumentError(f"there is no sensor {sensor!r}", hint=f"choose from {', '.join(SENSORS)}")
        if "proximity" in sensors:
            for i in range(state.count):
                digest.update(struct.pack("<q", state.numbers[at.HEAD + i * at.NUMBER + at.DIGEST]))
        for (sensor, robot), (_, told) in sorted(self._told.items()):
            if sensor in sensors:
                digest.update(sensor.encode() + struct.pack("<q", robot) + told)
        return digest.digest()

    def _tell(self, sensor: str, robot: int, values: list[Number]) -> list[Number]:
        """Count *values* as told, once a tick, and return them."""
        tick = int(self._state.numbers[at.TICK])
        last, told = self._told.get((sensor, robot), (-1, b""))
        if last != tick:
            packed = struct.pack(f"<q{len(values)}d", tick, *values)
            self._told[sensor, robot] = tick, hashlib.blake2b(told + packed, digest_size=16).digest()
        return values
