"""The bull: it looks around for something red and charges at it, and wanders where it sees none. In the begin style.

After the sample of the same name of the C# library elib. Its bull turned by time alone, saw a third of what is around
it, pushed for ever once it had hit, and stood still for good after the first obstacle it avoided.

Requests that do not depend on each other are begun together and ended one after another: the wheels' command and the
next picture or reading. Motions and pictures are slow; meanwhile ``run.wait_for`` checks whether the run is over. A
single quick request is made by a blocking call, which is a begin and its end in one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react_blocking
from elib.behaviours.avoid import STANDING
from elib.behaviours.redness import Redness, how_red
from elib.body import SENSOR_DIRECTIONS
from elib.errors import ElibError
from elib.protocol.quantities import CameraMode
from elib.protocol.values import Proximity, Wheels
from elib.robot.blocking import BlockingEpuck

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


State = Callable[[BlockingEpuck], "State"]


class Bull:
    """What the bull remembers, and its states: each does one step and returns the next.

    A step whose answer is lost is taken again, from a stand.

    Args:
        robot: Its body.
        run: Where it performs.
        speed: Of its charge, rev/s.
        red: Share of red pixels that makes it charge.
    """

    def __init__(self, robot: BlockingEpuck, run: RunContext, speed: float, red: float) -> None:
        self._robot = robot
        self._run = run
        self._speed = speed
        self._red = red
        self._glances = 0
        self._best = 0.0
        self._grew = 0.0
        self._turn = 0.0
        self._wheels = STANDING
        self._looked = -math.inf

    def waking(self, eyes: BlockingEpuck) -> State:
        """Open the eye."""
        self._robot.set_camera(SIDE, SIDE, ZOOM, CameraMode.COLOUR)
        return self._look_around()

    def _look_around(self) -> State:
        self._glances = GLANCES
        return self.searching

    def searching(self, eyes: BlockingEpuck) -> State:
        """Take a picture; charge if it is red, else turn on to the next or give it up."""
        self._run.state("searching")
        if self._glances == 0:
            self._looked = self._robot.time
            return self.wandering
        seen = self._look(eyes, STANDING)
        if seen is None:
            return self.searching
        turn = aim(seen, red=self._red)
        if turn is not None:
            self._run.wait_for(self._robot.begin.turn(turn))
            self._best, self._grew = 0.0, self._robot.time
            return self.charging
        self._run.wait_for(self._robot.begin.turn(math.tau / GLANCES))
        self._glances -= 1
        return self.searching

    def charging(self, eyes: BlockingEpuck) -> State:
        """Drive into the red as it was seen last, look again meanwhile, and go on as long as it grows."""
        self._run.state("charging")
        seen = self._look(eyes, self._last_wheels())
        if seen is None:
            return self.charging
        if seen.fraction < FAINTER * self._red:
            return self._look_around()
        if seen.fraction > NEARER * self._best:
            self._best, self._grew = seen.fraction, self._robot.time
        if self._robot.time - self._grew > STALEMATE:
            return self.backing
        self._wheels = charge(seen, speed=self._speed)
        return self.charging

    def backing(self, eyes: BlockingEpuck) -> State:
        """Leave what was hit, in any direction but back to it."""
        self._run.state("backing")
        self._run.wait_for(self._robot.begin.drive(-BACKWARD))
        self._turn = self._run.random.uniform(math.tau / 4, 3 * math.tau / 4)
        return self.avoiding

    def wandering(self, eyes: BlockingEpuck) -> State:
        """Drive about, as chance will have it, and now and then look around again."""
        self._run.state("wandering")
        wheels = self._last_wheels()
        chance = self._run.random
        if self._robot.time - self._looked > ROAMING and chance.random() < AGAIN:
            return self._look_around()
        driving = eyes.begin.set_speed(*wheels)
        looking = eyes.begin.proximity()
        driving.end()
        near = looking.end()
        onwards = wander(near, chance.random(), chance.random())
        if onwards is not None:
            self._wheels = onwards
            return self.wandering
        turn = way_out(near)
        if turn is None:
            return self.stuck
        self._turn = turn
        return self.avoiding

    def avoiding(self, eyes: BlockingEpuck) -> State:
        """Turn away, and wander on."""
        self._run.state("avoiding")
        self._run.wait_for(self._robot.begin.turn(self._turn))
        return self.wandering

    def stuck(self, eyes: BlockingEpuck) -> State:
        """Stand until there is a way out."""
        self._run.state("stuck")
        eyes.set_speed(*STANDING)
        self._robot.sleep(PAUSE)
        return self.stuck if way_out(eyes.proximity()) is None else self.wandering

    def _last_wheels(self) -> Wheels:
        """Return the speeds that the last look led to, once: after a lost answer it stands until it has looked."""
        wheels, self._wheels = self._wheels, STANDING
        return wheels

    def _look(self, eyes: BlockingEpuck, wheels: Wheels) -> Redness | None:
        """Drive at these speeds and take a picture meanwhile; None where the time is over.

        A picture takes longer than the eyes' patience: the robot's own time is for that.
        """
        driving = eyes.begin.set_speed(*wheels)
        looking = self._robot.begin.image()
        try:
            driving.end()
        except ElibError:
            looking.cancel()  # or the order to stand would wait behind a picture that nobody wants any more
            raise
        picture = self._run.wait_for(looking)
        if picture is not None and (picture.width, picture.height, picture.mode) != (SIDE, SIDE, CameraMode.COLOUR):
            # A robot that restarted has forgotten it.
            self._robot.set_camera(SIDE, SIDE, ZOOM, CameraMode.COLOUR)
            picture = self._run.wait_for(self._robot.begin.image())
        return None if picture is None else how_red(picture.pixels)


@behaviour(world="red-boxes", reconnects=True)
def run_at_red(robot: BlockingEpuck, run: RunContext, *, speed: Speed = 0.4, red: Red = 0.04) -> None:
    """Look for something red and charge at it, as a bull would.

    It takes twelve pictures around itself. Where one is red enough it turns there and charges, steering by more
    pictures; when the red comes no nearer for five seconds, because it is pushed or stands firm, the bull backs off.
    Where it sees no red it wanders about, turns away from obstacles, and looks around again now and then.

    Args:
        robot: The bull.
        run: Where it performs.
        speed: Of the charge.
        red: Share of red pixels that makes it charge: 0.04 is a box of 8 cm more than a metre away, 0.3 (as in 2011)
            one 40 cm away. Take more where the floor or the furniture is reddish.
    """
    bull = Bull(robot, run, speed, red)
    act: State = bull.waking

    def step(eyes: BlockingEpuck) -> None:
        nonlocal act
        act = act(eyes)

    react_blocking(robot, run, step, period=PERIOD)
