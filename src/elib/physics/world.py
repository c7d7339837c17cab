"""The world: robots that drive, touch, push and see, advanced tick by tick.

Each tick runs fixed phases over all robots in order of insertion: actuate, integrate, collide, tick. Sensing is lazy:
a reading is computed from the poses when it is asked for, and its noise is a function of the tick, so asking twice, or
not at all, changes nothing.
"""

from __future__ import annotations

import hashlib
import math
import operator
import struct
from collections.abc import Callable, Sequence
from os import PathLike
from typing import TYPE_CHECKING

from elib.body import METRES_PER_STEP
from elib.errors import ArgumentError
from elib.physics import kernels
from elib.physics import layout as lay
from elib.physics.controller import Controller
from elib.physics.engine import EngineName, engine_named
from elib.physics.fittings import Light, Sound
from elib.physics.floor import floor_of, packed
from elib.physics.motion import MAX_TRAVEL, STEPS_PER_METRE, issued
from elib.physics.moving import Mover
from elib.physics.placement import places
from elib.physics.scene import Scene, check_seed
from elib.physics.senses import Senses
from elib.physics.snapshot import Lamps, RobotView, Snapshot
from elib.physics.state import State
from elib.pose import Pose

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

DARK = Lamps()
SHOWN = 10  # Numbers a robot in what the camera gets: eight colours, body, front.


