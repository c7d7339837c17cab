"""What clients of Foxglove may publish for a robot: speeds, LEDs, and stop. Everything else is refused."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import Annotated

import msgspec
from msgspec import Meta

from elib.base.body import AXLE, WHEEL_CIRCUMFERENCE
from elib.base.errors import ArgumentError, ElibError
from elib.base.tasks import end_tasks
from elib.link.protocol.actuators import ALL
from elib.panel.slot import Slot

DRIVE, LEDS, STOP = "/drive", "/leds", "/stop"
CLIENT_TOPICS = (DRIVE, LEDS, STOP)
"""The topics that clients may publish, below the robot's own name."""
MAX_MESSAGE = 2048
"""Bytes of a message; a Twist with all its fields has 120."""
RING = 8
COLOUR_LEDS = (1, 3, 5, 7)
"""The ring LEDs of the e-puck2 that have a colour."""

Share = Annotated[float, Meta(ge=0, le=1)]


class Vector(msgspec.Struct, forbid_unknown_fields=True):
    """Three numbers, as in the messages of ROS."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Steering(msgspec.Struct, forbid_unknown_fields=True):
    """Speeds: of both wheels in m/s, or as a Twist: forwards in m/s and turning in rad/s, positive to the left."""

    left: float | None = None
    right: float | None = None
    linear: Vector | float | None = None
    angular: Vector | float | None = None

    def wheels(self) -> tuple[float, float]:
        """Return the speeds of the left and the right wheel, m/s."""
        if self.left is not None and self.right is not None and self.linear is None and self.angular is None:
            speeds = self.left, self.right
        elif self.linear is not None and self.angular is not None and self.left is None and self.right is None:
            ahead = self.linear.x if isinstance(self.linear, Vector) else self.linear
            turning = self.angular.z if isinstance(self.angular, Vector) else self.angular
            speeds = ahead - turning * AXLE / 2, ahead + turning * AXLE / 2
        else:
            raise ArgumentError("a message of /drive has left and right, or linear and angular")
        if not all(map(math.isfinite, speeds)):
            raise ArgumentError("a speed of /drive is not a finite number")
        return speeds


class Leds(msgspec.Struct, forbid_unknown_fields=True):
    """What LEDs show; what is left out stays."""

    # whether each of the eight LEDs of the ring is on, clockwise from the front
    ring: Annotated[list[bool], Meta(min_length=RING, max_length=RING)] | None = None
    body: bool | None = None  # whether the green light of the body is on
    front: bool | None = None  # whether the red light in front is on
    # red, green and blue, 0 to 1, of the LEDs 1, 3, 5 and 7 of an e-puck2
    colours: Annotated[list[tuple[Share, Share, Share]], Meta(min_length=4, max_length=4)] | None = None

    def commands(self) -> list[tuple[str, tuple[object, ...]]]:
        """Return the commands that show it."""
        found: list[tuple[str, tuple[object, ...]]] = []
        if self.ring is not None:
            if len(set(self.ring)) == 1:
                found.append(("set_led", (ALL, int(self.ring[0]))))
            else:
                found += [("set_led", (number, int(is_on))) for number, is_on in enumerate(self.ring)]
        if self.body is not None:
            found.append(("set_body_led", (int(self.body),)))
        if self.front is not None:
            found.append(("set_front_led", (int(self.front),)))
        if self.colours is not None:
            found += [("set_rgb_led", (n, *rgb)) for n, rgb in zip(COLOUR_LEDS, self.colours, strict=True)]
        return found


class Commands:
    """Carries out what clients publish for one robot, behind its drive lock.

    It tells *complain* why a message was refused, and an empty text when one was carried out.
    """

    def __init__(self, slot: Slot, complain: Callable[[str], object]) -> None:
        self._slot, self._complain = slot, complain
        self._wanted: Leds | None = None
        self._lighting: asyncio.Task[None] | None = None

    def hear(self, client: str, topic: str, data: bytes) -> None:
        """Carry out a message of a client, or complain."""
        try:
            if topic == STOP:
                self._slot.stop()
            elif topic == DRIVE:
                self._drive(client, msgspec.json.decode(data, type=Steering))
            else:
                self._light(client, msgspec.json.decode(data, type=Leds))
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
            self._complain(f"a message of {topic} was refused: {error}")
        except ElibError as error:
            self._complain(f"a message of {topic} was refused: {error.message}")

    def leave(self, client: str) -> None:
        """Note that a client publishes no speeds any more: if it drove, the robot stops now."""
        self._slot.drive.leave(client)

    async def close(self) -> None:
        """Send no more."""
        await end_tasks(self._lighting)

    def _drive(self, client: str, message: Steering) -> None:
        wheels = message.wheels()
        _ = self._slot.robot  # raises if it is not connected
        drive = self._slot.drive
        top = drive.limit * drive.fastest * WHEEL_CIRCUMFERENCE
        largest = max(map(abs, wheels))
        # Speeds above the limit keep their ratio, so the robot keeps its curve.
        scale = 0.0 if top == 0 else 1 / max(top, largest)
        if not drive.steer(client, wheels[0] * scale, wheels[1] * scale):
            raise ArgumentError(f"{self._slot.name} is driven by somebody else")
        self._complain("it stands until the stick is released: stop was pressed" if drive.is_latched else "")

    def _light(self, client: str, message: Leds) -> None:
        _ = self._slot.robot
        if self._slot.drive.driver not in ("", client):
            raise ArgumentError(f"{self._slot.name} is driven by somebody else")
        self._wanted = message
        if self._lighting is None or self._lighting.done():
            self._lighting = asyncio.get_running_loop().create_task(self._light_all(client), name="elib foxglove leds")

    async def _light_all(self, client: str) -> None:
        """Send the newest LEDs; messages that come meanwhile replace each other."""
        while (wanted := self._wanted) is not None:
            self._wanted = None
            try:
                for name, arguments in wanted.commands():
                    await self._slot.command(name, *arguments, page=client)
            except ElibError as error:
                self._complain(f"LEDs: {error.message}")
