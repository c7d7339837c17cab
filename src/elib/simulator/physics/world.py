"""The world: robots that drive, touch, push and see, advanced tick by tick.

Each tick runs fixed phases over all robots in order of insertion: actuate, integrate, collide, tick. Sensing is lazy:
a reading is computed from the poses when it is asked for, and its noise is a function of the tick, so asking twice, or
not at all, changes nothing.
"""

from __future__ import annotations

import contextlib
import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import fields
from operator import attrgetter
from typing import Any

from elib.base.body import METRES_PER_STEP, step_rate
from elib.base.errors import ArgumentError
from elib.base.pose import Pose
from elib.base.rules import Number, Whole, is_number, nearest, rule_of, shown
from elib.simulator.physics.body import EpuckModel
from elib.simulator.physics.controller import Controller
from elib.simulator.physics.defects import Defect, damage, pace
from elib.simulator.physics.engine import INTERPRETED, EngineName, engine_named, explained
from elib.simulator.physics.fittings import Light, Sound
from elib.simulator.physics.floor import floor_of, packed
from elib.simulator.physics.geometry import Box, Colour, Wall
from elib.simulator.physics.motion import MAX_TRAVEL, STEPS_PER_METRE
from elib.simulator.physics.moving import Mover
from elib.simulator.physics.placement import places
from elib.simulator.physics.rangebearing import RangeAndBearing
from elib.simulator.physics.records import MAX_DEFECTS, Robot
from elib.simulator.physics.scene import Scene, check_scene, check_seed
from elib.simulator.physics.senses import Senses
from elib.simulator.physics.sensors import chosen
from elib.simulator.physics.simulation import law_of, steer
from elib.simulator.physics.snapshot import Lamps
from elib.simulator.physics.state import Moment, State
from elib.simulator.physics.worldreading import ReadableWorld, checked

WANTED = Number(unit="steps/s")

_FIRM = attrgetter(*(each.name for each in fields(Scene) if each.name not in ("walls", "boxes")))
"""What no hand changes of a scene."""


