"""The bull: it looks around for something red, charges at it, and wanders if it sees nothing red, in the begin style.

The bull of the C# library elib turned by time alone, saw a third of its surroundings, pushed for ever once it had hit
something, and stood still for good after the first obstacle that it avoided.

Requests that do not depend on each other are begun together and ended one after another: the wheels' command and the
next picture or reading. Motions and pictures are slow; meanwhile ``run.wait_for`` checks whether the run is over. A
single quick request is made by a blocking call, which is a begin and its end in one.
"""

from __future__ import annotations

import math
from typing import Annotated

from elib.base.body import SENSOR_DIRECTIONS, camera_view
from elib.base.errors import ElibError
from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, states
from elib.behaviours._run.loop import SETUP_TIMEOUT
from elib.behaviours.avoid import STANDING
from elib.link.protocol.colours import Blob
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import Proximity, Wheels
from elib.robot.blocking import BlockingEpuck

Speed = Annotated[float, Quantity("speed", "rev/s", 0.1, 0.8, scale=1000)]
Red = Annotated[float, Quantity("red", "", 0.01, 0.9, scale=1000)]

SIDE, ZOOM = 40, 8
"""Width and height of the picture, pixels, and the zoom of the widest view (as in Elib of 2011)."""
VIEW = camera_view(SIDE, ZOOM)
"""Angle that this picture shows from left to right, rad."""
SCAN_PICTURES = 15
"""Pictures of one look around: each shows a fifteenth of a turn. The four of 2011 did not show three quarters of it."""
HYSTERESIS = 0.5
"""A charge ends below this share of the red that begins one; in 2011 it was 0.2 after 0.3. Without the difference, the
noise of a picture could end what another began."""
STEERING = 0.6
"""Difference of the wheels, as a share of the speed, for red at the picture's edge. At 0.4 rev/s the robot turns 18
degrees a second towards red that is 15 degrees off: slow enough for a picture that takes 0.7 s over a slow link."""
GROWTH = 1.1
"""The red must grow by this factor to show that the charge comes nearer."""
CHARGE_TIMEOUT = 5.0
"""s without growth after which a charge is over. The red fills the picture at 15 cm. From there the bull takes 1.5 s to
hit at 0.4 rev/s; the rest is pushing."""
BACKWARD = 0.06
"""m that it drives back then: enough room to turn beside what it hit."""

PERIOD = 0.1
"""s between two steps."""
BLOCKED = 600
"""Sum of the four front sensors from which it turns away: a wall 2.3 cm ahead, or a post 1 cm ahead. In 2011 this was
2000, at which the robot nearly touches the wall."""
CROWDED = 350
"""Counts of a sensor from which there is no way out in its direction: a wall 2 cm away. In 2011 this was 500."""
NOISE = 25
"""Counts by which two sensors that see nothing may differ, as in :mod:`~elib.behaviours.avoid`."""
SCAN_PROBABILITY = 0.03
"""Probability to look around again, for each step of wandering (as in Elib of 2011): every 4 s on average."""
MIN_WANDERING = 6.0
"""s of wandering before that, 20 cm on average: nothing new can be seen near the last place."""
PAUSE = 1.0
"""s between two readings while there is no way out."""


def aim(seen: Blob | None, *, red: float = 0.04) -> float | None:
    """Return the turn, rad, that brings the red ahead; None if there is too little red.

    Args:
        seen: The largest red area of the picture.
        red: Share of the picture that is enough.
    """
    return None if seen is None or seen.share < red else seen.bearing


def charge(seen: Blob, *, speed: float = 0.4) -> Wheels:
    """Return the wheels' speeds, rev/s, that lead into the red.

    Args:
        seen: The largest red area of the picture.
        speed: Speed of the faster wheel, rev/s.
    """
    bend = -STEERING * seen.bearing / (VIEW / 2)  # to the right if positive
    return Wheels(speed * (1 + min(0.0, bend)), speed * (1 - max(0.0, bend)))


def wander(near: Proximity, left: float, right: float) -> Wheels | None:
    """Return the speeds, rev/s, of a bull that sees nothing red; None if something is in front of it.

    Args:
        near: Readings of the infrared sensors.
        left: A random number from 0 to 1.
        right: A random number from 0 to 1.
    """
    if near.front_left + near.diagonal_left + near.front_right + near.diagonal_right > BLOCKED:
        return None
    return Wheels(0.1 + left / 3, 0.1 + right / 3)


def way_out(near: Proximity) -> float | None:
    """Return the turn, rad, to where there is most room; None if there is no room.

    It is the direction of the sensor that sees least. If several see nothing, it is the one that is furthest from the
    sensor that sees most, so the bull turns its back on a wall.
    """
    least = min(near)
    if least >= CROWDED:
        return None
    nearest = SENSOR_DIRECTIONS[near.index(max(near))]
    most = min(least + NOISE, CROWDED - 1)
    free = (angle for angle, count in zip(SENSOR_DIRECTIONS, near, strict=True) if count <= most)
    return max(free, key=lambda angle: abs(math.remainder(angle - nearest, math.tau)))


