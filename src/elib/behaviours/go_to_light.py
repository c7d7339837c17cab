"""Go to the light, and stop under it, in the begin style.

The sample Go2Light of the C# library elib turned to the left in even light, drove into obstacles, never arrived, and
made a new robot object when it reconnected, which its caller did not have. Here the link of the same object is
reopened.

Under a lamp all eight sensors read dark, because they look sideways. So when the light in front fails, the robot drives
straight on. If there was a lamp, its light then comes from behind, and the place under it is half way back. Otherwise
it was only a shadow. Half way back the robot checks once more: under a lamp there is little light from the sides.
Beside a lamp, whose light came from behind because the robot had turned, there is much.

Requests that do not depend on each other are begun together and ended one after another: both kinds of readings, or the
pose and the wheels' command. On the way back ``run.wait_for`` checks whether the run is over. A single request is made
by a blocking call, which is a begin and its end in one.
"""

from __future__ import annotations

from typing import Annotated

from elib.base.pose import Pose, apart
from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, states
from elib.behaviours.avoid import BLOCKED, STANDING, avoid
from elib.link.protocol.styles import Pending
from elib.link.protocol.values import AmbientLight, Proximity, Wheels
from elib.robot.blocking import BlockingEpuck

Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 0.8, scale=1000)]

FAINT = 150
"""Difference between the brightest and the darkest sensor that is ignored, counts. The sensors of typical robots differ
by 30 counts in the dark; in one robot of two hundred, two of the eight differ by more than this."""
STEERING = 1.5
"""Turn for each unit of contrast between the sides. Light from 30 degrees aside makes a contrast of 0.65. The robot
then turns about one wheel, as the one of 2011 did for any light that was not straight ahead."""
FAILED = 0.5
"""The light has failed below this share of the brightest reading. The light of one lamp falls to two thirds in the gaps
between the sensors, and to a half 8 cm in front of a lamp that hangs 9 cm above them."""
MIN_LIGHT = 0.25
"""The light behind must reach this share of the brightest reading, even if the light ahead failed suddenly. Otherwise
noise would be enough."""
UNDER_LAMP = 0.27
"""Light from the sides under a lamp, at most, as a share of the brightest reading of the run. Within 2 cm of its centre
it is 0.2 with another lamp a metre away, and 0 without one; 6 cm beside a lamp it is 0.28, and 8 cm beside it 0.4."""
NEAR_LAMP = 400
"""Counts that the light must have had before it can fail: a robot that has not seen more is far from any lamp."""
SLOWER = 0.5
"""Share of the cruising speed near the lamp."""
SHADOW = 0.25
"""m driven straight on without light from behind, after which it was a shadow."""
DETOUR = 0.12
"""m that the robot drives past an obstacle before it looks for the light again."""
PERIOD = 0.1
"""s between two steps, if the link is quick enough."""
QUICK = 0.2
"""s between two readings up to which the robot drives at full pace: at 0.5 rev/s it turns 14 degrees meanwhile. If the
readings come more slowly, it drives more slowly."""


def brightness(light: AmbientLight) -> list[int]:
    """Return how much brighter it is at each sensor than at the darkest one, counts."""
    darkest = max(light)
    return [darkest - count for count in light]


def seek(light: AmbientLight, *, cruise: float = 0.5) -> Wheels | None:
    """Return the speeds, rev/s, that lead towards the light; None if it is the same on all sides.

    If the light is behind, the robot turns about one wheel, to the brighter side. If it is ahead, the robot drives, and
    turns to the brighter side by the contrast of the sides: the light's power and distance do not matter.

    Args:
        light: What the infrared sensors read of the room's light.
        cruise: Speed of the faster wheel.
    """
    bright = brightness(light)
    if max(bright) < FAINT:
        return None
    right, left = sum(bright[:3]), sum(bright[5:])
    if bright[0] + bright[7] < bright[3] + bright[4]:
        is_left = left + bright[4] > right + bright[3]
        return Wheels(0.0, cruise) if is_left else Wheels(cruise, 0.0)
    bend = max(-1.0, min(1.0, STEERING * (left - right) / (left + right)))
    return Wheels(cruise * (1 - max(0.0, bend)), cruise * (1 + min(0.0, bend)))


