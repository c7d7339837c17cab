"""The world: robots that drive, touch and see, advanced tick by tick.

Each tick runs fixed phases over all robots in order of insertion: actuate, integrate, collide, sense, tick.
Sensing is lazy: a reading is computed from the poses when it is asked for, and its noise is a function of
the tick, so asking twice, or not at all, changes nothing.
"""

from __future__ import annotations

import hashlib
import math
import struct
from typing import TYPE_CHECKING

from elib.errors import ArgumentError
from elib.physics.body import AXLE, RADIUS, SENSOR_RADIUS
from elib.physics.geometry import Pose, unit
from elib.physics.kernels import actuate, collide, disturb, integrate
from elib.physics.noise import AXLE_LENGTH, GAIN, WHEEL, gauss, robot_key, tick_key
from elib.physics.placement import places
from elib.physics.scene import Scene, check_seed, flat_discs, flat_walls
from elib.physics.sensors import distance, proximity
from elib.physics.sensors.fan import Fan
from elib.physics.sensors.rays import cast
from elib.physics.snapshot import Beam, Lamps, RobotView, Snapshot

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from elib.physics.sensors.camera import Camera

MAX_TRAVEL = 0.02
"""Furthest a wheel may roll in one tick, m: half a radius, so nothing can be passed through."""


