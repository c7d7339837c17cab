"""The tools of an agent: what each one is called, which parameters it has, and what it does."""

from __future__ import annotations

import asyncio
import base64
import dataclasses
import io
import math
from collections.abc import Mapping

from elib.base.body import AXLE
from elib.base.errors import ArgumentError, ElibError
from elib.doors.agent.driver import FRONT, OBSTACLE, REAR, SLACK, CallRefused, Driver, Outcome, approach, is_near
from elib.doors.agent.limits import Budget, Limits
from elib.doors.agent.tool import Json, Parameter, Result, Tool
from elib.link.protocol import values as v
from elib.link.protocol.colours import Hue
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.panel.behaviours import catalogue
from elib.panel.panel import Panel
from elib.panel.slot import Slot
from elib.panel.watching import virtual
from elib.robot.motion import TURN_RATE

PICTURE = (40, 40)
"""Columns and rows of a picture: 3,200 bytes, 0.3 s at 115,200 baud."""
WIDEST = 12
"""Sensor pixels for one pixel of it, where every factor works: 480, the whole chip of an e-puck1, which lies on its
side."""
ENLARGED = 8
"""Times that a picture is enlarged: 40 pixels are too few for the eyes of most models."""
MAX_BEHAVIOUR = 60.0
"""s that one call may run a behaviour."""
SLOWEST = 0.005
"""m/s."""
SLOWEST_TURN = 5.0
"""degrees/s."""
WORDS = ((1000, "touching"), (OBSTACLE, "about 2 cm away"), (100, "near"))
"""Counts of an infrared sensor above those in the open, from which on a word holds; a dark thing has fewer."""
CLEAR = "clear"


