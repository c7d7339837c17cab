"""What the robots of a world perceive, and a digest of all that they were told.

A reading is a function of the poses and of noise that is looked up by robot, tick and sensor. A sensor asked twice in
one tick says the same and is counted once.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

from elib.base.errors import ArgumentError
from elib.simulator.physics import profiles, records
from elib.simulator.physics.defects import CAMERA_AT
from elib.simulator.physics.noise import DEFECT, MASK, STRIDE, bits, mix, quantiles, tick_key
from elib.simulator.physics.optics import Chip, lens_named
from elib.simulator.physics.sensors import chosen, sense
from elib.simulator.physics.sensors.proximity import look
from elib.simulator.physics.simulation import sense_all
from elib.simulator.physics.snapshot import Beam
from elib.simulator.physics.state import State

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elib.simulator.physics.sensors.camera import Camera, CameraScene

SENSORS = (*records.SENSORS, "picture")
"""What a digest can be asked for by name."""

HASHED = ("proximity", "ambient_light", "ground", "acceleration", "rotation")
"""Sensors of which a digest of the world holds the present readings."""


class Senses:
    """The sensors of all robots of one world."""

    def __init__(self, state: State) -> None:
        self._state = state
        self._focal = lens_named(state.scene.model.lens)
        self._camera: Camera | None = None
        self._told: dict[tuple[str, int], tuple[int, bytes]] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_camera": None}  # It holds nothing but what it can compute again.

    def reading(self, sensor: str, robot: int) -> list[Any]:
        """Return what a sensor of a robot reads, as a list of numbers."""
        numbers = self._now(sensor, robot)
        return numbers if sensor == "proximity" else self._tell(sensor, robot, numbers)

    def readings(self, sensor: str) -> NDArray[Any]:
        """Return what a sensor of every robot reads: one row a robot, or one number if the sensor has one.

        Raises:
            ArgumentError: There is no such sensor.
        """
        state = self._state
        with state.engine.threads(state.lanes):
            state.engine.ready(sense_all, threads=state.lanes)(state.world, state.lanes, chosen((sensor,)))
        return state.engine.column(records.SensorView, state.world.views, sensor).copy()

    def pictures(
        self, chip: Chip, robots: Sequence[int], shown: NDArray[np.int64], shape: tuple[Any, Any]
    ) -> NDArray[np.uint8]:
        """Return what the robots' cameras see, upright, while the robots show *shown*.

        Args:
            chip: How their chips show it.
            robots: Whose.
            shown: What each robot shows, (robots, 10).
            shape: Offsets of the columns to the right, and of the rows upwards.
        """
        from elib.simulator.physics.sensors.camera import Camera  # Worlds without pictures need no camera.

        if self._camera is None:
            self._camera = Camera(self._focal, self._state.floor, self._state.faces)
        pictures = self._camera.pictures(self._seen(shown), chip, robots, *shape)
        for robot, picture in zip(robots, pictures, strict=True):
            self._spoil(robot, picture)
            digest = hashlib.blake2b(picture.tobytes(), digest_size=4).digest()
            self._tell("picture", robot, [int.from_bytes(digest, "little")])
        return pictures

    def _spoil(self, robot: int, picture: NDArray[np.uint8]) -> None:
        """Make a picture that of a broken camera, if the robot's is; each colour of each pixel has its own noise."""
        here, tick = self._state.world.robots[robot], int(self._state.world.setting[0].tick)
        for k in range(here.defects):
            which, factor, shift, deviation = here.defect[4 * k : 4 * k + 4]
            if int(which) >> CAMERA_AT & 1:
                import numpy as np

                key = bits(tick_key(int(here.key), tick), DEFECT * (k + 1) + CAMERA_AT)
                words: Any = mix((key + np.arange(picture.size) * STRIDE) & MASK)  # type: ignore[arg-type]
                noise = deviation * np.array(quantiles())[words & 1023].reshape(picture.shape)
                picture[...] = (factor * picture + shift + noise).round().clip(0, 255)

    def _seen(self, shown: NDArray[np.int64]) -> CameraScene:
        """Return what there is to see, for the camera."""
        from elib.simulator.physics.sensors.brightness import LampArrays
        from elib.simulator.physics.sensors.camera import CameraScene, Discs, Robots, Walls

        world, column = self._state.world, self._state.engine.column
        kinds = (
            (Robots, records.Robot, world.robots),
            (Walls, records.Segment, world.walls),
            (Discs, records.Disc, world.discs),
            (LampArrays, records.Lamp, world.lamps),
        )
        parts: list[Any] = [
            made(*(column(kind, rows, name) for name in cast("Any", made)._fields)) for made, kind, rows in kinds
        ]
        if any(lamp.switch >= 0 for lamp in world.lamps):
            is_lit = [lamp.switch < 0 or bool(world.zones[lamp.switch].is_on) for lamp in world.lamps]
            parts[3] = LampArrays(*(part[is_lit] for part in parts[3]))
        setting = world.setting[0]
        spread = float(setting.spread)
        ambient, tick, noise = float(setting.ambient), int(setting.tick), float(setting.sensor_noise)
        robots, walls, discs, lights = parts
        return CameraScene(robots, walls, discs, lights, shown, ambient, tick, spread, noise)

    def beams(self, robot: int) -> tuple[Beam, ...]:
        """Return the middle ray of each infrared sensor for those who look on, without telling the robot."""
        state = self._state
        readings = self._untold("proximity", robot)
        state.engine.ready(look)(state.world, robot)
        here = state.world.robots[robot]
        scratch = state.world.scratch[here.lane]
        found = []
        for s in range(profiles.COUNT):
            (place_x, place_y), (axis_x, axis_y) = profiles.PLACES[s], profiles.AXES[s]
            ends = []
            for ahead in (0.0, float(scratch.ahead[s])):
                x, y = place_x + ahead * axis_x, place_y + ahead * axis_y
                ends.append(
                    (
                        float(here.x + here.heading_x * x - here.heading_y * y),
                        float(here.y + here.heading_y * x + here.heading_x * y),
                    )
                )
            strength = min(1.0, float(scratch.light[s]) / profiles.FULL_SCALE)
            found.append(Beam(ends[0], ends[1], strength, readings[s]))
        return tuple(found)

    def now(self, robot: int) -> bytes:
        """Return what the infrared, inertial and ground sensors of a robot read at this tick, without telling it."""
        numbers = [number for sensor in HASHED for number in self._untold(sensor, robot)]
        return struct.pack(f"<{len(numbers)}d", *numbers)

    def told(self, sensors: Sequence[str]) -> bytes:
        """Return a digest of all that the named sensors told so far.

        Raises:
            ArgumentError: There is no such sensor.
        """
        digest = hashlib.blake2b(digest_size=16)
        for sensor in sensors:
            if sensor not in SENSORS:
                raise ArgumentError(f"there is no sensor {sensor!r}", hint=f"choose from {', '.join(SENSORS)}")
        if "proximity" in sensors:
            for robot in self._state.world.robots:
                digest.update(struct.pack("<q", robot.digest))
        for (sensor, number), (_, told) in sorted(self._told.items()):
            if sensor in sensors:
                digest.update(sensor.encode() + struct.pack("<q", number) + told)
        return digest.digest()

    def forget(self) -> None:
        """Forget all that was told, for a new run."""
        self._told.clear()

    def _now(self, sensor: str, robot: int) -> list[Any]:
        state = self._state
        state.engine.ready(sense)(state.world, robot, chosen((sensor,)))
        value = getattr(state.world.views[robot], sensor)
        numbers = value.tolist() if hasattr(value, "tolist") else value
        return list(numbers) if isinstance(numbers, list) else [numbers]

    def _untold(self, sensor: str, robot: int) -> list[Any]:
        """Return what a sensor of a robot reads, but leave the digest of what the robot was told as it is."""
        here = self._state.world.robots[robot]
        seen, digest = int(here.seen), int(here.digest)
        numbers = self._now(sensor, robot)
        here.seen, here.digest = seen, digest
        return numbers

    def _tell(self, sensor: str, robot: int, values: list[Any]) -> list[Any]:
        """Count *values* as told, once a tick, and return them."""
        tick = int(self._state.world.setting[0].tick)
        last, told = self._told.get((sensor, robot), (-1, b""))
        if last != tick:
            packed = struct.pack(f"<q{len(values)}d", tick, *values)
            self._told[sensor, robot] = tick, hashlib.blake2b(told + packed, digest_size=16).digest()
        return values
