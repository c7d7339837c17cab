"""The bull: it looks around for something red and charges at it, and wanders where it sees none.

After the sample of the same name of the C# library elib. Its bull turned by time alone, saw a third of what is around
it, pushed for ever once it had hit, and stood still for good after the first obstacle it avoided.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable
from typing import Annotated

from elib.behaviours.frame import behaviour
from elib.behaviours.loop import react
from elib.behaviours.redness import Redness, how_red
from elib.behaviours.stage import Stage
from elib.body import SENSOR_DIRECTIONS
from elib.protocol.quantities import CameraMode, Quantity
from elib.protocol.values import Proximity, Wheels
from elib.robot.aio import Epuck

Speed = Annotated[float, Quantity("speed", "rev/s", 0.1, 0.8, scale=1000)]
Red = Annotated[float, Quantity("red", "", 0.01, 0.9, scale=1000)]

SIDE, ZOOM = 40, 8
"""Pixels of the picture's sides, and the widest view (elib-2011, 6.4)."""
VIEW = math.radians(29.8)
"""rad that this picture shows from left to right (robot-model, 2.8)."""
GLANCES = 12
"""Pictures of one look around: each shows a twelfth of a turn. The four of 2011 left two thirds unseen."""
FAINTER = 0.5
"""Share of the red it takes to begin a charge below which one ends: 2011 had 0.2 after 0.3. Without the difference a
picture's noise could end what it began."""
STEERING = 0.6
"""Difference of the wheels, as a share of the speed, for red at the picture's edge. At 0.4 rev/s that turns 18 degrees
a second towards red that is 15 degrees off: slow enough for a picture that takes 0.7 s over a slow link."""
NEARER = 1.1
"""Growth of the red by which a charge is seen to come nearer."""
STALEMATE = 5.0
"""s without growth after which a charge is over. From where the red fills the picture, 15 cm away, it takes 1.5 s to
hit at 0.4 rev/s; the rest is pushing."""
BACKWARD = 0.06
"""m that it backs off then: enough to turn beside what it hit."""

PERIOD = 0.1
"""s between two steps of its wandering."""
BLOCKED = 900
"""Counts of the four front sensors together at which it turns away: a wall 3 cm ahead, or a post 2 cm. On the robot of
2011 it were 2000, which on Enki's is a bump."""
CROWDED = 500
"""Counts of a sensor at which there is no way out in its direction (elib-2011, 6.4)."""
ALIKE = 40
"""Counts by which two sensors that see nothing differ: four standard deviations (Enki)."""
AGAIN = 0.03
"""Probability to look around again, for each step of wandering (elib-2011, 6.4): every 4 s on average."""
ROAMING = 6.0
"""s of wandering before that, 20 cm on average: from where it has just looked there is nothing new to see."""
PAUSE = 1.0
"""s between two looks for a way out, where there is none."""


def aim(seen: Redness, *, red: float = 0.04) -> float | None:
    """Return the turn, rad, that brings the red ahead; None where there is too little.

    Args:
        seen: How red the picture is, and where.
        red: Share of red pixels that is enough.
    """
    return None if seen.fraction < red else (0.5 - seen.direction) * VIEW


def charge(seen: Redness, *, speed: float = 0.4) -> Wheels:
    """Return the wheels' speeds, rev/s, that lead into the red.

    Args:
        seen: How red the picture is, and where; there must be some red.
        speed: Of the faster wheel.
    """
    bend = 2 * STEERING * (seen.direction - 0.5)  # to the right if positive
    return Wheels(speed * (1 + min(0.0, bend)), speed * (1 - max(0.0, bend)))


def wander(near: Proximity, left: float, right: float) -> Wheels | None:
    """Return the speeds, rev/s, of a bull that sees nothing red; None where something is in front of it.

    Args:
        near: What the infrared sensors see.
        left: Chance, 0 to 1.
        right: Chance, 0 to 1.
    """
    if near.front_left + near.diagonal_left + near.front_right + near.diagonal_right > BLOCKED:
        return None
    return Wheels(0.1 + left / 3, 0.1 + right / 3)


def way_out(near: Proximity) -> float | None:
    """Return the turn, rad, to where there is most room; None where there is none.

    That is the direction of the sensor that sees least. Of several that see nothing it is the one furthest from what
    the others see, so that it turns its back on a wall.
    """
    least = min(near)
    if least >= CROWDED:
        return None
    nearest = SENSOR_DIRECTIONS[near.index(max(near))]
    most = min(least + ALIKE, CROWDED - 1)
    free = (angle for angle, count in zip(SENSOR_DIRECTIONS, near, strict=True) if count <= most)
    return max(free, key=lambda angle: abs(math.remainder(angle - nearest, math.tau)))


State = Callable[[Epuck], Awaitable["State"]]