class Tools:
    """The tools of one agent on the robots of a panel.

    Args:
        panel: Holds the robots; those that are added later are a person's, and not the agent's.
        limits: What the agent may do.

    Attributes:
        drivers: The agent's robots by key.
        budget: What is left.
    """

    def __init__(self, panel: Panel, limits: Limits) -> None:
        self.limits = limits
        self.budget = Budget(limits)
        self.drivers = {key: Driver(slot, limits, self.budget) for key, slot in panel.slots.items()}
        self._cameras: dict[str, object] = {}
        self.tools = {tool.name: tool for tool in self._table()}

    def _table(self) -> list[Tool]:
        fence, top = self.limits.fence, self.limits.speed
        fastest_turn = math.floor(math.degrees(2 * top / AXLE))
        keys = tuple(self.drivers)
        robot = Parameter("Which robot: its key of the tool robots.", "string", default=keys[0], choices=keys)
        everyone = dataclasses.replace(robot, about="Which robot; all stops every robot.", choices=(*keys, "all"))
        speed = Parameter(f"Speed in m/s, up to {top:g}.", low=SLOWEST, high=top, default=min(0.064, top))
        turning = Parameter(
            f"Turn rate in degrees per second, up to {fastest_turn}.",
            low=SLOWEST_TURN,
            high=float(fastest_turn),
            default=float(min(round(math.degrees(TURN_RATE)), fastest_turn)),
        )
        stopping = Parameter(
            f"Stop when an infrared sensor on the side of travel shows {OBSTACLE} counts more than in the open: about 2"
            " cm from a white or red thing. Black and blue things are seen later or never.",
            "boolean",
            default=True,
        )
        names = {each.name: each for each in catalogue() if not each.elsewhere}
        behaviours = "; ".join(f"{name}: {each.summary}" for name, each in names.items())
        metre = f"The fence is {fence:g} m."
        return [
            Tool("robots", "List the robots", "List the robots and their state. Free.", self.robots, {}, True, True),
            Tool(
                "status",
                "State of a robot",
                "Tell where the robot is by its odometry (x ahead and y to the left of its start in m, heading in "
                "degrees, positive to the left; how far that may be wrong, if it may), what fence and budget leave, "
                "whether it is connected, who drives, and whether a person has stopped it. Free.",
                self.status,
                {"robot": robot},
                True,
                True,
            ),
            Tool(
                "read_all",
                "Read all sensors",
                "Read all sensors once, with their units. The robot does not move.",
                self.read_all,
                {"robot": robot},
                True,
            ),
            Tool(
                "look",
                "Take a picture",
                "Take one colour picture with the camera, which looks straight ahead, and return it with the pose "
                "where it was taken and the direction of the largest thing of each colour, degrees, positive to the "
                "left. The robot does not move.",
                self.look,
                {"robot": robot},
                True,
            ),
            Tool(
                "drive",
                "Drive straight",
                "Drive straight on, then stand. It ends early at an obstacle, at the fence, at the end of the budget "
                f"or when a person stops the robot; the result says why. {metre}",
                self.drive,
                {
                    "distance": Parameter(
                        "Distance in m, negative is backwards.", low=-2 * fence, high=2 * fence, is_required=True
                    ),
                    "speed": speed,
                    "stop_at_obstacle": stopping,
                    "robot": robot,
                },
            ),
            Tool(
                "turn",
                "Turn on the spot",
                "Turn on the spot, then stand.",
                self.turn,
                {
                    "angle": Parameter(
                        "Angle in degrees, positive to the left.", low=-360.0, high=360.0, is_required=True
                    ),
                    "speed": turning,
                    "robot": robot,
                },
            ),
            Tool(
                "go_to",
                "Go to a place",
                "Turn towards a place, drive there in a straight line, then stand. It does not drive round obstacles. "
                f"{metre}",
                self.go_to,
                {
                    "x": Parameter("Place ahead of the start in m.", low=-fence, high=fence, is_required=True),
                    "y": Parameter("Place to the left of the start in m.", low=-fence, high=fence, is_required=True),
                    "speed": speed,
                    "stop_at_obstacle": stopping,
                    "robot": robot,
                },
            ),
            Tool(
                "set_leds",
                "Set the LEDs",
                "Switch LEDs on or off; those that are left out stay as they are. A stop switches the ring off.",
                self.set_leds,
                {
                    "ring": Parameter("The 8 red LEDs of the ring, clockwise from the front: on or off.", "array"),
                    "body": Parameter("The green LEDs in the body.", "boolean"),
                    "front": Parameter("The bright red LED in front.", "boolean"),
                    "robot": robot,
                },
            ),
            Tool(
                "run_behaviour",
                "Run a behaviour",
                "Run one of elib's behaviours for some seconds, then stand. Speed limit and fence hold; near the fence "
                f"it ends. The behaviours: {behaviours}",
                self.run_behaviour,
                {
                    "name": Parameter(
                        "Name of the behaviour.", "string", choices=tuple(map(str, names)), is_required=True
                    ),
                    "seconds": Parameter(
                        "How long it runs in s.", low=0.5, high=min(MAX_BEHAVIOUR, self.limits.seconds), default=5.0
                    ),
                    "parameters": Parameter(
                        "Its own options by name; a wrong one is answered with its rule.", "object"
                    ),
                    "robot": robot,
                },
            ),
            Tool(
                "stop",
                "Stop at once",
                "Stop the robot at once, whatever it does, and end the call that moves it. Always allowed, and free.",
                self.stop,
                {"robot": everyone},
                is_free=True,
            ),
        ]

    # -- calls --

    async def call(self, tool: Tool, arguments: Mapping[str, object]) -> Result:
        """Carry out a call with checked arguments; an error of a robot becomes a result that says so."""
        if not tool.is_free and not self.budget.spend_call():
            refusal = Outcome("budget", "no calls are left", "report to the person what was found", began=False)
            return self._acted(str(arguments.get("robot", next(iter(self.drivers)))), refusal)
        try:
            return await tool.call(**arguments)
        except CallRefused as refusal:
            return self._acted(str(arguments["robot"]), refusal.outcome)
        except ArgumentError as error:
            return wrong(error)
        except ElibError as error:
            key = str(arguments["robot"])
            state = self._state(key)
            hint = error.hint or "call status until the robot is connected, then try again"
            text = f"{tool.name} failed: {error.message}; {state}. Try: {hint}"
            return Result(
                {"ended": "link", "message": error.message, "hint": hint, "state": state}, text, is_error=True
            )

    def cancel(self, arguments: Mapping[str, object], task: asyncio.Task[Result]) -> None:
        """Stop the robot of a call whose caller is gone or has cancelled it, if that call moves it."""
        driver = self.drivers[str(arguments["robot"])]
        if driver.mover is task:
            driver.end("cancelled")

    def _state(self, key: str) -> str:
        slot = self.drivers[key].slot
        if not slot.drive.may_move:
            return "the robot stands" if slot.is_connected else f"the robot is {slot.phase.value}, and stood before"
        return "the robot may still be moving; the stop is repeated until it confirms"

    # -- what does not move --

    async def robots(self) -> Result:
        """List the robots."""
        found: list[Json] = []
        lines = []
        for key, driver in self.drivers.items():
            slot = driver.slot
            kind = "virtual" if _is_virtual(slot) else "real"
            found.append(
                {"robot": key, "name": slot.name, "kind": kind, "firmware": slot.firmware, "state": slot.phase.value}
            )
            lines.append(f"robot {key}: {slot.name}, {kind}, {slot.firmware or 'firmware unknown'}, {slot.phase.value}")
        return Result({"robots": found}, "\n".join(lines))

    async def status(self, robot: str) -> Result:
        """Tell the state of a robot."""
        driver = self.drivers[robot]
        slot = driver.slot
        if slot.drive.is_driven_by_hand:
            who = "a person"
        elif driver.busy:
            who = f"you: {driver.busy}"
        elif slot.runner.is_active and not driver.is_latched:
            who = f"a person runs {slot.runner.name}"
        else:
            who = "no client"
        data: dict[str, Json] = {
            "robot": robot,
            "connected": slot.phase.value == "connected",
            "state": slot.phase.value,
            "pose": pose_of(driver),
            "fence": {
                "radius": self.limits.fence,
                "distance_from_start": round(driver.distance, 3),
                "ahead": round(driver.way_to_fence(), 3),
                "behind": round(driver.way_to_fence(backwards=True), 3),
            },
            "speed_limit": self.limits.speed,
            "budget": self._budget(),
            "drives": who,
            "stopped_by_person": driver.is_latched,
            "stands": not slot.drive.may_move,
            "proximity": {
                name: count for name, (count, _) in _nearness(driver.near(slot.readings.get("proximity"))).items()
            },
        }
        if slot.error is not None and not slot.is_connected:
            data["message"] = slot.error.message
        pose = driver.pose
        text = (
            f"Robot {robot} is {slot.phase.value} at x {pose.x:.3f} m, y {pose.y:.3f} m, heading "
            f"{math.degrees(pose.heading):.0f} degrees; {'it stands' if not slot.drive.may_move else 'it moves'}. "
            f"{who} drives. Fence: {driver.way_to_fence():.2f} m ahead, {driver.way_to_fence(backwards=True):.2f} m "
            f"behind. Left: {self.budget.calls} calls, {self.budget.seconds:.0f} s of driving."
        )
        if driver.is_latched:
            text += " A person stopped the robot: ask the person to press Continue on its page."
        return Result(data, text)

    async def read_all(self, robot: str) -> Result:
        """Read all sensors."""
        driver = self.drivers[robot]
        sensors = await driver.slot.robot.sensors()
        found: dict[str, Json] = {}
        lines = []
        for info in v.describe(v.Sensors, v.Role.NUMBER):
            reading = getattr(sensors, info.name)
            if not isinstance(reading, v.Reading):
                continue
            values, units, said = _reading(reading)
            found[info.name] = {**values, "units": units}
            lines.append(f"{info.words}: {said}")
        lines.append(_seen(_nearness(driver.near(sensors.proximity))))
        data: dict[str, Json] = {"robot": robot, "pose": pose_of(driver), "sensors": found}
        return Result(data, "\n".join(lines))

    async def look(self, robot: str) -> Result:
        """Take a picture."""
        driver = self.drivers[robot]
        driver_robot = driver.slot.robot
        context = driver_robot.context
        if "set_camera" not in context.profile.absent:
            zooms = context.profile.zooms
            zoom = WIDEST if zooms is None else max(each for each in zooms if each <= WIDEST)
            last = context.last_set.camera
            wanted = (CameraMode.COLOUR, *PICTURE, zoom)
            if last is None or (last.mode, last.width, last.height, last.zoom) != wanted:
                await driver.slot.set_camera(*PICTURE, zoom, CameraMode.COLOUR)
        picture = await driver.slot.take_picture()
        png, seen = await asyncio.to_thread(lambda: (_png(picture), _colours(picture)))
        view = math.degrees(picture.bearing(-0.5) - picture.bearing(picture.width - 0.5))
        pose = driver.pose
        data: dict[str, Json] = {
            "robot": robot,
            "pose": pose_of(driver),
            "width": picture.width,
            "height": picture.height,
            "scale": ENLARGED if picture.width <= 2 * PICTURE[0] else 1,
            "view": round(view, 1),
            "colours": {each: {"direction": where, "share": width} for each, (where, width) in seen.items()},
        }
        text = (
            f"Picture of {picture.width} x {picture.height} pixels, {view:.0f} degrees from left to right, taken at x "
            f"{pose.x:.3f} m, y {pose.y:.3f} m, looking to {math.degrees(pose.heading):.0f} degrees. "
        ) + (", ".join(f"{each} at {where:+.0f} degrees" for each, (where, _) in seen.items()) or "No colours.")
        return Result(data, text, base64.b64encode(png).decode("ascii"))

    async def set_leds(self, robot: str, ring: list[bool] | None, body: bool | None, front: bool | None) -> Result:
        """Switch LEDs."""
        slot = self.drivers[robot].slot
        for number, is_on in enumerate(ring or ()):
            await slot.command("set_led", number, int(is_on))
        if body is not None:
            await slot.command("set_body_led", int(body))
        if front is not None:
            await slot.command("set_front_led", int(front))
        return Result({"robot": robot, "ended": "reached"}, "The LEDs are set.")

    # -- what moves --

    async def drive(self, robot: str, distance: float, speed: float, stop_at_obstacle: bool) -> Result:
        """Drive straight on."""
        driver = self.drivers[robot]
        driver.check_free()
        room = driver.way_to_fence(backwards=distance < 0)
        if abs(distance) > room:
            raise CallRefused(
                "fence",
                f"the goal lies beyond the fence of {self.limits.fence:g} m; nothing moved",
                f"from here at most {room:.3f} m {'backwards' if distance < 0 else 'ahead'}, or turn first",
            )
        sensors = FRONT if distance > 0 else REAR
        outcome = await driver.motion(
            f"drive {distance:g} m",
            lambda mover: mover.drive(distance, speed=speed),
            2 * abs(distance) / speed + SLACK,
            lambda near: stop_at_obstacle and is_near(near, sensors),
        )
        return self._acted(robot, outcome)

    async def turn(self, robot: str, angle: float, speed: float) -> Result:
        """Turn on the spot."""
        outcome = await self.drivers[robot].motion(
            f"turn {angle:g} degrees",
            lambda mover: mover.turn(math.radians(angle), turn_rate=math.radians(speed)),
            2 * abs(angle) / speed + SLACK,
        )
        return self._acted(robot, outcome)

    async def go_to(self, robot: str, x: float, y: float, speed: float, stop_at_obstacle: bool) -> Result:
        """Go to a place."""
        driver = self.drivers[robot]
        driver.check_free()
        if math.hypot(x, y) > self.limits.fence:
            raise CallRefused(
                "fence",
                f"({x:g}, {y:g}) is {math.hypot(x, y):.3f} m from the start; the fence is {self.limits.fence:g} m",
                "choose a place nearer to (0, 0)",
            )
        is_leading = False

        def lead(is_driving: bool) -> None:
            nonlocal is_leading
            is_leading = is_driving

        turn_rate = min(TURN_RATE, 2 * self.limits.speed / AXLE)
        way = math.hypot(x - driver.pose.x, y - driver.pose.y)
        outcome = await driver.motion(
            f"go_to ({x:g}, {y:g})",
            lambda mover: approach(mover, x, y, speed, turn_rate, lead),
            2 * (way / speed + math.tau / turn_rate) + SLACK,
            lambda near: stop_at_obstacle and is_leading and is_near(near, FRONT),
        )
        return self._acted(robot, outcome)

    async def run_behaviour(
        self, robot: str, name: str, seconds: float, parameters: dict[str, object] | None
    ) -> Result:
        """Run a behaviour."""
        outcome = await self.drivers[robot].behaviour(name, seconds, parameters or {})
        return self._acted(robot, outcome)

    async def stop(self, robot: str) -> Result:
        """Stop a robot, or all."""
        keys = list(self.drivers) if robot == "all" else [robot]
        outcomes = await asyncio.gather(*(self.drivers[key].stop() for key in keys))
        if len(keys) == 1:
            return self._acted(keys[0], outcomes[0])
        texts = [f"robot {key}: {each.text}" for key, each in zip(keys, outcomes, strict=True)]
        stands: dict[str, Json] = {key: each.stands for key, each in zip(keys, outcomes, strict=True)}
        return Result({"stands": stands}, "\n".join(texts), is_error=not all(each.stands for each in outcomes))

    # -- results --

    def _budget(self) -> dict[str, Json]:
        return {"calls": self.budget.calls, "seconds": round(self.budget.seconds, 1)}

    def _acted(self, key: str, outcome: Outcome) -> Result:
        """Return the result of an action: what happened, and what is seen now."""
        driver = self.drivers[key]
        near = _nearness(outcome.near or driver.near(driver.slot.readings.get("proximity")))
        data: dict[str, Json] = {
            "robot": key,
            "ended": outcome.ended,
            "message": outcome.text,
            "hint": outcome.hint,
            "stands": outcome.stands,
            "driven": round(outcome.driven, 4),
            "turned": round(outcome.turned, 1),
            "seconds": round(outcome.seconds, 2),
            "pose": pose_of(driver),
            "proximity": {name: count for name, (count, _) in near.items()},
            "nearness": {name: word for name, (_, word) in near.items()},
            "budget": self._budget(),
        }
        if outcome.lines:
            data["lines"] = list(outcome.lines)
        pose = driver.pose
        text = f"{outcome.ended}: {outcome.text}."
        if outcome.hint:
            text += f" Try: {outcome.hint}."
        if outcome.began:
            text += f" Driven {outcome.driven:.3f} m, turned {outcome.turned:.0f} degrees."
        text += f" Now at x {pose.x:.3f} m, y {pose.y:.3f} m, heading {math.degrees(pose.heading):.0f} degrees. "
        text += _seen(near)
        for line in outcome.lines:
            text += f"\n{line}"
        return Result(data, text, is_error=outcome.is_error)


