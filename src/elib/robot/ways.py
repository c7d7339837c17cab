"""Drive to a place by a map: along a way that keeps off what is on it, looking for what is not.

While it drives, the robot is found on the map by what its wheels and its infrared sensors tell
(:class:`~elib.maps.localiser.Localiser`), so wheels that differ lead nowhere else. The pose of odometry is set to that.
Tables and plans take some tenths of a second: they are made in a thread, while the event loop goes on.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import Final

from elib.base.body import AXLE, SENSOR_DIRECTIONS, SENSOR_RADIUS, STEPS_PER_REVOLUTION
from elib.base.errors import ArgumentError, NoWay
from elib.base.plaintext import counted
from elib.base.pose import apart, bearing
from elib.link.protocol.commands import Commands
from elib.link.protocol.distances import OpenAir, distances
from elib.link.protocol.values import Proximity, Wheels
from elib.maps.grid import Grid
from elib.maps.localiser import Estimate, Localiser
from elib.maps.ways import Place, way
from elib.robot.motion import FASTEST, Mover

PERIOD: Final = 0.1
"""s from one look to the next, if the link is quick enough."""
STRETCH: Final = 0.012
"""m that the robot drives from one look to the next at most: a slow link makes a slow robot."""
REACHED: Final = 0.015
"""m from a corner of the way at which the next one is driven to."""
ASIDE: Final = 0.5
"""rad of a corner beside the heading, from which the robot turns on the spot."""
GAIN: Final = 2.5
"""rad/s of turning for each rad that the corner lies beside the heading."""
TOLD: Final = 0.045
"""m: what seems nearer than this, and is not on the map, is there."""
NEARER: Final = 0.02
"""m by which a sensor must read less than on the map: gains differ by 17 %."""
STRANGE: Final = 0.4
"""Share of readings by what is not on the map: enough that a box does not draw the robot aside, and little enough that
a wall which is nearer than it believed does. It was chosen between 0.3 and 0.5, which did as well."""
LOOKS: Final = 3
"""Looks in a row in which it must be seen: an e-puck2's front sensors glitch (measured-robots:
infrared.glitches_while_driving_epuck2)."""
LUMP: Final = 0.012
"""m around what was seen that are then taken to be occupied."""
FRONT: Final = (0, 1, 6, 7)
"""Sensors that see what is in the way."""
TOUCHING: Final = 0.008
"""m from something in front at which a robot that draws a map stands and plans again; and m/s, if it drives on."""
MAX_PLANS: Final = 40
"""How often a way is planned: what moves can be in the way again and again."""
DOUBTFUL: Final = 0.8
"""Mean fit of the readings below which they contradict the map: where it was right, hardly any were."""
MAX_LOST: Final = 20
"""Looks in a row in which the robot may be in several places, after which it has lost its way."""


class Guide:
    """Drives one robot by a map, which it may draw itself.

    Args:
        mover: The robot, whose odometry tells where on the map it is.
        grid: The map.
        speed: The fastest speed, m/s.
        turn_rate: The fastest turn rate, rad/s.
        draws: Whether what it sees is added to the map, and it may drive where nothing is known.
        is_lost: Whether the robot may be anywhere on the map.
    """

    near: Proximity  # the last readings of the infrared sensors, without what they read in the open

    def __init__(
        self, mover: Mover, grid: Grid, speed: float, turn_rate: float, *, draws: bool = False, is_lost: bool = False
    ) -> None:
        self._mover, self._speed, self._turn_rate, self._draws = mover, speed, turn_rate, draws
        self._may_be_anywhere = is_lost
        self.known = grid if draws else grid.copy()  # the map, and what it has seen beside that
        if draws:
            grid.add(mover.motion.odometry.pose, [math.nan] * 8)
        pose = None if is_lost else mover.motion.odometry.pose
        try:
            self.localiser = Localiser(grid, pose, is_carried=not draws)  # what finds it on the map
        except ArgumentError as error:
            hint = "robot.set_pose(x, y, heading) says where it is; find_place() of elib.behaviours.find_place finds it"
            raise NoWay(error.message, hint=hint) from None
        if not draws and not is_lost:
            self.localiser.nearer = STRANGE
        if mover.motion.wheels is not None:
            self.localiser.wheels = mover.motion.wheels
        self.estimate: Estimate = self.localiser.estimate  # where it is
        self._looked = -math.inf
        self._seen = self._lost = 0
        self._ahead = 0.0
        self._drawn = self.known.changes
        self.looks = self.amiss = 0  # how often it looked while it drew, and how often that contradicted the map
        self.driven = 0.0  # m

    def hand_over(self) -> None:
        """Leave to the robot's next motions where it is, and what was learned of its wheels."""
        self._mover.motion.odometry.pose = self.estimate.pose
        self._mover.motion.wheels = self.localiser.wheels

    async def look_round(self) -> None:
        """Turn round once, so that each sensor learns what it reads where nothing is near."""
        odometry = self._mover.motion.odometry
        before, turned = odometry.pose.heading, 0.0
        while turned < math.tau:
            await self.look(is_placed=False)
            turned += max(0.0, math.remainder(odometry.pose.heading - before, math.tau))
            before = odometry.pose.heading
            await self._drive(0.0, min(self._turn_rate, 1.5))
        await asyncio.to_thread(self.localiser.renew)

    async def drive_to(self, goal: Place, is_there: Callable[[], bool] = lambda: False) -> None:
        """Drive to a place on the map, m, or until *is_there*; the robot then stands.

        Raises:
            NoWay: There is none, or the robot has lost its way.
        """
        blocked = 0
        while blocked < MAX_PLANS:
            here = self.estimate.pose
            try:
                corners = await asyncio.to_thread(way, self.known, (here.x, here.y), goal, through_unknown=self._draws)
            except NoWay:
                if not blocked:
                    raise
                break
            if await self._follow(corners, is_there):
                if self._lost and not self._draws:
                    raise self._astray()
                return
            blocked += 1
        tried = f"{counted(blocked, 'way')} tried"
        raise NoWay(
            f"what is not on the map blocks the way to ({goal[0]:.2f}, {goal[1]:.2f}) m: {tried}",
            hint="does something move there? Is the robot where the map has it? Try again later, or draw the map again",
        )

    def _astray(self) -> NoWay:
        """Return the error that the robot may be in several places."""
        pose = self.estimate.pose
        return NoWay(
            f"the robot lost its way near ({pose.x:.2f}, {pose.y:.2f}) m: what it reads is not on the map there",
            hint="was it put elsewhere? find_place() of elib.behaviours.find_place finds it again",
        )

    async def _follow(self, corners: list[Place], is_there: Callable[[], bool]) -> bool:
        """Drive along a way; return whether it came to its end. If not, it is blocked."""
        while corners and not is_there():
            is_blocked = await self.look()
            if is_blocked:
                await self._drive(0.0, 0.0)
                return False
            here = self.estimate.pose
            if math.dist((here.x, here.y), corners[0]) < REACHED:
                del corners[0]
                continue
            beside = bearing(here, *corners[0])
            turning = max(-self._turn_rate, min(self._turn_rate, GAIN * beside))
            ahead = 0.0 if abs(beside) > ASIDE else self._speed * (1 - abs(beside) / ASIDE / 2)
            await self._drive(ahead / 4 if self._seen else ahead, turning)
        await self._drive(0.0, 0.0)
        return True

    async def _drive(self, ahead: float, turning: float) -> None:
        """Let both wheels turn, m/s and rad/s, until the next look."""
        self._ahead = ahead
        await self.roll(Wheels(*((ahead + side * turning * AXLE / 2) / FASTEST for side in (-1, 1))))

    async def roll(self, wheels: Wheels) -> None:
        """Let the wheels turn with these speeds, or as fast as they can, until the next look; less on a slow link."""
        loop, scale = asyncio.get_running_loop(), max(*map(abs, wheels), 1.0)
        wheels = Wheels(wheels.left / scale, wheels.right / scale)
        way = max(PERIOD, loop.time() - self._looked) * FASTEST * abs(wheels.left + wheels.right) / 2
        steps = [round(min(1.0, STRETCH / max(way, 1e-9)) * STEPS_PER_REVOLUTION * speed) for speed in wheels]
        await self._mover.motion.set_wheels(self._mover, (steps[0], steps[1]))
        await asyncio.sleep(max(0.0, self._looked + PERIOD - loop.time()))

    async def look(self, *, is_placed: bool = True) -> bool:
        """Read wheels and distances, and find the robot; return whether something is in the way that is not known.

        After a lost answer the robot stands until it has the next.
        """
        mover, motion = self._mover, self._mover.motion
        self._looked = asyncio.get_running_loop().time()
        while not (near := await motion.ask(mover, Commands.proximity.spec.request(mover.context))) or not (
            await motion.try_counters(mover)
        ):
            await motion.set_wheels(mover, (0, 0))
        context = mover.context
        context.open_air = context.open_air or OpenAir()
        self.near = context.open_air(near[0])
        seen = distances(self.near)
        if not is_placed:
            self.estimate = self.localiser.update(motion.odometry.pose, None)
            if self._draws:
                self.known.add(self.estimate.pose, seen)
            return False
        expected = self.localiser.expected(self.estimate.pose)
        if self._draws:
            is_new = [now < TOUCHING < self._ahead for now in seen]
        else:
            is_new = [now < TOLD and now < there - NEARER for now, there in zip(seen, expected, strict=True)]
        before, self.estimate = self.estimate.pose, self.localiser.update(motion.odometry.pose, seen)
        pose = self.estimate.pose
        self.driven += apart(before, pose)
        self.looks += 1
        self.amiss += self.estimate.fit < DOUBTFUL
        self._lost = self._lost + 1 if self.estimate.share < 0.5 else 0
        if self._lost > MAX_LOST and not self._draws and not self._may_be_anywhere:
            raise self._astray()
        if self._draws:
            self.known.add(pose, seen)
            if self.known.changes - self._drawn > 30:
                self._drawn = self.known.changes
                await asyncio.to_thread(self.localiser.renew)
        hits = []
        for k, (direction, distance) in enumerate(zip(SENSOR_DIRECTIONS, seen, strict=True)):
            if is_new[k]:
                axis, far = pose.heading + direction, SENSOR_RADIUS + distance
                hits.append((k, pose.x + far * math.cos(axis), pose.y + far * math.sin(axis)))
        is_ahead = any(k in FRONT and not self.known.is_occupied(x, y) for k, x, y in hits)
        self._seen = self._seen + 1 if is_ahead else 0
        if self._seen < (1 if self._draws else LOOKS):
            return False
        self._seen = 0
        for _, x, y in hits:
            self.known.fill(x, y, LUMP)
        return True


async def go(mover: Mover, grid: Grid, place: Place, speed: float, turn_rate: float) -> None:
    """Drive to a place on a map, m, round what is in the way."""
    is_first = mover.context.open_air is None
    guide = await asyncio.to_thread(Guide, mover, grid, speed, turn_rate)
    try:
        if is_first:
            await guide.look_round()
        await guide.drive_to(place)
    finally:
        guide.hand_over()
    await mover.motion.go(mover, *place, speed, turn_rate)
