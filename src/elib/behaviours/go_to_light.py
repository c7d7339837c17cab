"""Go to the light, and end beneath it. In the begin style.

After the sample Go2Light of the C# library elib, which leaned to the left in an even light, drove into what stood in
the way, never arrived, and lost the robot to its caller with the first reconnection. Here the link is reopened beneath
the same robot, whoever holds it.

Beneath a lamp it is dark all around: it hangs behind every one of the eight sensors, which look sideways. So a robot
whose light fails drives straight on. Where the lamp was, it comes to shine from behind, and the place beneath it is
half way back; where it does not, something only threw a shadow. There it looks once more: beneath a lamp there is
little light from the sides. Beside one, which shone from behind because the robot had turned, there is much.

Requests that do not depend on each other are begun together and ended one after another: both kinds of readings, or the
pose and the wheels' command. On the way back ``run.wait_for`` checks whether the run is over. A single request is made
by a blocking call, which is a begin and its end in one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react_blocking
from elib.behaviours.avoid import BLOCKED, STANDING, avoid
from elib.pose import Pose
from elib.protocol.values import AmbientLight, Proximity, Wheels
from elib.robot.blocking import BlockingEpuck, PendingCall

Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 0.8, scale=1000)]

FAINT = 60
"""Counts between the brightest and the darkest sensor that mean nothing. Each reading has a noise of 7 counts (Enki);
of eight in the dark, one set in a thousand lies further apart than 41."""
LEANING = 1.5
"""Bend for each unit of contrast between the sides. Light that comes from 30 degrees aside makes a contrast of 0.65:
the robot then turns about one wheel, as that of 2011 did for any light that was not straight ahead."""
FAILED = 0.5
"""Share of the brightest that was seen below which the light has failed. That of one lamp falls to two thirds in the
gaps between the sensors, and to a half 8 cm before one that hangs 9 cm higher than they do."""
LEAST = 0.25
"""Share of the brightest that the light behind must reach, however suddenly that ahead failed: noise would do else."""
BENEATH = 0.27
"""Share of the brightest that was ever seen which comes from the sides beneath a lamp, at most. Within 2 cm of its
middle it is 0.2 with another lamp a metre away, and nothing without one; 6 cm beside a lamp it is 0.28, 8 cm 0.4."""
NEAR_LAMP = 400
"""Counts that the light must have had to fail: a robot that has not seen more is far from any lamp."""
SLOWER = 0.5
"""Share of the cruise beneath the lamp."""
SHADOW = 0.25
"""m driven straight on without a light behind, after which it was a shadow."""
DETOUR = 0.12
"""m that it drives past an obstacle before it looks for the light again."""
PERIOD = 0.1
"""s between two looks, where the link is quick enough."""
QUICK = 0.2
"""s between two looks up to which it drives at full pace: at 0.5 rev/s it turns 14 degrees meanwhile. Slower looks make
a slower robot."""


def brightness(light: AmbientLight) -> list[int]:
    """Return how much brighter it is at each sensor than at the darkest of them, counts."""
    darkest = max(light)
    return [darkest - count for count in light]


def seek(light: AmbientLight, *, cruise: float = 0.5) -> Wheels | None:
    """Return the speeds, rev/s, that lead towards the light; None where it is the same on all sides.

    Light behind lets it turn about one wheel, to the side that is brighter. Light ahead lets it drive, and bend to the
    brighter side by the sides' contrast: how bright or how far the light is does not matter.

    Args:
        light: What the infrared sensors see.
        cruise: Speed of the faster wheel.
    """
    bright = brightness(light)
    if max(bright) < FAINT:
        return None
    right, left = sum(bright[:3]), sum(bright[5:])
    if bright[0] + bright[7] < bright[3] + bright[4]:
        is_left = left + bright[4] > right + bright[3]
        return Wheels(0.0, cruise) if is_left else Wheels(cruise, 0.0)
    bend = max(-1.0, min(1.0, LEANING * (left - right) / (left + right)))
    return Wheels(cruise * (1 - max(0.0, bend)), cruise * (1 + min(0.0, bend)))


def is_blocked(near: Proximity) -> bool:
    """Return whether something stands right in the way."""
    return max(near.front_left, near.front_right, near.diagonal_left // 2, near.diagonal_right // 2) > BLOCKED


State = Callable[[BlockingEpuck], "State"]


class Seeker:
    """What the robot remembers, and its states: each does one step and returns the next.

    A step whose answer is lost is taken again.

    Args:
        robot: The robot.
        run: Where it performs.
        cruise: Speed of the faster wheel, rev/s.

    Attributes:
        has_arrived: It stands beneath the lamp.
    """

    def __init__(self, robot: BlockingEpuck, run: RunContext, cruise: float) -> None:
        self.has_arrived = False
        self._robot = robot
        self._run = run
        self._cruise = cruise
        self._pace = 1.0
        self._seen = robot.time
        self._brightest = 0
        self._most = 0
        self._ahead = 0
        self._from = Pose(0.0, 0.0)
        self._wheels = STANDING

    def seeking(self, eyes: BlockingEpuck) -> State:
        """Drive towards the light, or straight on where there is none."""
        near, light = self._look(eyes)
        if is_blocked(near):
            return self._begin_detour(eyes)
        bright = brightness(light)
        ahead = max(bright[0], bright[7])
        if self._brightest > NEAR_LAMP and max(bright) < FAILED * self._brightest:
            self._ahead = max(ahead, round(LEAST * self._brightest))
            self._from = eyes.pose()
            return self.passing
        # What comes from aside or behind and fails is no lamp that the robot drives beneath.
        self._brightest = max(self._brightest, ahead) if ahead == max(bright) else 0
        self._most = max(self._most, *bright)
        wheels = seek(light, cruise=self._cruise)
        self._run.state("seeking" if wheels else "wandering")
        self._begin_to_drive(eyes, wheels or avoid(near, cruise=self._cruise)).end()
        return self.seeking

    def passing(self, eyes: BlockingEpuck) -> State:
        """Drive straight on until the light shines from behind as it did from ahead; then go half way back."""
        self._run.state("passing")
        near, light = self._look(eyes)
        way = _distance(self._from, eyes.pose())
        if is_blocked(near) or way > SHADOW:
            self._brightest = 0
            return self.seeking
        bright = brightness(light)
        behind = max(bright[3], bright[4])
        if behind >= max(self._ahead, bright[0], bright[7]):
            return self.passing if self._run.wait_for(self._robot.begin.drive(-way / 2)) is None else self.arriving
        self._begin_to_drive(eyes, Wheels(SLOWER * self._cruise, SLOWER * self._cruise)).end()
        return self.passing

    def arriving(self, eyes: BlockingEpuck) -> State:
        """Look whether a lamp is overhead; where none is, seek on."""
        _, light = self._look(eyes)
        self.has_arrived = max(brightness(light)) < BENEATH * self._most
        if self.has_arrived:
            self._run.state("arrived")
        self._brightest = 0
        return self.seeking

    def avoiding(self, eyes: BlockingEpuck) -> State:
        """Drive past what stood in the way."""
        self._run.state("avoiding")
        before, self._wheels = self._wheels, STANDING  # after a lost answer it stands
        near, _ = self._look(eyes)
        wheels = avoid(near, before, cruise=self._cruise)
        placing = eyes.begin.pose()
        driving = self._begin_to_drive(eyes, wheels)
        place = placing.end()
        driving.end()
        self._wheels = wheels
        return self.seeking if _distance(self._from, place) > DETOUR else self.avoiding

    def _begin_detour(self, eyes: BlockingEpuck) -> State:
        self._brightest, self._wheels = 0, STANDING
        self._from = eyes.pose()
        return self.avoiding

    def _look(self, eyes: BlockingEpuck) -> tuple[Proximity, AmbientLight]:
        """Read the sensors, and fit the pace to the time from one look to the next."""
        looking, sensing = eyes.begin.proximity(), eyes.begin.ambient_light()
        near, light = looking.end(), sensing.end()
        self._pace = min(1.0, QUICK / max(light.time - self._seen, PERIOD))
        self._seen = light.time
        return near, light

    def _begin_to_drive(self, eyes: BlockingEpuck, wheels: Wheels) -> PendingCall[None]:
        return eyes.begin.set_speed(self._pace * wheels.left, self._pace * wheels.right)


def _distance(start: Pose, end: Pose) -> float:
    return math.hypot(end.x - start.x, end.y - start.y)


@behaviour(world="light", reconnects=True)
def go_to_light(robot: BlockingEpuck, run: RunContext, *, cruise: Cruise = 0.5) -> None:
    """Go to the light, round what stands in the way, and end beneath the lamp.

    Where it sees no light it drives about until it does.

    Args:
        robot: The robot.
        run: Where it performs.
        cruise: Speed of the faster wheel.
    """
    seeker = Seeker(robot, run, cruise)
    act: State = seeker.seeking

    def step(eyes: BlockingEpuck) -> bool:
        nonlocal act
        act = act(eyes)
        return seeker.has_arrived

    react_blocking(robot, run, step, period=PERIOD)
    if seeker.has_arrived:
        run.say("the light is overhead")