class World:
    """A run of a :class:`~elib.physics.scene.Scene`.

    The same scene, seed and drives give the same run to the last bit, on either engine.

    Attributes:
        scene: What it was made from.
        seed: Of its noise and its chosen starts.
    """

    def __init__(
        self, scene: Scene, *, robots: int | None = None, seed: int | None = None, engine: EngineName = "interpreted"
    ) -> None:
        """Set up *scene*.

        Args:
            scene: The arena and the rules.
            robots: How many; None means as many as the scene names, further ones are placed where there is
                room.
            seed: Instead of the scene's own.
            engine: ``"interpreted"``, or ``"compiled"`` with the extra ``swarm``, which is a hundred times as fast
                but takes a moment to start, and once for each machine half a minute to compile. Both give the same
                run to the last bit.

        Raises:
            ArgumentError: A number is out of its range.
            SimulationError: There is no room for so many robots, a start is not free, or Numba is not installed.
        """
        if robots is not None and robots < 0:
            raise ArgumentError(f"robots is {robots}; it must be 0 or more")
        self.scene = scene
        self.seed = scene.seed if seed is None else seed
        check_seed(self.seed)
        self._state = State(scene, places(scene, robots, self.seed), self.seed, engine_named(engine))
        self._floor = floor_of(scene)
        self._senses = Senses(self._state, self._floor)
        self._mover = Mover(self._state)
        self._settled: dict[int, list[float]] = {}
        self._lamps: dict[int, Lamps] = {}
        self._shown = self._state.engine.ints([])

    @classmethod
    def load(
        cls, name: str, *, robots: int | None = None, seed: int | None = None, engine: EngineName = "interpreted"
    ) -> World:
        """Set up a world of the gallery, or one from a file.

        Args:
            name: Of the gallery, such as ``arena``, or the path of a file ending in ``.toml``.
            robots: How many; None means as many as the file names.
            seed: Instead of the file's own.
            engine: ``"interpreted"`` or ``"compiled"``.

        Raises:
            LinkNotFound: There is no such world.
            SimulationError: The file breaks a rule; the message names the file and the key.
        """
        return cls(Scene.load(name, robots=robots), robots=robots, seed=seed, engine=engine)

    @property
    def robots(self) -> int:
        """How many there are."""
        return self._state.count

    @property
    def tick(self) -> int:
        """Whole ticks since the start."""
        return int(self._state.numbers[lay.TICK])

    @property
    def time(self) -> float:
        """Since the start, s: whole ticks."""
        return self.tick * self.scene.step

    @property
    def poses(self) -> list[Pose]:
        """Where each robot stands, in order of insertion."""
        return [self.pose(i) for i in range(self._state.count)]

    def pose(self, robot: int) -> Pose:
        """Return where one robot stands."""
        robots, r = self._state.robots, self._index(robot) * lay.ROBOT
        heading = math.atan2(robots[r + lay.HEADING_Y], robots[r + lay.HEADING_X])
        return Pose(float(robots[r + lay.X]), float(robots[r + lay.Y]), heading)

    def set_speed(self, robot: int, left: float, right: float) -> None:
        """Turn a robot's wheels as its firmware does when asked for these speeds, steps/s.

        They are clipped and become the rates its step motors can make (:func:`~elib.physics.motion.issued`).
        """
        generation = self.scene.model.generation
        for side, speed in (("left", left), ("right", right)):
            if not math.isfinite(speed):
                raise ArgumentError(f"{side} is {speed} steps/s; it must be a finite number")
        self.drive(
            robot,
            issued(max(-1e6, min(1e6, left)), generation) * METRES_PER_STEP,
            issued(max(-1e6, min(1e6, right)), generation) * METRES_PER_STEP,
        )

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
        robots, r = self._state.robots, self._index(robot) * lay.ROBOT
        if at is not None:
            self._roll_until(robot, at)
        robots[r + lay.LEFT_SPEED] = left
        robots[r + lay.RIGHT_SPEED] = right

    def settle(self, robot: int, left: float, right: float, *, at: float) -> None:
        """Let a robot's wheels stand where they are known to be.

        A step motor moves by whole steps, while a wheel here turns evenly. Where the two differ, by a step at most
        if it is done at every change of speed, what is missing is rolled within the tick: so nothing adds up.

        Args:
            robot: Index.
            left: What the nominal wheel's rim rolled since the last call, m.
            right: The same of the right wheel.
            at: Now, s since the start; the world first runs up to it.
        """
        self._roll_until(robot, at)
        robots, r = self._state.robots, self._index(robot) * lay.ROBOT
        wheels = (lay.LEFT_STEPS, lay.LEFT_TRAVEL, left), (lay.RIGHT_STEPS, lay.RIGHT_TRAVEL, right)
        rolled = [robots[r + steps] + robots[r + travel] * STEPS_PER_METRE for steps, travel, _ in wheels]
        before = self._settled.get(robot, rolled)
        self._settled[robot] = [was + way * STEPS_PER_METRE for was, (_, _, way) in zip(before, wheels, strict=True)]
        for (_, travel, _), was, now in zip(wheels, rolled, self._settled[robot], strict=True):
            robots[r + travel] += (now - was) / STEPS_PER_METRE

    def _roll_until(self, robot: int, at: float) -> None:
        """Run up to *at*, and note what the wheels roll within the tick before it."""
        self.run_to(at)
        robots, r = self._state.robots, self._index(robot) * lay.ROBOT
        covered = robots[r + lay.COVERED]
        until = min(max(at - self.time, covered), self.scene.step)
        robots[r + lay.LEFT_TRAVEL] += robots[r + lay.LEFT_SPEED] * (until - covered)
        robots[r + lay.RIGHT_TRAVEL] += robots[r + lay.RIGHT_SPEED] * (until - covered)
        robots[r + lay.COVERED] = until

    def encoders(self, robot: int) -> tuple[int, int]:
        """Return the steps issued to the left and the right wheel since the start, whether or not it could follow."""
        robots, r = self._state.robots, self._index(robot) * lay.ROBOT
        return _whole(robots[r + lay.LEFT_STEPS]), _whole(robots[r + lay.RIGHT_STEPS])

    def step(self) -> None:
        """Run one tick."""
        self._state.advance(1)

    def run(self, ticks: int, controller: Controller | None = None) -> None:
        """Run *ticks* whole ticks; with a controller every robot senses and is steered in each of them."""
        given: object = ticks
        if not isinstance(given, int) or given < 0:
            raise ArgumentError(f"ticks is {ticks}; it must be a whole number, 0 or more")
        if controller is not None and not isinstance(controller, Controller):
            raise ArgumentError(f"{controller!r} is no controller", hint="wrap a law: Controller(law, parameters)")
        if controller is None:
            self._state.advance(ticks)
        else:
            self._state.steer(ticks, controller)

    def run_to(self, time: float) -> None:
        """Run to the last whole tick at or before *time*, s since the start. Never goes back.

        Raises:
            ArgumentError: *time* is not finite.
        """
        if not math.isfinite(time):
            raise ArgumentError(f"the time to run to is {time}; it must be a finite number of seconds")
        step, tick = self.scene.step, self.tick
        ticks = max(int(time / step) - tick - 1, 0)
        while (tick + ticks + 1) * step <= time:
            ticks += 1
        if ticks:
            self._state.advance(ticks)

    def stepper(self) -> Callable[[float, float], Sequence[int]]:
        """Return the fastest way to steer the first robot from Python.

        The function takes the speeds of its wheels, steps/s as asked of the firmware, runs a tick, and returns its
        eight infrared readings after it, counts.
        """
        self._index(0)
        state = self._state
        turn = state.engine.bare(kernels.turn)

        def step(left: float, right: float) -> Sequence[int]:
            near: Sequence[int] = turn(left, right, *state.solid, state.lamps, state.scratch)
            return near if near[0] >= 0 or not state.make_room() else self.proximity(0)

        return step

    def proximity(self, robot: int) -> list[int]:
        """Return the reflected light of the eight infrared sensors, counts, 0..4095, higher is nearer."""
        return self._senses.proximity(self._index(robot))

    def ambient_light(self, robot: int) -> list[int]:
        """Return the infrared sensors' readings with emitters off, counts, 0..4095, higher is darker."""
        return self._senses.ambient_light(self._index(robot))

    def distance(self, robot: int) -> float:
        """Return what the time-of-flight sensor measures before its bias, m, at most its reach of 2 m."""
        return self._senses.distance(self._index(robot))

    def ground(self, robot: int) -> list[int]:
        """Return the ground sensors left, centre, right and the cliff sensors left, right, counts, 0..1000."""
        return self._senses.ground(self._index(robot))

    def microphones(self, robot: int) -> list[int]:
        """Return the microphones right, left, rear, front, counts peak to peak, 0..4095."""
        return self._senses.microphones(self._index(robot))

    def acceleration(self, robot: int) -> list[float]:
        """Return the acceleration forward, to the left and upwards, m/s2; (0, 0, 9.81) at rest."""
        return self._senses.acceleration(self._index(robot))

    def rotation(self, robot: int) -> float:
        """Return the rate of turn about the upright axis, rad/s, positive to the left."""
        return self._senses.rotation(self._index(robot))

    def picture(self, robot: int, right: Sequence[float], up: Sequence[float]) -> NDArray[np.uint8]:
        """Return what the robot's camera sees, upright.

        Args:
            robot: Index.
            right: Offset of each column's centre to the right of the optical axis, sensor pixels.
            up: Offset of each row's centre above it, sensor pixels.

        Returns:
            Red, green, blue, 0..255, in the shape (rows, columns, 3).
        """
        return self._senses.picture(self._index(robot), self._shown, right, up)

    def touching(self, robot: int) -> bool:
        """Return whether the robot was in contact with anything in the last tick."""
        return bool(self._state.robots[self._index(robot) * lay.ROBOT + lay.AWAKE] > 0.0)

    def show(self, robot: int, lamps: Lamps) -> None:
        """Set what a robot shows."""
        self._lamps[self._index(robot)] = lamps
        if not len(self._shown):
            self._shown = self._state.engine.ints([0] * (SHOWN * self._state.count))
        first = SHOWN * robot
        for k, colour in enumerate(lamps.ring):
            self._shown[first + k] = packed(colour)
        self._shown[first + 8], self._shown[first + 9] = int(lamps.body), int(lamps.front)

    def play(self, robot: int, volume: float) -> None:
        """Let a robot sound, so loud that a microphone at 0.1 m reads *volume* counts; 0 is silence."""
        if not 0.0 <= volume <= 4095.0:
            raise ArgumentError(f"volume is {volume}; it must be from 0 to 4095")
        self._state.robots[self._index(robot) * lay.ROBOT + lay.VOLUME] = volume

    def set_slot(self, robot: int, seconds: float) -> None:
        """Set the time between the samplings of two pairs of a robot's infrared sensors, 0..0.1 s."""
        if not 0.0 <= seconds <= 0.1:
            raise ArgumentError(f"the slot is {seconds} s; it must be from 0 to 0.1")
        self._state.robots[self._index(robot) * lay.ROBOT + lay.SLOT] = seconds
        self._state.forget()

    def move_robot(self, robot: int, pose: Pose) -> None:
        """Put a robot somewhere else; its wheels go on turning.

        Raises:
            ArgumentError: There is no such robot, or no room for it.
        """
        self._mover.robot(robot, pose)

    def move_box(self, box: int, pose: Pose) -> None:
        """Put a box somewhere else, counted as in the scene.

        Raises:
            ArgumentError: There is no such box, or a robot or the edge is in the way.
        """
        self._mover.box(box, pose)

    def move_cylinder(self, cylinder: int, x: float, y: float) -> None:
        """Put a cylinder somewhere else, counted as in the scene.

        Raises:
            ArgumentError: There is no such cylinder, or a robot or the edge is in the way.
        """
        self._mover.cylinder(cylinder, x, y)

    def set_light(self, index: int, light: Light) -> None:
        """Replace a lamp, counted as in the scene."""
        self._state.lights[_checked(index, len(self._state.lights), "light")] = light
        self._state.relight()

    def set_sound(self, index: int, sound: Sound) -> None:
        """Replace a source of sound, counted as in the scene."""
        self._state.sounds[_checked(index, len(self._state.sounds), "sound")] = sound
        self._state.relight()

    @property
    def ambient(self) -> float:
        """What an infrared sensor reads in the room's own light, counts."""
        return float(self._state.fixed[lay.ROOM])

    def set_ambient(self, counts: float) -> None:
        """Set what an infrared sensor reads in the room's own light, 0..4095 counts, higher is darker."""
        if not 0.0 <= counts <= 4095.0:
            raise ArgumentError(f"the room's light is {counts} counts; it must be from 0 to 4095")
        self._state.fixed[lay.ROOM] = counts
        self._state.forget()

    def snapshot(self, *, beams: bool = False) -> Snapshot:
        """Return the world as it is now, frozen.

        Args:
            beams: Also cast each robot's infrared sensors.
        """
        scene, state = self.scene, self._state
        robots = tuple(
            RobotView(
                self.pose(i),
                float(state.robots[i * lay.ROBOT + lay.RADIUS]),
                self.touching(i),
                self._lamps.get(i, DARK),
                self._senses.beams(i) if beams else (),
            )
            for i in range(state.count)
        )
        return Snapshot(
            scene.name,
            self.tick,
            self.time,
            scene.width,
            scene.depth,
            scene.walls,
            tuple(state.box(k) for k in range(len(state.boxes))),
            tuple(state.cylinder(k) for k in range(len(state.cylinders))),
            robots,
            tuple(state.lights),
            tuple(state.sounds),
            self._floor,
        )

    def draw(
        self,
        path: str | PathLike[str] | None = None,
        *,
        trails: Sequence[Sequence[Pose]] = (),
        beams: bool = True,
        caption: str | None = None,
        size: int = 900,
    ) -> str | None:
        """Draw the world from above, as SVG or PNG.

        Args:
            path: File to write, ending in ``.svg`` or ``.png``; None returns SVG text instead.
            trails: Where each robot was, oldest first, in the order of the robots; pale is old.
            beams: Show the infrared sensors.
            caption: Line below the picture; None makes one, "" leaves it empty.
            size: Pixels of the arena's longer side, 200..8000.

        Raises:
            ArgumentError: *path* ends in something else, *size* is out of its range, or there can be no such file.
            ElibError: The disk is full.
        """
        from importlib.metadata import entry_points  # What draws is above the physics, and found by name.

        (top,) = entry_points(group="elib.drawings", name="top")
        drawn: str | None = top.load()(self.snapshot(beams=beams), path, trails=trails, caption=caption, size=size)
        return drawn

    def _repr_svg_(self) -> str | None:
        """Show the world in a notebook."""
        return self.draw(size=450)

    def hash(self, *sensors: str) -> str:
        """Return a digest of the run: equal runs have equal digests, whichever sensors were read and by whomever.

        It covers the tick, every pose to the last bit, the encoders, and what the infrared, inertial and ground
        sensors read now.

        Args:
            sensors: Cover also everything that these sensors told since the start, such as ``"proximity"``: then the
                digest depends on when they were asked.
        """
        digest = hashlib.blake2b(struct.pack("<q", self.tick), digest_size=16)
        state = self._state
        for i in range(state.count):
            r = i * lay.ROBOT
            digest.update(struct.pack("<4d2q", *(state.robots[r + k] for k in range(4)), *self.encoders(i)))
            digest.update(self._senses.now(i))
        for b in range(0, len(state.bodies), lay.BODY):
            digest.update(struct.pack("<4d", *(state.bodies[b + k] for k in range(4))))
        digest.update(self._senses.told(sensors))
        return digest.hexdigest()

    def _index(self, robot: int) -> int:
        return _checked(robot, self._state.count, "robot")


def _checked(index: int, count: int, what: str) -> int:
    try:
        index = operator.index(index)
    except TypeError:
        raise ArgumentError(f"the {what} is {index!r}; it must be a whole number, counted from 0") from None
    if not 0 <= index < count:
        raise ArgumentError(f"there is no {what} {index}; the world has {count}, counted from 0")
    return index


def _whole(steps: float) -> int:
    """Return whole steps: rounded to the nearest thousandth first, since a sum of many parts falls just short."""
    return math.floor(steps + 1e-6)