class World(ReadableWorld):
    """A run of a :class:`~elib.simulator.physics.scene.Scene`.

    The same scene, seed and drives give the same run to the last bit, on either engine.

    Attributes:
        seed: The seed of its noise and its chosen starts.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        robots: int | None = None,
        seed: int | None = None,
        engine: EngineName = "interpreted",
        threads: int = 1,
    ) -> None:
        """Set up *scene*.

        Args:
            scene: The arena and the rules.
            robots: How many; None means as many as the scene names, further ones are placed where there is
                room.
            seed: Instead of the scene's own.
            engine: ``"interpreted"``, or ``"compiled"`` with the extra ``compiled``, which is a hundred times as fast
                but takes half a minute to compile, once for each machine, and a moment for each controller. Both give
                the same run to the last bit.
            threads: How many sense at the same time, 1 or more: compiled, for hundreds of robots. The result does not
                depend on it.

        Raises:
            ArgumentError: A number is out of its range.
            SimulationError: There is no room for so many robots, a start is not free, or Numba is not installed.
        """
        robots = None if robots is None else Whole(0).require(robots, "robots")
        scene = check_scene(scene, "elib.World")
        self.seed = check_seed(scene.seed if seed is None else seed)
        threads = Whole(1).require(threads, "threads")
        starts = places(scene, robots, self.seed)
        lanes = min(threads, max(len(starts), 1)) if engine == "compiled" else 1
        self._state = State(scene, starts, self.seed, engine_named(engine), floor_of(scene), lanes=lanes)
        self._senses = Senses(self._state)
        self._boards = RangeAndBearing(self._state)
        self._mover = Mover(self._state)
        self._settled: dict[int, tuple[float, float]] = {}
        self._wheels: dict[int, tuple[float, float]] = {}  # of robots of which something was broken, as they are whole
        self._lamps: dict[int, Lamps] = {}
        self._memory: Any = None
        self._memory_size = 0
        self._told = ()
        self._followers: list[Callable[[], object]] = []

    @classmethod
    def load(
        cls,
        name: str,
        *,
        robots: int | None = None,
        seed: int | None = None,
        engine: EngineName = "interpreted",
        threads: int = 1,
    ) -> World:
        """Set up a world of the gallery, or one from a file.

        Args:
            name: A world that comes with elib, such as ``arena``, or the path of a file ending in ``.toml``.
            robots: How many; None means as many as the file names.
            seed: Instead of the file's own.
            engine: ``"interpreted"`` or ``"compiled"``.
            threads: How many sense at the same time.

        Raises:
            LinkNotFound: There is no such world.
            SimulationError: The file breaks a rule; the message names the file and the key.
        """
        return cls(Scene.load(name, robots=robots), robots=robots, seed=seed, engine=engine, threads=threads)

    def set_step_rates(self, robot: int, left: float, right: float) -> None:
        """Turn a robot's wheels as its firmware does when asked for these speeds, steps/s.

        They are clipped and become the rates its step motors can make (:func:`~elib.base.body.step_rate`).
        """
        generation = self.scene.model.generation
        left, right, here = WANTED.require(left, "left"), WANTED.require(right, "right"), self._robot(robot)
        self.set_wheel_speeds(
            robot,
            step_rate(left, generation) * METRES_PER_STEP * pace(here),
            step_rate(right, generation) * METRES_PER_STEP * pace(here),
        )

    def set_wheel_speeds(self, robot: int, left: float, right: float, *, at: float | None = None) -> None:
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
            if not (is_number(speed) and abs(speed) <= MAX_TRAVEL / step):
                raise ArgumentError(
                    f"{side} is {shown(speed)} m/s; in a step of {step} s it must stay within {MAX_TRAVEL / step} m/s",
                    hint="an e-puck drives 0.13 m/s; a shorter step allows more",
                )
        here = self._robot(robot)
        if at is not None:
            self._roll_until(here, float(at))
        here.left_speed, here.right_speed = float(left), float(right)

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
        here = self._robot(robot)
        self._roll_until(here, at)
        rolled = (
            here.left_steps + here.left_travel * STEPS_PER_METRE,
            here.right_steps + here.right_travel * STEPS_PER_METRE,
        )
        before = self._settled.get(robot, rolled)
        now = before[0] + left * STEPS_PER_METRE, before[1] + right * STEPS_PER_METRE
        self._settled[robot] = now
        here.left_travel += (now[0] - rolled[0]) / STEPS_PER_METRE
        here.right_travel += (now[1] - rolled[1]) / STEPS_PER_METRE

    def _roll_until(self, here: Robot, at: float) -> None:
        """Run up to *at*, and note what the wheels roll within the tick before it."""
        self.run_to(at)
        until = min(max(at - self.time, here.covered), self.scene.step)
        here.left_travel += here.left_speed * (until - here.covered)
        here.right_travel += here.right_speed * (until - here.covered)
        here.covered = until

    def step(self) -> None:
        """Run one tick."""
        self._state.advance(1)

    def run(self, ticks: int, controller: Controller | None = None) -> None:
        """Run *ticks* whole ticks; with a controller every robot senses and is steered in each of them."""
        ticks = Whole(0).require(ticks, "ticks")
        if controller is not None and not isinstance(controller, Controller):
            raise ArgumentError(
                f"{controller!r} is not a controller", hint="wrap a control function: Controller(function, parameters)"
            )
        if controller is None:
            self._state.advance(ticks)
        else:
            self._steer(ticks, controller)

    def _steer(self, ticks: int, controller: Controller) -> None:
        import numpy as np

        controller.try_out()
        state = self._state
        parameters = state.engine.table(controller.table(self.robots))
        if self._memory is None or self._memory_size != controller.memory:
            self._memory_size = controller.memory
            self._memory = state.engine.table(np.zeros((self.robots, controller.memory)))
        sensors = chosen(controller.sensors)
        with explained(f"the control function {controller.name!r}", f", or use {INTERPRETED}"):
            law = law_of(state.engine, controller.function)
            with state.engine.threads(state.lanes):
                ready = state.engine.ready(steer, threads=state.lanes)
                ready(law, state.world, ticks, state.lanes, sensors, parameters, self._memory)

    def reset(self, seed: int | None = None) -> None:
        """Go back to the beginning: what follows is what a new world with this seed would do, and it is much faster.

        Args:
            seed: The seed of noise and chosen starts, 0 <= seed < 2**64; None means the one it had.

        Raises:
            ArgumentError: *seed* is out of its range.
            SimulationError: There is no room for the robots at the places that this seed chooses.
        """
        seed = check_seed(self.seed if seed is None else seed)
        starts = places(self.scene, self.robots, seed)
        self.seed = seed
        self._state.reset(starts, seed)
        self._senses.forget()
        self._boards.forget()
        self._settled.clear()
        self._wheels.clear()
        self._lamps.clear()
        self._memory, self._memory_size, self._told = None, 0, ()

    def run_to(self, time: float) -> None:
        """Run to the last whole tick at or before *time*, s since the start. Never goes back.

        Raises:
            ArgumentError: *time* is not finite.
        """
        if not math.isfinite(time):  # asked here first: programs and the emulator run the world in small steps
            Number(unit="s").require(time, "the time to run to")
        step, tick = self.scene.step, self.tick
        ticks = max(int(time / step) - tick - 1, 0)
        while (tick + ticks + 1) * step <= time:
            ticks += 1
        if self._followers:
            for _ in range(ticks):
                self._state.advance(1)
                for follower in tuple(self._followers):
                    follower()
        elif ticks:
            self._state.advance(ticks)

    def follow(self, function: Callable[[], object]) -> Callable[[], None]:
        """Call *function* after every tick of :meth:`run_to`, which is how the virtual robots of programs go on.

        Returns:
            A function that ends it. It may be called again.
        """
        self._followers.append(function)

        def leave() -> None:
            with contextlib.suppress(ValueError):
                self._followers.remove(function)

        return leave

    def stepper(self) -> Callable[[float, float], Sequence[int]]:
        """Return a short way to steer the first robot from Python.

        The function takes the speeds of its wheels, steps/s as asked of the firmware, runs a tick, and returns its
        eight infrared readings after it, counts.
        """

        def step(left: float, right: float) -> Sequence[int]:
            self.set_step_rates(0, left, right)
            self.step()
            return self.proximity(0)

        return step

    def send_message(self, robot: int, message: bytes, *, at: float | None = None) -> None:
        """Let a robot say *message* by range and bearing from now on.

        Args:
            robot: Index.
            message: At most 4 bytes.
            at: Now, s since the start; None means the time of the last tick.

        Raises:
            ArgumentError: There is no such robot, or the message is too long.
        """
        self._boards.send(self._index(robot), message, self.time if at is None else at)

    def show(self, robot: int, lamps: Lamps) -> None:
        """Set what a robot shows."""
        self._lamps[self._index(robot)] = lamps

    def play(self, robot: int, volume: float, *, until: float = math.inf, frequency: float = 0.0) -> None:
        """Let a robot sound.

        Args:
            robot: Index.
            volume: What a microphone at 0.1 m reads of it, 0..4095 counts; 0 is silence.
            until: When the sound ends, s since the start; by itself it never does.
            frequency: The frequency of its tone, Hz, 0..20000; 0 if it has none.

        Raises:
            ArgumentError: There is no such robot, *volume* or *frequency* is out of its range, or *until* is not a
                number.
        """
        if math.isnan(until):
            raise ArgumentError(f"until is {until}; it must be a time, or infinite")
        here = self._robot(robot)
        here.volume = Number(0, 4095, "counts").require(volume, "volume")
        here.silent_from = float(until)
        here.frequency = Number(0, 20_000, "Hz").require(frequency, "frequency")

    def set_slot(self, robot: int, seconds: float) -> None:
        """Set the time between the samplings of two pairs of a robot's infrared sensors, 0..0.1 s."""
        self._robot(robot).slot = Number(0, 0.1, "s").require(seconds, "the slot")
        self._state.forget()

    def set_infrared(self, robot: int, gains: Sequence[float], offsets: Sequence[float]) -> None:
        """Set the factors of the infrared sensors of *robot*, and what they read in the open, counts: eight each."""
        record = self._robot(robot)
        for s, (gain, offset) in enumerate(zip(gains, offsets, strict=True)):
            record.gain[s], record.offset[s] = gain, offset
        self._state.forget()

    def set_wheels(self, robot: int, left: float, right: float, axle: float) -> None:
        """Set the wheel radii of *robot*, over the nominal one, and its axle, m."""
        here = self._robot(robot)
        here.left_scale, here.right_scale, here.axle = left, right, axle
        self._wheels.pop(robot, None)

    def set_defects(self, robot: int, defects: Sequence[Defect]) -> None:
        """Break these parts of a robot, and mend all others. A clock holds from the next wheel speeds on."""
        here = self._robot(robot)
        if len(defects) > MAX_DEFECTS:
            raise ArgumentError(f"a robot has {len(defects)} defects", hint=f"at most {MAX_DEFECTS} at the same time")
        here.left_scale, here.right_scale = self._wheels.setdefault(robot, (here.left_scale, here.right_scale))
        here.defects = 0
        for defect in defects:
            damage(here, defect.row)
        self._state.forget()

    def name_robots(self, names: Sequence[str]) -> None:
        """Set what messages call the robots, in order, instead of ``robot 0`` and so on.

        Raises:
            ArgumentError: There is not one name for each robot, or two are the same.
        """
        if len(set(names)) != len(names) or len(names) != self.robots:
            raise ArgumentError(f"{list(names)} are not {self.robots} different names", hint="give one for each robot")
        self._mover.robot_names = list(names)

    def move_robot(self, robot: int, pose: Pose) -> None:
        """Put a robot somewhere else; its wheels go on turning.

        Raises:
            ArgumentError: There is no such robot, or no room for it.
        """
        self._mover.robot(self._index(robot), pose)

    def move_box(self, box: int, pose: Pose) -> None:
        """Put a box somewhere else, counted as in the scene. It may stand in other things, as in a world's file.

        Raises:
            ArgumentError: There is no such box, a robot is in its way, or its centre leaves the arena.
        """
        self._mover.box(checked(box, len(self._state.boxes), "box"), pose)

    def move_cylinder(self, cylinder: int, x: float, y: float) -> None:
        """Put a cylinder somewhere else, counted as in the scene. It may stand in other things, as in a world's file.

        Raises:
            ArgumentError: There is no such cylinder, a robot is in its way, or its centre leaves the arena.
        """
        self._mover.cylinder(checked(cylinder, len(self._state.cylinders), "cylinder"), x, y)

    def add_box(self, box: Box) -> None:
        """Put another box into the world, counted behind those that are there.

        Raises:
            ArgumentError: A robot is in its way, its centre leaves the arena, the world has too many, or it is the door
                of a zone that is not there.
        """
        self._told = self.events
        self._mover.add_box(box)

    def remove_box(self, box: int) -> None:
        """Take a box out of the world; those counted behind it move up.

        Raises:
            ArgumentError: There is no such box, or it switches a zone.
        """
        self._told = self.events
        self._state.remove_box(checked(box, len(self._state.boxes), "box"))

    def add_wall(self, wall: Wall) -> None:
        """Put another wall into the world, counted behind those that are there.

        Raises:
            ArgumentError: A robot is in its way, or the world has too many.
        """
        self._mover.wall(len(self.scene.walls), wall)

    def move_wall(self, index: int, wall: Wall) -> None:
        """Replace a wall, counted as in the scene.

        Raises:
            ArgumentError: There is no such wall, or a robot is in its way.
        """
        self._mover.wall(checked(index, len(self.scene.walls), "wall"), wall)

    def remove_wall(self, index: int) -> None:
        """Take a wall out of the world; those counted behind it move up.

        Raises:
            ArgumentError: There is no such wall.
        """
        walls = self.scene.walls
        index = checked(index, len(walls), "wall")
        self._state.set_walls(walls[:index] + walls[index + 1 :])

    def set_light(self, index: int, light: Light) -> None:
        """Replace a lamp, counted as in the scene."""
        self._state.lights[checked(index, len(self._state.lights), "light")] = light
        self._state.relight()

    def set_sound(self, index: int, sound: Sound) -> None:
        """Replace a source of sound, counted as in the scene."""
        self._state.sounds[checked(index, len(self._state.sounds), "sound")] = sound
        self._state.relight()

    def switch(self, zone: str, is_on: bool | None) -> None:
        """Switch a zone on or off from now on, whatever is in it; None leaves it to what is in it again.

        Raises:
            ArgumentError: There is no such zone.
        """
        names = [each.name for each in self.scene.zones]
        if zone not in names:
            raise ArgumentError(f"there is no zone {zone!r}", hint=nearest(zone, names))
        self._state.world.zones[names.index(zone)].hand = 0 if is_on is None else 1 if is_on else -1

    def set_pen(self, robot: int, colour: Colour | None) -> None:
        """Let a robot draw where it drives, in a colour that its ground sensors see; None lifts its pen.

        Raises:
            ArgumentError: There is no such robot, or no robot of the scene has a pen.
        """
        if not self._state.world.setting[0].has_pens:
            raise ArgumentError("no robot of this world has a pen", hint='give one a pen: [[robot]] pen = "#101010"')
        self._robot(robot).pen = -1 if colour is None else packed(colour)

    def set_ambient(self, counts: float) -> None:
        """Set what an infrared sensor reads in the room's own light, 0..4095 counts, higher is darker."""
        self._state.world.setting[0].ambient = rule_of(EpuckModel, "ambient").require(counts, "the room's light")
        self._state.forget()

    def moment(self) -> Moment:
        """Return what the world is now, for :meth:`go_back`."""
        return self._state.moment()

    def go_back(self, moment: Moment) -> None:
        """Make this world what it was: robots, boxes, walls, cylinders, lamps, sounds and the room's light.

        Things that can be pushed move on as they did. The time, what wheels and sensors of the robots have counted,
        and what the robots show go on from now; their wheels go on turning.

        Raises:
            ArgumentError: It is a moment of another world.
        """
        if _FIRM(moment.scene) != _FIRM(self.scene) or len(moment.robots) != self.robots:
            raise ArgumentError("this is a moment of another world", hint="keep moment() of the world that goes back")
        self._told = self.events
        self._state.go_back(moment)

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_followers": []}  # They follow this world, not its copy.

    def __copy__(self) -> World:
        # Two worlds that share their robots, but not the tick, are of no use.
        return copy.deepcopy(self)
