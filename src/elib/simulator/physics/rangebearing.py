"""Range and bearing: robots that hear each other by infrared light, and from which distance and direction.

The model of a board on top of each robot, like the e-RandB of the e-puck: twelve infrared emitters and receivers around
it. Ten times a second each board sends a short message in all directions. A robot that hears it knows how far away and
in which direction its sender is. It does not know who that is, unless the message says so.

What sources say of the e-RandB, and what is modelled:

* Message: 2 bytes with GCtronic's firmware (its wiki, registers 13 and 14), 4 with DEMIURGE's (argos3-epuck). Here up
  to :data:`MAX_MESSAGE`; a board repeats it until it is given another one.
* Reach: about 1 m at full power, depending on the light in the room (examples of pi-puck); measured from 0 to 0.8 m
  between two robots' edges (argos3-epuck). Here :data:`REACH`.
* Rate: a robot receives up to 5 messages in a control step of 0.1 s (argos3-epuck). Here the same; messages do not
  collide, but of more than 5 in :data:`PERIOD` the others are lost.
* Bearing: a count of 0.0001 (GCtronic's wiki) rad (its header e_randb.h; the wiki says degrees, but 16 bits of these
  steps are a turn in rad), which the board calculates from its receivers, 30 degrees apart. Here the same steps; no
  source gives the error, so :data:`BEARING_DEVIATION` is chosen.
* Distance: follows from the power, a count of 12 bits, and its maker does not call it accurate (mailing list
  e-puck-user, 2012). By the figures in argos3-epuck a single message may be wrong by a factor of two, and beyond 0.3 m
  the power hardly changes. :data:`DISTANCE_DEVIATION` is chosen and much better than that: try a world with
  ``sensor_noise = 5`` too.
* Loss: no source gives it over the distance, so :func:`loss` is chosen. Nothing is lost within the reach where the
  world has no sensor noise.
* The infrared sensors of the e-puck can send messages as well (libIrcom), less far and more slowly. That is not
  modelled: a robot here has only the board.
* Line of sight: walls, boxes, posts and robots hide what is behind them if they are higher than :data:`HEIGHT`. Light
  that walls reflect is not modelled.

Nothing happens before somebody asks, and then the answer is worked out from the poses at that tick. The noise is looked
up by seed, receiver, sender and number of the message (``noise``): so nothing depends on who asks when,
how often or in which order.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from elib.base.errors import ArgumentError
from elib.simulator.physics.geometry import segment_distance
from elib.simulator.physics.neighbours import EDGE
from elib.simulator.physics.noise import BOARD_PHASE, PAIR, bits, gauss, tick_key, uniform
from elib.simulator.physics.state import State

MAX_MESSAGE: Final = 4
"""bytes."""

PERIOD: Final = 0.1
"""s between two messages of a board. Each board begins at another time."""

MAX_HEARD: Final = 5
"""Messages that a board receives in a period."""

REACH: Final = 0.8
"""m between the middles of two robots. Nothing is heard from farther away."""

HEIGHT: Final = 0.055
"""m. The board is on top of the body, which is 50 mm high (e-puck.md, 1): lower things do not hide it."""

DISTANCE_DEVIATION: Final = 0.15
"""Noise of a distance, as a part of it. Chosen."""

BEARING_DEVIATION: Final = 0.1
"""Noise of a bearing, rad: 6 degrees, a fifth of the angle between two receivers. Chosen."""

DISTANCE_STEP, BEARING_STEP = 0.001, 0.0001
"""m and rad. A distance is rounded far below its noise; a bearing is sent in such steps (GCtronic's wiki)."""

MARGIN: Final = 1e-6
"""m2. Rounding must not leave out what is between two robots."""

MIN_LOSS: Final = 0.05
"""Share of the messages that is lost side by side. Chosen."""

# Channels of one message from one robot to another.
LOST, DISTANCE, BEARING, ORDER = range(4)


class Heard(NamedTuple):
    """The newest message of another robot."""

    distance: float  # from the middle of this robot to the middle of the other one, m
    bearing: float  # where the other one is, rad, 0 ahead, positive to the left
    message: bytes  # what it said
    time: float  # when it was heard, s since the start of the world


def check_message(message: object) -> None:
    """Check what a board is told to say.

    Raises:
        ArgumentError: The message is not bytes, or too long.
    """
    if not isinstance(message, bytes | bytearray):
        raise ArgumentError(f"the message is {message!r}; it must be bytes", hint='write b"text" or bytes([1, 2])')
    if len(message) > MAX_MESSAGE:
        raise ArgumentError(f"the message has {len(message)} bytes; a robot sends at most {MAX_MESSAGE}")


def loss(distance: float) -> float:
    """Return the share of the messages that is lost over a *distance*, m.

    It rises with the fourth power of the distance: 5 % side by side, 11 % at 0.4 m, 35 % at 0.6 m, all at 0.8 m.
    """
    return MIN_LOSS + (1.0 - MIN_LOSS) * min(distance / REACH, 1.0) ** 4


class Around(NamedTuple):
    """What may hide boards from a robot's board, and how far in x and y it is from there, m."""

    walls: list[tuple[float, float, float, float, float]]  # Where the robot is from one end; direction; length.
    discs: list[tuple[float, float, float]]  # Where it is; radius. The first ones are the robots that may be heard.


def is_hidden(around: Around, sender: int) -> bool:
    """Return whether something between the middles of a robot and of another one hides their boards from each other."""
    dx, dy, _ = around.discs[sender]
    for from_x, from_y, tangent_x, tangent_y, length in around.walls:
        # How far the two robots are to the left of the wall's line.
        side = tangent_x * from_y - tangent_y * from_x
        other_side = side + tangent_x * dy - tangent_y * dx
        if side * other_side >= 0.0:
            continue
        share = side / (side - other_side)
        along = tangent_x * (from_x + share * dx) + tangent_y * (from_y + share * dy)
        if 0.0 <= along <= length:
            return True
    distance = math.hypot(dx, dy)
    for k, (x, y, radius) in enumerate(around.discs):
        # Most are beside the whole line, which costs less to ask.
        is_near_line = abs(x * dy - y * dx) < radius * distance + MARGIN
        if is_near_line and k != sender and segment_distance(x, y, 0.0, 0.0, dx, dy) < radius:
            return True
    return False


class RangeAndBearing:
    """The boards of all robots of one world."""

    def __init__(self, state: State) -> None:
        self._state = state
        self._said: dict[int, list[tuple[float, bytes]]] = {}

    def forget(self) -> None:
        """Forget all messages, for a new run."""
        self._said.clear()

    def send(self, robot: int, message: bytes, at: float) -> None:
        """Let a robot's board repeat *message* from now on.

        Args:
            robot: Index.
            message: At most 4 bytes.
            at: Now, s since the start. The messages after that time carry it.

        Raises:
            ArgumentError: The message is not bytes, or too long.
        """
        check_message(message)
        said = self._said.setdefault(robot, [])
        said.append((max(at, said[-1][0]) if said else at, bytes(message)))
        # What was replaced before the last message that was sent is never looked up again.
        while len(said) > 1 and said[1][0] < self._now - PERIOD:
            del said[0]

    def heard(self, robot: int) -> list[Heard]:
        """Return the newest message of every robot that *robot* hears, the nearest first.

        A message is the newest one until its sender sends the next one, a tenth of a second later; if it was lost, its
        sender is missing meanwhile.
        """
        world = self._state.world
        robots = self._state.engine.tuples(world.robots, "x", "y", "radius", "key", "heading_x", "heading_y")
        x, y, _, own_key, cosine, sine = robots[robot]
        now, noise, senders, around = self._now, float(world.setting[0].sensor_noise), [], Around([], [])
        for sender, (other_x, other_y, radius, other_key, *_) in enumerate(robots):
            dx, dy = other_x - x, other_y - y
            distance = math.hypot(dx, dy)
            if distance < REACH + radius and sender != robot:
                around.discs.append((dx, dy, radius))
                senders.append((sender, other_key, dx, dy, distance))
        self._add_obstacles(around, x, y)
        found: list[tuple[int, Heard]] = []
        for place, (sender, other_key, dx, dy, distance) in enumerate(senders):
            if distance >= REACH:
                continue
            phase = uniform(other_key, BOARD_PHASE)
            number = math.floor(now / PERIOD - phase)
            key = tick_key(bits(own_key, PAIR + sender), number)
            if number < 0 or (noise > 0.0 and uniform(key, LOST) < loss(distance)) or is_hidden(around, place):
                continue
            bearing = math.atan2(dy * cosine - dx * sine, dx * cosine + dy * sine)
            bearing += noise * BEARING_DEVIATION * gauss(key, BEARING)
            distance *= max(1.0 + noise * DISTANCE_DEVIATION * gauss(key, DISTANCE), 0.0)
            time = (number + phase) * PERIOD
            reading = Heard(
                round(round(distance / DISTANCE_STEP) * DISTANCE_STEP, 3),
                round(round(math.remainder(bearing, math.tau) / BEARING_STEP) * BEARING_STEP, 4),
                self._message(sender, time),
                time,
            )
            found.append((bits(key, ORDER), reading))
        if len(found) > MAX_HEARD:
            found = sorted(found, key=lambda each: each[0])[:MAX_HEARD]
        return sorted((reading for _, reading in found), key=lambda each: each.distance)

    def _add_obstacles(self, around: Around, x: float, y: float) -> None:
        """Add walls and posts that are as high as a board, for a robot at (x, y), m."""
        world, tuples = self._state.world, self._state.engine.tuples
        for wall_x, wall_y, *line, height in tuples(
            world.walls[EDGE:], "x", "y", "tangent_x", "tangent_y", "length", "height"
        ):
            if height >= HEIGHT:
                around.walls.append((x - wall_x, y - wall_y, *line))
        for disc_x, disc_y, radius, height in tuples(world.discs, "x", "y", "radius", "height"):
            if height >= HEIGHT:
                around.discs.append((disc_x - x, disc_y - y, radius))

    @property
    def _now(self) -> float:
        setting = self._state.world.setting[0]
        return float(setting.tick * setting.step)

    def _message(self, sender: int, time: float) -> bytes:
        """Return what a robot's board said at *time*, s; nothing before it was given a message."""
        for since, message in reversed(self._said.get(sender, ())):
            if since < time:
                return message
        return b""