def wrong(error: ArgumentError) -> Result:
    """Return the result of a call with wrong arguments; nothing was sent."""
    text = f"{error.message}. Nothing was sent."
    text += f" Try: {error.hint}" if error.hint else ""
    return Result({"ended": "failed", "message": error.message, "hint": error.hint}, text, is_error=True)


def pose_of(driver: Driver) -> dict[str, Json]:
    """Return where a robot is: m and degrees."""
    pose = driver.pose
    found: dict[str, Json] = {
        "x": round(pose.x, 4),
        "y": round(pose.y, 4),
        "heading": round(math.degrees(pose.heading), 1),
    }
    if pose.is_uncertain:
        found |= {
            "wrong_by": round(pose.uncertainty, 2),
            "heading_wrong_by": round(math.degrees(pose.heading_uncertainty)),
        }
    return found


def _is_virtual(slot: Slot) -> bool:
    return virtual(slot.robot) is not None if slot.is_connected else slot.url.startswith(("sim://", "replay://"))


def _nearness(near: v.Proximity | None) -> dict[str, tuple[int, str]]:
    """Return counts and a word for each infrared sensor; empty where nothing was read."""
    if near is None:
        return {}
    found = {}
    for name in v.describe(v.Proximity, v.Role.NUMBER):
        count = getattr(near, name.name)
        found[name.name] = count, next((word for least, word in WORDS if count >= least), CLEAR)
    return found