class Bull:
    """What the bull remembers, and its states, which each do one step and return the name of the next state.

    Args:
        speed: Speed of a charge, rev/s.
        red: Share of the picture that the red takes when a charge begins.
    """

    def __init__(self, speed: float, red: float) -> None:
        self._speed = speed
        self._red = red
        self._size = SIDE, SIDE
        self._pictures_left = 0
        self._best = 0.0
        self._grew_at = 0.0
        self._turn = 0.0
        self._wheels = STANDING
        self._open_air = OpenAir()
        self._scanned_at = -math.inf

    def waking(self, robot: BlockingEpuck, run: RunContext) -> str:
        """Set the camera."""
        self._set_camera(robot)
        first = run.wait_for(robot.begin.image())
        if first is not None and first.zoom != ZOOM:  # the e-puck2 takes 8 as 4: as wide a strip, of as many pixels
            self._size = SIDE * ZOOM // first.zoom, SIDE * first.zoom // ZOOM
            self._set_camera(robot)
        return "searching"

    def searching(self, robot: BlockingEpuck, run: RunContext) -> str | None:
        """Take a picture; charge if it is red, otherwise turn on to the next, or give up after the last."""
        if run.entered:
            self._pictures_left = SCAN_PICTURES
        if self._pictures_left == 0:
            self._scanned_at = robot.time
            return "wandering"
        picture = self._look(robot, run, STANDING)
        if picture is None:
            return None
        turn = aim(picture.find("red"), red=self._red)
        if turn is not None:
            run.wait_for(robot.begin.turn(turn))
            self._best, self._grew_at = 0.0, robot.time
            return "charging"
        run.wait_for(robot.begin.turn(math.tau / SCAN_PICTURES))
        self._pictures_left -= 1
        return None

    def charging(self, robot: BlockingEpuck, run: RunContext) -> str | None:
        """Drive to the red of the last picture, take another meanwhile, and go on as long as the red grows."""
        picture = self._look(robot, run, self._take_wheels())
        if picture is None:
            return None
        seen = picture.find("red")
        if seen is None or seen.share < HYSTERESIS * self._red:
            return "searching"
        if seen.share > GROWTH * self._best:
            self._best, self._grew_at = seen.share, robot.time
        if robot.time - self._grew_at > CHARGE_TIMEOUT:
            return "backing"
        self._wheels = charge(seen, speed=self._speed)
        return None

    def backing(self, robot: BlockingEpuck, run: RunContext) -> str:
        """Drive back from what was hit, and choose a random direction away from it."""
        run.wait_for(robot.begin.drive(-BACKWARD))
        self._turn = run.random.uniform(math.tau / 4, 3 * math.tau / 4)
        return "avoiding"

    def wandering(self, robot: BlockingEpuck, run: RunContext) -> str | None:
        """Drive at random speeds, and look around again from time to time."""
        wheels = self._take_wheels()
        chance = run.random
        if robot.time - self._scanned_at > MIN_WANDERING and chance.random() < SCAN_PROBABILITY:
            return "searching"
        driving = robot.begin.set_speed(*wheels)
        looking = robot.begin.proximity()
        driving.end()
        near = self._open_air(looking.end())
        onwards = wander(near, chance.random(), chance.random())
        if onwards is not None:
            self._wheels = onwards
            return None
        turn = way_out(near)
        if turn is None:
            return "stuck"
        self._turn = turn
        return "avoiding"

    def avoiding(self, robot: BlockingEpuck, run: RunContext) -> str:
        """Turn away, and wander on."""
        run.wait_for(robot.begin.turn(self._turn))
        return "wandering"

    def stuck(self, robot: BlockingEpuck) -> str | None:
        """Stand until there is a way out."""
        robot.set_speed(*STANDING)
        robot.sleep(PAUSE)
        return "wandering" if way_out(self._open_air(robot.proximity())) is not None else None

    def _set_camera(self, robot: BlockingEpuck) -> None:
        robot.within(SETUP_TIMEOUT).set_camera(*self._size, ZOOM, CameraMode.COLOUR)

    def _take_wheels(self) -> Wheels:
        """Return the speeds of the last step, once: after a lost answer the robot stands until the next reading."""
        wheels, self._wheels = self._wheels, STANDING
        return wheels

    def _look(self, robot: BlockingEpuck, run: RunContext, wheels: Wheels) -> Image | None:
        """Drive at these speeds and take a picture meanwhile; return None if the run is over."""
        driving = robot.begin.set_speed(*wheels)
        looking = robot.begin.image()
        try:
            driving.end()
        except ElibError:
            looking.cancel()  # otherwise the command to stop would wait for a picture that is not needed any more
            raise
        picture = run.wait_for(looking)
        if picture is not None and (picture.width, picture.height, picture.mode) != (*self._size, CameraMode.COLOUR):
            self._set_camera(robot)  # The robot restarted and lost its settings.
            return run.wait_for(robot.begin.image())
        return picture


@behaviour(world="red-boxes", reconnects=True, group="samples of 2011")
def run_at_red(robot: BlockingEpuck, run: RunContext, *, speed: Speed = 0.4, red: Red = 0.04) -> None:
    """Look for something red and charge at it, as a bull would.

    It takes 15 pictures around itself. If one is red enough, it turns there and charges, steering by more pictures.
    When the red has not come nearer for five seconds, because the bull pushes it or it stands firm, the bull drives
    back. If it sees nothing red, it wanders, turns away from obstacles, and looks around again from time to time.

    Args:
        robot: The bull.
        run: The run.
        speed: Speed of the charge.
        red: Share of the picture that red takes when a charge begins. 0.04 is a box of 8 cm more than a metre away, 0.3
            (as in 2011) one 40 cm away. Take more if the floor or the furniture is reddish.
    """
    bull = Bull(speed, red)
    machine = states(
        bull.waking,
        bull.searching,
        bull.charging,
        bull.backing,
        bull.wandering,
        bull.avoiding,
        bull.stuck,
        period=PERIOD,
    )
    machine(robot, run)