class Bull:
    """What the bull remembers, and its states: each does one step and returns the next.

    A step whose answer is lost is taken again.

    Args:
        robot: Its body.
        stage: Where it performs.
        speed: Of its charge, rev/s.
        red: Share of red pixels that makes it charge.
    """

    def __init__(self, robot: Epuck, stage: Stage, speed: float, red: float) -> None:
        self._robot = robot
        self._stage = stage
        self._speed = speed
        self._red = red
        self._glances = 0
        self._best = 0.0
        self._grew = 0.0
        self._turn = 0.0
        self._looked = -math.inf

    async def waking(self, eyes: Epuck) -> State:
        """Open the eye."""
        await self._robot.set_camera(SIDE, SIDE, ZOOM, CameraMode.COLOUR)
        return self._look_around()

    def _look_around(self) -> State:
        self._glances = GLANCES
        return self.searching

    async def searching(self, eyes: Epuck) -> State:
        """Take a picture; charge if it is red, else turn on to the next or give it up."""
        self._stage.state("searching")
        if self._glances == 0:
            self._looked = self._robot.time
            return self.wandering
        await eyes.set_speed(0.0, 0.0)
        turn = aim(await self._look(), red=self._red)
        if turn is not None:
            await self._robot.turn(turn)
            self._best, self._grew = 0.0, self._robot.time
            return self.charging
        await self._robot.turn(math.tau / GLANCES)
        self._glances -= 1
        return self.searching

    async def charging(self, eyes: Epuck) -> State:
        """Drive into the red, and go on as long as it grows."""
        self._stage.state("charging")
        seen = await self._look()
        if seen.fraction < FAINTER * self._red:
            return self._look_around()
        if seen.fraction > NEARER * self._best:
            self._best, self._grew = seen.fraction, self._robot.time
        if self._robot.time - self._grew > STALEMATE:
            return self.backing
        await eyes.set_speed(*charge(seen, speed=self._speed))
        return self.charging

    async def backing(self, eyes: Epuck) -> State:
        """Leave what was hit, in any direction but back to it."""
        self._stage.state("backing")
        await self._robot.drive(-BACKWARD)
        self._turn = self._stage.random.uniform(math.tau / 4, 3 * math.tau / 4)
        return self.avoiding

    async def wandering(self, eyes: Epuck) -> State:
        """Drive about, as chance will have it, and now and then look around again."""
        self._stage.state("wandering")
        chance = self._stage.random
        if self._robot.time - self._looked > ROAMING and chance.random() < AGAIN:
            return self._look_around()
        near = await eyes.proximity()
        wheels = wander(near, chance.random(), chance.random())
        if wheels is not None:
            await eyes.set_speed(*wheels)
            return self.wandering
        turn = way_out(near)
        if turn is None:
            return self.stuck
        self._turn = turn
        return self.avoiding

    async def avoiding(self, eyes: Epuck) -> State:
        """Turn away, and wander on."""
        self._stage.state("avoiding")
        await self._robot.turn(self._turn)
        return self.wandering

    async def stuck(self, eyes: Epuck) -> State:
        """Stand until there is a way out."""
        self._stage.state("stuck")
        await eyes.set_speed(0.0, 0.0)
        await self._robot.sleep(PAUSE)
        return self.stuck if way_out(await eyes.proximity()) is None else self.wandering

    async def _look(self) -> Redness:
        """Take a picture. It takes longer than the eyes' patience: the robot's own time is for that."""
        picture = await self._robot.image()
        if (picture.width, picture.height, picture.mode) != (SIDE, SIDE, CameraMode.COLOUR):
            # A robot that restarted has forgotten it.
            await self._robot.set_camera(SIDE, SIDE, ZOOM, CameraMode.COLOUR)
            picture = await self._robot.image()
        return how_red(picture.pixels)


@behaviour(world="red-boxes", reconnects=True)
async def run_at_red(robot: Epuck, stage: Stage, *, speed: Speed = 0.4, red: Red = 0.04) -> None:
    """Look for something red and charge at it, as a bull would.

    It takes twelve pictures around itself. Where one is red enough it turns there and charges, steering by more
    pictures; when the red comes no nearer for five seconds, because it is pushed or stands firm, the bull backs off.
    Where it sees no red it wanders about, turns away from obstacles, and looks around again now and then.

    Args:
        robot: The bull.
        stage: Where it performs.
        speed: Of the charge.
        red: Share of red pixels that makes it charge: 0.04 is a box of 8 cm more than a metre away, 0.3 (as in 2011)
            one 40 cm away. Take more where the floor or the furniture is reddish.
    """
    bull = Bull(robot, stage, speed, red)
    act: State = bull.waking

    async def step(eyes: Epuck) -> None:
        nonlocal act
        act = await act(eyes)

    await react(robot, step, period=PERIOD)