class World:
    """A run of a :class:`~elib.physics.scene.Scene`.

    The same scene, seed and drives give the same run to the last bit.

    Attributes:
        scene: What it was made from.
        seed: Of its noise and its chosen starts.
        tick: Whole ticks since the start.
    """

    def __init__(self, scene: Scene, *, robots: int | None = None, seed: int | None = None) -> None:
        """Set up *scene*.

        Args:
            scene: The arena and the rules.
            robots: How many; None means as many as the scene names, further ones are placed where there is
                room.
            seed: Instead of the scene's own.

        Raises:
            ArgumentError: A number is out of its range.
            SimulationError: There is no room for so many robots, or a start is not free.
        """
        if robots is not None and robots < 0:
            raise ArgumentError(f"robots is {robots}; it must be 0 or more")
        self.scene = scene
        self.seed = scene.seed if seed is None else seed
        check_seed(self.seed)
        self.tick = 0
        starts = places(scene, robots, self.seed)
        count = len(starts)
        model = scene.model
        self._keys = [robot_key(self.seed, i) for i in range(count)]
        self._x = [start.x for start in starts]
        self._y = [start.y for start in starts]
        headings = [unit(start.heading) for start in starts]
        self._heading_x = [cosine for cosine, _ in headings]
        self._heading_y = [sine for _, sine in headings]
        self._radius = [RADIUS] * count
        self._touching = [0] * count
        self._left_speed = [0.0] * count
        self._right_speed = [0.0] * count
        self._left_travel = [0.0] * count
        self._right_travel = [0.0] * count
        self._covered = [0.0] * count
        self._left_scale = [1.0 + model.wheel_spread * gauss(key, WHEEL) for key in self._keys]
        self._right_scale = [1.0 + model.wheel_spread * gauss(key, WHEEL + 1) for key in self._keys]
        self._axle = [AXLE * (1.0 + model.axle_spread * gauss(key, AXLE_LENGTH)) for key in self._keys]
        self._lamps = [Lamps()] * count

        self._obstacles = flat_walls(scene.surfaces)
        self._walls = flat_walls(scene.edge) + self._obstacles
        self._discs = flat_discs(scene.cylinders)

        profile = proximity.profile(model.profile)
        self._counts, self._deviation = list(profile.counts), list(profile.deviation)
        self._reach = profile.reach
        self._distances = [0.0] * (proximity.COUNT * proximity.RAYS)
        self._gain = [
            [1.0 + model.gain_spread * gauss(key, GAIN + i) for i in range(proximity.COUNT)] for key in self._keys
        ]
        self._camera: Camera | None = None

    @classmethod
    def load(cls, name: str, *, robots: int | None = None, seed: int | None = None) -> World:
        """Set up a world of the gallery, or one from a file.

        Args:
            name: Of the gallery, such as ``arena``, or the path of a file ending in ``.toml``.
            robots: How many; None means as many as the file names.
            seed: Instead of the file's own.

        Raises:
            LinkNotFound: There is no such world.
            SimulationError: The file breaks a rule; the message names the file and the key.
        """
        from elib.physics.worldfile import load  # Only worlds from files need the reader.

        return cls(load(name), robots=robots, seed=seed)

    @property
    def robots(self) -> int:
        """How many there are."""
        return len(self._x)

    @property
    def time(self) -> float:
        """Since the start, s: whole ticks."""
        return self.tick * self.scene.step

    @property
    def poses(self) -> list[Pose]:
        """Where each robot stands, in order of insertion."""
        return [self.pose(i) for i in range(len(self._x))]

    def pose(self, robot: int) -> Pose:
        """Return where one robot stands."""
        heading = math.atan2(self._heading_y[robot], self._heading_x[robot])
        return Pose(self._x[robot], self._y[robot], heading)

    def drive(self, robot: int, left: float, right: float, *, at: float | None = None) -> None:
        """Turn a robot's wheels at these speeds until told otherwise.

        Nothing is lost when it happens within a tick: what the old speeds rolled until then is added to
        what the new ones roll after it.

        Args:
            robot: Index.
            left: Speed of the nominal wheel's rim, m/s, positive forward.
            right: The same of the right wheel.
            at: When, s since the start; the world first runs up to it. A time already past, and None, mean
                now.

        Raises:
            ArgumentError: A wheel would roll more than :data:`MAX_TRAVEL` in a tick, or *at* is not finite.
        """
        step = self.scene.step
        for side, speed in (("left", left), ("right", right)):
            if not abs(speed) * step <= MAX_TRAVEL:
                raise ArgumentError(
                    f"{side} is {speed} m/s; in a step of {step} s it must stay within {MAX_TRAVEL / step} m/s",
                    hint="an e-puck drives 0.13 m/s; a shorter step allows more",
                )
        if at is not None:
            self.run_to(at)
            until = min(max(at - self.time, self._covered[robot]), step)
            self._left_travel[robot] += self._left_speed[robot] * (until - self._covered[robot])
            self._right_travel[robot] += self._right_speed[robot] * (until - self._covered[robot])
            self._covered[robot] = until
        self._left_speed[robot] = left
        self._right_speed[robot] = right

    def run_to(self, time: float) -> None:
        """Run to the last whole tick at or before *time*, s since the start. Never goes back.

        Raises:
            ArgumentError: *time* is not finite.
        """
        if not math.isfinite(time):
            raise ArgumentError(f"the time to run to is {time}; it must be a finite number of seconds")
        while (self.tick + 1) * self.scene.step <= time:
            self.step()

    def run(self, ticks: int) -> None:
        """Run *ticks* whole ticks."""
        for _ in range(ticks):
            self.step()

    def step(self) -> None:
        """Run one tick."""
        left, right = self._left_travel, self._right_travel
        actuate(self.scene.step, self._left_speed, self._right_speed, left, right, self._covered)
        if self.scene.model.motor_noise > 0.0:
            keys = [tick_key(key, self.tick) for key in self._keys]
            disturb(keys, self.scene.model.motor_noise, left, right)
        integrate(
            self._x,
            self._y,
            self._heading_x,
            self._heading_y,
            left,
            right,
            self._left_scale,
            self._right_scale,
            self._axle,
        )
        collide(
            self._x,
            self._y,
            self._radius,
            self._touching,
            self.scene.width,
            self.scene.depth,
            self._obstacles,
            self._discs,
        )
        self.tick += 1

    def proximity(self, robot: int) -> list[int]:
        """Return the reflected light of the eight infrared sensors, counts, 0..4095, higher is nearer."""
        return self._reflect(robot, self.scene.model.sensor_noise)

    def ambient_light(self, robot: int) -> list[int]:
        """Return the infrared sensors' readings with emitters off, counts, 0..4095, higher is darker."""
        key = tick_key(self._keys[robot], self.tick)
        model = self.scene.model
        return [proximity.darkness(key, i, model.sensor_noise, model.ambient) for i in range(proximity.COUNT)]

    def distance(self, robot: int) -> float:
        """Return the true distance ahead of the time-of-flight sensor, m, at most its reach of 2 m."""
        distances = [0.0]
        self._cast(robot, distance.FAN, distance.REACH, distances)
        return distances[0]

    def touching(self, robot: int) -> bool:
        """Return whether the robot was in contact with anything in the last tick."""
        return bool(self._touching[robot])

    def show(self, robot: int, lamps: Lamps) -> None:
        """Set what a robot shows."""
        self._lamps[robot] = lamps

    def picture(self, robot: int, right: Sequence[float], up: Sequence[float]) -> NDArray[np.uint8]:
        """Return what the robot's camera sees, upright; the first picture loads numpy.

        Args:
            robot: Index.
            right: Offset of each column's centre to the right of the optical axis, sensor pixels.
            up: Offset of each row's centre above it, sensor pixels.

        Returns:
            Red, green, blue, 0..255, in the shape (rows, columns, 3).
        """
        if self._camera is None:
            from elib.physics.sensors.camera import Camera  # Worlds without pictures need no numpy.

            self._camera = Camera(self.scene)
        others = [(self.pose(i), self._radius[i]) for i in range(len(self._x)) if i != robot]
        return self._camera.picture(self.pose(robot), others, right, up)

    def snapshot(self, *, beams: bool = False) -> Snapshot:
        """Return the world as it is now, frozen.

        Args:
            beams: Also cast each robot's infrared sensors.
        """
        scene = self.scene
        robots = tuple(
            RobotView(
                self.pose(i),
                self._radius[i],
                self.touching(i),
                self._lamps[i],
                self._beams(i) if beams else (),
            )
            for i in range(len(self._x))
        )
        return Snapshot(
            scene.name,
            self.tick,
            self.time,
            scene.width,
            scene.depth,
            scene.walls,
            scene.boxes,
            scene.cylinders,
            robots,
        )

    def hash(self) -> str:
        """Return a digest of the tick and every pose to the last bit: equal runs have equal digests."""
        digest = hashlib.blake2b(struct.pack("<q", self.tick), digest_size=16)
        for numbers in (self._x, self._y, self._heading_x, self._heading_y):
            digest.update(struct.pack(f"<{len(numbers)}d", *numbers))
        return digest.hexdigest()

    def _cast(self, robot: int, fan: Fan, reach: float, distances: list[float]) -> None:
        cast(
            robot,
            self._x,
            self._y,
            self._heading_x[robot],
            self._heading_y[robot],
            self._radius,
            self._walls,
            self._discs,
            fan.place_x,
            fan.place_y,
            fan.ray_x,
            fan.ray_y,
            fan.spread,
            reach,
            SENSOR_RADIUS,
            distances,
        )

    def _reflect(self, robot: int, noise: float) -> list[int]:
        values = [0] * proximity.COUNT
        self._cast(robot, proximity.FAN, self._reach, self._distances)
        proximity.reflect(
            tick_key(self._keys[robot], self.tick),
            self._distances,
            self._reach,
            self._counts,
            self._deviation,
            self._gain[robot],
            noise,
            self.scene.model.ambient,
            values,
        )
        return values

    def _beams(self, robot: int) -> tuple[Beam, ...]:
        values = self._reflect(robot, 0.0)
        x, y = self._x[robot], self._y[robot]
        cosine, sine = self._heading_x[robot], self._heading_y[robot]
        found = []
        for i, value in enumerate(values):
            fan, k = proximity.FAN, i * proximity.RAYS + proximity.RAYS // 2
            ahead, left = fan.place_x[i], fan.place_y[i]
            far_ahead = ahead + self._distances[k] * fan.ray_x[k]
            far_left = left + self._distances[k] * fan.ray_y[k]
            found.append(
                Beam(
                    (x + cosine * ahead - sine * left, y + sine * ahead + cosine * left),
                    (x + cosine * far_ahead - sine * far_left, y + sine * far_ahead + cosine * far_left),
                    value / proximity.FULL_SCALE,
                )
            )
        return tuple(found)
