"""What a world is made of while it runs: the flat sequences, in the form that its engine takes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from elib.errors import SimulationError
from elib.physics import assembly, kernels
from elib.physics import layout as at
from elib.physics.controller import Controller
from elib.physics.engine import Engine
from elib.physics.fittings import Light, Sound
from elib.physics.geometry import Box, Cylinder
from elib.physics.grid import is_listed, regrid
from elib.physics.layout import Floats, Ints
from elib.physics.room import SCRATCH
from elib.physics.scene import Scene
from elib.physics.sensors import infrared, proximity
from elib.physics.things import follow
from elib.pose import Pose


class State:
    """A scene laid out for one engine.

    Attributes:
        scene: What it was made from.
        engine: How its kernels run.
        count: Number of robots.
        profile: Of the infrared sensors.
        boxes: As they were laid out; pushable ones have moved since.
        cylinders: The same.
        box_bodies: For each box its body, or -1 if it is fixed.
        cylinder_bodies: The same of the cylinders.
        lights: Lamps as they are now.
        sounds: Tones as they are now.
        solid: The sequences that every kernel takes, in this order: fixed, robots, bodies, walls, discs, cells,
            numbers.
        lamps: The lights' records.
        tones: The sounds' records.
        scratch: Room for kernels.
        wheels: Room for a law's two speeds.
    """

    solid: tuple[Floats, Floats, Floats, Floats, Floats, Ints, Ints]

    def __init__(self, scene: Scene, starts: Sequence[Pose], seed: int, engine: Engine) -> None:
        self.scene = scene
        self.engine = engine
        self.count = len(starts)
        self.profile = proximity.profile(scene.model.profile)
        self.boxes, self.cylinders = list(scene.boxes), list(scene.cylinders)
        self.lights, self.sounds = list(scene.lights), list(scene.sounds)
        solids = assembly.Solids(scene, self.boxes, self.cylinders, self.profile.reach, self.count)
        self.fixed: Floats = engine.floats(assembly.fixed_numbers(scene, solids, self.profile, self.count, seed))
        self.robots: Floats = engine.floats(assembly.robot_records(scene, starts, seed))
        self.numbers: Ints = engine.ints(assembly.whole_numbers(scene, solids, self.profile, self.count, seed))
        self.scratch: Floats = engine.floats([0.0] * SCRATCH)
        self.wheels: Floats = engine.floats([0.0, 0.0])
        self._tried: set[Controller] = set()
        self._take(solids)
        self.relight()
        self._advance = engine.bare(kernels.advance)
        self._sense = engine.bare(infrared.sense)
        self.regrid()

    def advance(self, ticks: int) -> None:
        """Run *ticks* ticks."""
        self._run(ticks, lambda left: self._advance(left, *self.solid, self.scratch))

    def steer(self, ticks: int, controller: Controller) -> None:
        """Run *ticks* ticks under a law."""
        if controller not in self._tried:
            controller.try_out()
            self._tried.add(controller)
        steer = self.engine.bare(kernels.steer, law=controller.law)
        parameters = self.engine.floats(controller.parameters)
        try:
            self._run(ticks, lambda left: steer(left, parameters, self.wheels, *self.solid, self.lamps, self.scratch))
        except Exception as error:
            if not type(error).__module__.startswith("numba."):
                raise
            reason = next((line for line in str(error).splitlines()[1:] if line.strip()), str(error))
            raise SimulationError(
                f"the law {controller.law.__name__!r} cannot be compiled: {reason.strip()}",
                hint="keep to numbers, loops and comparisons, or use the interpreted engine",
            ) from error

    def _run(self, ticks: int, run: Callable[[int], None]) -> None:
        """Run *ticks* ticks by a kernel; it stops where the lists of what is near need more room, and gets it."""
        end = self.numbers[at.TICK] + ticks
        run(ticks)
        while self.make_room():
            run(int(end - self.numbers[at.TICK]))

    def make_room(self) -> bool:
        """Make room for longer lists of what is near if it was too small; return whether it was."""
        if not self.numbers[at.NEAR_LACK]:
            return False
        while self.numbers[at.NEAR_LACK]:
            known = [int(self.numbers[k]) for k in range(len(self.numbers))]
            room = known[at.NEAR_END] - known[at.NEAR_AT]
            known[at.NEAR_END] += room
            self.numbers = self.engine.ints([*known, *[0] * room])
            self._gather()
            self.engine.bare(regrid)(*self.solid)
        return True

    def sense(self, robot: int) -> None:
        """Bring a robot's infrared readings up to this tick."""
        self._sense(robot, *self.solid, self.lamps, self.scratch)

    def rebuild(self) -> None:
        """Lay the solids out anew after a fixed one was moved; pushable ones stay where they are."""
        for k, box in enumerate(self.boxes):
            self.boxes[k] = self.box(k) if self.box_bodies[k] >= 0 else box
        for k, cylinder in enumerate(self.cylinders):
            self.cylinders[k] = self.cylinder(k) if self.cylinder_bodies[k] >= 0 else cylinder
        before = self.bodies
        self._take(assembly.Solids(self.scene, self.boxes, self.cylinders, self.profile.reach, self.count))
        for k in range(len(before)):
            self.bodies[k] = before[k]  # To the last bit, which an angle does not keep.
        for body in range(len(before) // at.BODY):
            follow(body, self.bodies, self.walls, self.discs)
        self.regrid()

    def relight(self) -> None:
        """Lay lights and sounds out anew after one was changed."""
        shining = [light for light in self.lights if light.intensity > 0.0]
        sounding = [sound for sound in self.sounds if sound.volume > 0.0]
        self.lamps = self.engine.floats([number for light in shining for number in light_record(light)])
        self.numbers[at.LIGHTS] = len(shining)
        self.tones = self.engine.floats([number for sound in sounding for number in sound_record(sound)])
        self.forget()

    def regrid(self) -> None:
        """Hang everything that moves into the grid again, after something was put elsewhere."""
        if is_listed(self.numbers):
            self.engine.bare(regrid)(*self.solid)
            self.make_room()
        self.forget()

    def forget(self) -> None:
        """Forget the infrared readings of this tick, after something changed that they depend on."""
        for i in range(self.count):
            self.numbers[at.HEAD + i * at.NUMBER + at.SEEN] = -1

    def box(self, index: int) -> Box:
        """Return a box where it is now."""
        body = self.box_bodies[index]
        if body < 0:
            return self.boxes[index]
        return assembly.moved_box(self.boxes[index], self.bodies, body * at.BODY)

    def cylinder(self, index: int) -> Cylinder:
        """Return a cylinder where it is now."""
        body = self.cylinder_bodies[index]
        if body < 0:
            return self.cylinders[index]
        return assembly.moved_cylinder(self.cylinders[index], self.bodies, body * at.BODY)

    def _take(self, solids: assembly.Solids) -> None:
        floats = self.engine.floats
        self.bodies: Floats = floats(solids.bodies)
        self.walls: Floats = floats(solids.walls)
        self.discs: Floats = floats(solids.discs)
        self.cells: Ints = self.engine.ints(solids.cells)
        self.box_bodies, self.cylinder_bodies = solids.box_bodies, solids.cylinder_bodies
        self.numbers[at.CELL_COLUMNS], self.numbers[at.CELL_ROWS] = solids.columns, solids.rows
        self.numbers[at.WALLS] = len(solids.walls) // at.WALL
        self.numbers[at.DISCS] = len(solids.discs) // at.DISC
        self.fixed[at.CELL_SCALE] = solids.scale
        self._gather()

    def _gather(self) -> None:
        fixed, robots, bodies, walls = self.fixed, self.robots, self.bodies, self.walls
        self.solid = (fixed, robots, bodies, walls, self.discs, self.cells, self.numbers)


def light_record(light: Light) -> list[float]:
    """Return *light* as the kernels take it."""
    return [light.x, light.y, light.height, light.intensity]


def sound_record(sound: Sound) -> list[float]:
    """Return *sound* as the kernels take it."""
    return [sound.x, sound.y, sound.volume]