def is_blocked(near: Proximity) -> bool:
    """Return whether an obstacle is right in front."""
    return max(near.front_left, near.front_right, near.diagonal_left // 2, near.diagonal_right // 2) > BLOCKED


class Seeker:
    """What the robot remembers, and its states, which each do one step and return the name of the next state.

    Args:
        cruise: Speed of the faster wheel, rev/s.
        time: When it begins, s on the robot's clock.
    """

    def __init__(self, cruise: float, time: float) -> None:
        self._cruise = cruise
        self._pace = 1.0
        self._read_at = time
        self._brightest = 0
        self._brightest_ever = 0
        self._light_ahead = 0
        self._start = Pose(0.0, 0.0)
        self._wheels = STANDING
        self._open_air = OpenAir()

    def seeking(self, robot: BlockingEpuck) -> str | None:
        """Drive towards the light until it fails."""
        near, light = self._read(robot)
        if is_blocked(near):
            self._start = robot.pose()
            return "avoiding"
        bright = brightness(light)
        ahead = max(bright[0], bright[7])
        if self._brightest > NEAR_LAMP and max(bright) < FAILED * self._brightest:
            self._light_ahead = max(ahead, round(MIN_LIGHT * self._brightest))
            self._start = robot.pose()
            return "passing"
        return None if self._drive_on(robot, near, light) else "wandering"

    def wandering(self, robot: BlockingEpuck) -> str | None:
        """Drive anywhere until there is light."""
        near, light = self._read(robot)
        if is_blocked(near):
            self._start = robot.pose()
            return "avoiding"
        return "seeking" if self._drive_on(robot, near, light) else None

    def passing(self, robot: BlockingEpuck, run: RunContext) -> str | None:
        """Drive straight on until the light from behind is as bright as it was ahead; then go half way back."""
        near, light = self._read(robot)
        way = apart(self._start, robot.pose())
        if is_blocked(near) or way > SHADOW:
            self._brightest = 0
            return "seeking"
        bright = brightness(light)
        behind = max(bright[3], bright[4])
        if behind >= max(self._light_ahead, bright[0], bright[7]):
            return None if run.wait_for(robot.begin.drive(-way / 2)) is None else "arriving"
        self._begin_driving(robot, Wheels(SLOWER * self._cruise, SLOWER * self._cruise)).end()
        return None

    def arriving(self, robot: BlockingEpuck) -> str:
        """Check whether a lamp is overhead; if not, go on seeking."""
        _, light = self._read(robot)
        self._brightest = 0
        return "arrived" if max(brightness(light)) < UNDER_LAMP * self._brightest_ever else "seeking"

    def arrived(self, robot: BlockingEpuck, run: RunContext) -> str:
        """Say so, and end."""
        run.say("the light is overhead")
        return "end"

    def avoiding(self, robot: BlockingEpuck, run: RunContext) -> str | None:
        """Drive past the obstacle."""
        if run.entered:
            self._brightest, self._wheels = 0, STANDING
        before, self._wheels = self._wheels, STANDING  # after a lost answer the robot stands
        near, _ = self._read(robot)
        wheels = avoid(near, before, cruise=self._cruise)
        placing = robot.begin.pose()
        driving = self._begin_driving(robot, wheels)
        place = placing.end()
        driving.end()
        self._wheels = wheels
        return "seeking" if apart(self._start, place) > DETOUR else None

    def _read(self, robot: BlockingEpuck) -> tuple[Proximity, AmbientLight]:
        """Read the sensors, and adapt the pace to the time between two readings."""
        looking, sensing = robot.begin.proximity(), robot.begin.ambient_light()
        near, light = self._open_air(looking.end()), sensing.end()
        self._pace = min(1.0, QUICK / max(light.time - self._read_at, PERIOD))
        self._read_at = light.time
        return near, light

    def _drive_on(self, robot: BlockingEpuck, near: Proximity, light: AmbientLight) -> bool:
        """Drive towards the light, or wander if it is the same on all sides; return whether there is light."""
        bright = brightness(light)
        ahead = max(bright[0], bright[7])
        # A light from aside or behind that fails is not a lamp that the robot drives under.
        self._brightest = max(self._brightest, ahead) if ahead == max(bright) else 0
        self._brightest_ever = max(self._brightest_ever, *bright)
        wheels = seek(light, cruise=self._cruise)
        self._begin_driving(robot, wheels or avoid(near, cruise=self._cruise)).end()
        return wheels is not None

    def _begin_driving(self, robot: BlockingEpuck, wheels: Wheels) -> Pending[None]:
        return robot.begin.set_speed(self._pace * wheels.left, self._pace * wheels.right)


@behaviour(world="light", reconnects=True, group="samples of 2011")
def go_to_light(robot: BlockingEpuck, run: RunContext, *, cruise: Cruise = 0.5) -> None:
    """Go to the light, round obstacles, and stop under the lamp.

    If it sees no light, it wanders until it does.

    Args:
        robot: The robot.
        run: The run.
        cruise: Speed of the faster wheel.
    """
    seeker = Seeker(cruise, robot.time)
    machine = states(
        seeker.seeking,
        seeker.wandering,
        seeker.passing,
        seeker.arriving,
        seeker.arrived,
        seeker.avoiding,
        period=PERIOD,
    )
    machine(robot, run)