def _seen(near: Mapping[str, tuple[int, str]]) -> str:
    if not near:
        return "The infrared sensors were not read."
    close = [f"{v.in_words(name)} {word} ({count})" for name, (count, word) in near.items() if word != CLEAR]
    return f"Infrared: {', '.join(close)}." if close else "Infrared: nothing is near."


def _reading(reading: v.Reading) -> tuple[dict[str, Json], dict[str, Json], str]:
    """Return the values of a reading by name, their units by name, and both as text."""
    values: dict[str, Json] = {}
    units: dict[str, Json] = {}
    said = []
    for info, name, number in v.items(reading, v.Role.NUMBER, v.Role.CONVERTED):
        value: Json
        if number is None or isinstance(number, bool | int | str):
            value = number
        elif isinstance(number, float) and math.isfinite(number):
            value = round(number, 6)
        else:
            value = None if isinstance(number, float) else str(number)
        values[name] = value
        if info.unit:
            units[name] = info.unit
        said.append(f"{v.in_words(name)} {value} {info.unit}".rstrip())
    return values, units, ", ".join(said)


def _colours(picture: Image) -> dict[str, tuple[float, float]]:
    """Return of each colour in a picture the direction of its largest area, degrees, and the share of the width."""
    found = {}
    for hue in Hue:
        blob = picture.find(hue.name)
        if blob is not None:
            direction = math.degrees(picture.bearing((blob.left + blob.right) / 2))
            found[hue.name.lower()] = (round(direction, 1), (blob.right + 1 - blob.left) / picture.width)
    return found


def _png(picture: Image) -> bytes:
    import PIL.Image

    stream = io.BytesIO()
    image = PIL.Image.fromarray(picture.pixels)
    if picture.width <= 2 * PICTURE[0]:
        size = picture.width * ENLARGED, picture.height * ENLARGED
        image = image.resize(size, PIL.Image.Resampling.NEAREST)
    image.save(stream, "PNG")
    return stream.getvalue()
