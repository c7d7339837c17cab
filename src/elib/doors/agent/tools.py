"""The tools of an agent: functions whose signatures and docstrings are what a model reads of them."""

# The types of parameters hold the limits of one agent, so they are made where they stand: no "from __future__" here.

import asyncio
import math
from collections.abc import Awaitable, Callable, Mapping
from typing import Annotated, Any, Literal, TypeAlias

from mcp.server.mcpserver.tools import Tool
from mcp_types import CallToolResult, ToolAnnotations
from pydantic import ConfigDict, Field, ValidationError

from elib.base.body import AXLE
from elib.base.errors import ArgumentError, ElibError
from elib.base.rules import nearest
from elib.doors.agent import results
from elib.doors.agent.driver import FRONT, OBSTACLE, REAR, SLACK, CallRefused, Driver, Outcome, is_near
from elib.doors.agent.limits import Budget, Limits
from elib.doors.foxglove.commands import Leds
from elib.link.protocol import values as v
from elib.link.protocol.quantities import CameraMode
from elib.panel.behaviours import catalogue
from elib.panel.panel import Panel
from elib.panel.slot import Slot
from elib.panel.watching import virtual
from elib.robot.actions import TURN_RATE

WIDEST = 12
"""Sensor pixels for one pixel of a picture, where every factor works: 480, the whole chip of an e-puck1, which lies on
its side."""
MAX_BEHAVIOUR = 60.0
"""s that one call may run a behaviour."""
SLOWEST = 0.005
"""m/s."""
SLOWEST_TURN = 5.0
"""degrees/s."""
WHICH = "Which robot: its key of the tool robots."
MAX_MISTAKES = 3
"""Wrong arguments that the answer to a call names."""
STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
"""A text is no number here, and a parameter that does not exist is a mistake, not something to pass over."""

Function: TypeAlias = Callable[..., Awaitable[CallToolResult]]


class Tools:
    """The tools of one agent on the robots of a panel."""

    def __init__(self, panel: Panel, limits: Limits) -> None:
        self.limits = limits
        self.budget = Budget(limits)  # what is left
        # the agent's robots by key: those that are added later are a person's
        self.drivers = {key: Driver(slot, limits, self.budget) for key, slot in panel.slots.items()}
        self.tools: dict[str, Tool] = {}  # the tools by name, as the SDK describes them
        self._free: set[str] = set()
        self._keys = tuple(self.drivers)
        self._offer_what_reads()
        self._offer_what_drives()
        self._offer_the_rest()

    def _tool(
        self,
        title: str,
        more: str = "",
        *,
        is_reading: bool = False,
        is_idempotent: bool = False,
        is_free: bool = False,
    ) -> Callable[[Function], Function]:
        """Return what makes a tool of a function."""

        def offer(function: Function) -> Function:
            hints = ToolAnnotations(
                title=title,
                read_only_hint=is_reading,
                destructive_hint=False,
                idempotent_hint=is_reading or is_idempotent,
                open_world_hint=False,
            )
            about = f"{' '.join((function.__doc__ or '').split())} {more}".strip()
            tool = Tool.from_function(
                function, title=title, description=about, annotations=hints, structured_output=False
            )
            model = tool.fn_metadata.arg_model
            model.model_config |= STRICT
            model.model_rebuild(force=True)
            tool.parameters = model.model_json_schema()
            self.tools[tool.name] = tool
            if is_free:
                self._free.add(tool.name)
            return function

        return offer

    # -- calls --

    async def call(self, name: str, arguments: Mapping[str, Any]) -> CallToolResult:
        """Carry out a call; what is wrong with it, and an error of a robot, becomes a result that says so."""
        tool = self.tools.get(name)
        if tool is None:
            return results.refused(ArgumentError(f"there is no tool {name[:80]!r}", hint=nearest(name, self.tools)))
        try:
            checked = tool.fn_metadata.validate_arguments(dict(arguments))
        except ValidationError as error:
            return results.refused(ArgumentError(f"{name} was called with wrong arguments: {_mistakes(error)}"))
        key = checked.get("robot", self._keys[0])
        if name not in self._free and not self.budget.spend_call():
            outcome = Outcome("budget", "no calls are left", "report to the person what was found", began=False)
            return results.acted(key, self.drivers[key], outcome)
        try:
            done: CallToolResult = await tool.fn(**checked)
        except CallRefused as refusal:
            return results.acted(key, self.drivers[key], refusal.outcome)
        except ArgumentError as error:
            return results.refused(error)
        except ElibError as error:
            state = _state(self.drivers[key].slot)
            hint = error.hint or "call status until the robot is connected, then try again"
            text = f"{name} failed: {error.message}; {state}. Try: {hint}"
            data: results.Data = {"ended": "link", "message": error.message, "hint": hint, "state": state}
            return results.answer(data, text, is_error=True)
        return done

    # -- what only reads --

    def _offer_what_reads(self) -> None:
        keys = self._keys
        Robot = Annotated[Literal[keys], Field(description=WHICH)]  # type: ignore[valid-type]

        @self._tool("List the robots", is_reading=True, is_free=True)
        async def robots() -> CallToolResult:
            """List the robots and their state. Free."""
            found = []
            lines = []
            for key, driver in self.drivers.items():
                slot = driver.slot
                is_virtual = slot.url.startswith(("sim://", "replay://"))
                kind = "virtual" if (virtual(slot.robot) if slot.is_connected else is_virtual) else "real"
                firmware, state = slot.firmware, slot.phase.value
                found.append({"robot": key, "name": slot.name, "kind": kind, "firmware": firmware, "state": state})
                lines.append(f"robot {key}: {slot.name}, {kind}, {firmware or 'firmware unknown'}, {state}")
            return results.answer({"robots": found}, "\n".join(lines))

        @self._tool("State of a robot", is_reading=True, is_free=True)
        async def status(robot: Robot = keys[0]) -> CallToolResult:
            """Tell where the robot is by its odometry, what is left, and who drives.

            Its place is x ahead and y to the left of its start in m, its heading in degrees, positive to the left; it
            says how far that may be wrong, if it may. What is left is what fence and budget leave. It tells whether the
            robot is connected, and whether a person has stopped it. Free.
            """
            return self._status(robot)

        @self._tool("Read all sensors", is_reading=True)
        async def read_all(robot: Robot = keys[0]) -> CallToolResult:
            """Read all sensors once, with their units. The robot does not move."""
            driver = self.drivers[robot]
            sensors = await driver.slot.robot.sensors()
            found: results.Data = {}
            lines = []
            for info in v.describe(v.Sensors, v.Role.NUMBER):
                reading = getattr(sensors, info.name)
                if isinstance(reading, v.Reading):
                    values, units, said = results.spoken(reading)
                    found[info.name] = {**values, "units": units}
                    lines.append(f"{info.words}: {said}")
            lines.append(results.seen(results.nearness(driver.near(sensors.proximity))))
            return results.answer({"robot": robot, "pose": results.pose_of(driver), "sensors": found}, "\n".join(lines))

        @self._tool("Take a picture", is_reading=True)
        async def look(robot: Robot = keys[0]) -> CallToolResult:
            """Take one colour picture with the camera, which looks straight ahead. The robot does not move.

            With the picture come the pose where it was taken and the direction of the largest thing of each colour,
            degrees, positive to the left.
            """
            return await self._look(robot)

    def _status(self, key: str) -> CallToolResult:
        driver = self.drivers[key]
        slot = driver.slot
        if slot.drive.is_driven_by_hand:
            who = "a person"
        elif driver.busy:
            who = f"you: {driver.busy}"
        elif slot.runner.is_active and not driver.is_latched:
            who = f"a person runs {slot.runner.name}"
        else:
            who = "no client"
        stands = not slot.drive.may_move
        ahead, behind = driver.way_to_fence(), driver.way_to_fence(backwards=True)
        near = results.nearness(driver.near(slot.readings.get("proximity")))
        data: results.Data = {
            "robot": key,
            "connected": slot.phase.value == "connected",
            "state": slot.phase.value,
            "pose": results.pose_of(driver),
            "fence": {
                "radius": self.limits.fence,
                "distance_from_start": round(driver.distance, 3),
                "ahead": round(ahead, 3),
                "behind": round(behind, 3),
            },
            "speed_limit": self.limits.speed,
            "budget": results.budget_of(driver),
            "drives": who,
            "stopped_by_person": driver.is_latched,
            "stands": stands,
            "proximity": {name: count for name, (count, _) in near.items()},
        }
        if slot.error is not None and not slot.is_connected:
            data["message"] = slot.error.message
        text = (
            f"Robot {key} is {slot.phase.value} at {results.place_of(driver)}; {'it stands' if stands else 'it moves'}."
            f" {who} drives. Fence: {ahead:.2f} m ahead, {behind:.2f} m behind. Left: {self.budget.calls} calls, "
            f"{self.budget.seconds:.0f} s of driving."
        )
        if driver.is_latched:
            text += " A person stopped the robot: ask the person to press Continue on its page."
        return results.answer(data, text)

    async def _look(self, key: str) -> CallToolResult:
        driver = self.drivers[key]
        context = driver.slot.robot.context
        if "set_camera" not in context.profile.absent:
            zooms = context.profile.zooms
            zoom = WIDEST if zooms is None else max(each for each in zooms if each <= WIDEST)
            last = context.last_set.camera
            wanted = (CameraMode.COLOUR, *results.PICTURE, zoom)
            if last is None or (last.mode, last.width, last.height, last.zoom) != wanted:
                await driver.slot.set_camera(*results.PICTURE, zoom, CameraMode.COLOUR)
        picture = await driver.slot.take_picture()
        image, areas = await asyncio.to_thread(lambda: (results.png(picture), results.colours(picture)))
        view = math.degrees(picture.bearing(-0.5) - picture.bearing(picture.width - 0.5))
        data: results.Data = {
            "robot": key,
            "pose": results.pose_of(driver),
            "width": picture.width,
            "height": picture.height,
            "scale": results.ENLARGED if picture.width <= 2 * results.PICTURE[0] else 1,
            "view": round(view, 1),
            "colours": {each: {"direction": where, "share": width} for each, (where, width) in areas.items()},
        }
        text = (
            f"Picture of {picture.width} x {picture.height} pixels, {view:.0f} degrees from left to right, taken at "
            f"{results.place_of(driver)}. "
        ) + (", ".join(f"{each} at {where:+.0f} degrees" for each, (where, _) in areas.items()) or "No colours.")
        return results.answer(data, text, picture=image)

    # -- what drives --

    def _offer_what_drives(self) -> None:
        fence, top = self.limits.fence, self.limits.speed
        fastest_turn = math.floor(math.degrees(2 * top / AXLE))
        keys = self._keys
        usual, usual_turn = min(0.064, top), float(min(round(math.degrees(TURN_RATE)), fastest_turn))
        Robot = Annotated[Literal[keys], Field(description=WHICH)]  # type: ignore[valid-type]
        Speed = Annotated[float, Field(ge=SLOWEST, le=top, description=f"Speed in m/s, up to {top:g}.")]
        Stopping = Annotated[
            bool,
            Field(
                description=f"Stop when an infrared sensor on the side of travel shows {OBSTACLE} counts more than in "
                "the open: about 2 cm from a white or red thing. Black and blue things are seen later or never."
            ),
        ]
        within = f"The fence is {fence:g} m."

        @self._tool("Drive straight", within)
        async def drive(
            distance: Annotated[
                float, Field(ge=-2 * fence, le=2 * fence, description="Distance in m, negative is backwards.")
            ],
            speed: Speed = usual,
            stop_at_obstacle: Stopping = True,
            robot: Robot = keys[0],
        ) -> CallToolResult:
            """Drive straight on, then stand.

            It ends early at an obstacle, at the fence, at the end of the budget or when a person stops the robot; the
            result says why.
            """
            driver = self.drivers[robot]
            driver.check_free()
            room = driver.way_to_fence(backwards=distance < 0)
            if abs(distance) > room:
                raise CallRefused(
                    "fence",
                    f"the goal lies beyond the fence of {fence:g} m; nothing moved",
                    f"from here at most {room:.3f} m {'backwards' if distance < 0 else 'ahead'}, or turn first",
                )
            sensors = FRONT if distance > 0 else REAR
            outcome = await driver.motion(
                f"drive {distance:g} m",
                lambda mover: mover.drive(distance, speed=speed),
                2 * abs(distance) / speed + SLACK,
                lambda near, is_ahead: stop_at_obstacle and is_near(near, sensors),
            )
            return results.acted(robot, driver, outcome)

        @self._tool("Turn on the spot")
        async def turn(
            angle: Annotated[float, Field(ge=-360.0, le=360.0, description="Angle in degrees, positive to the left.")],
            speed: Annotated[
                float,
                Field(
                    ge=SLOWEST_TURN,
                    le=float(fastest_turn),
                    description=f"Turn rate in degrees per second, up to {fastest_turn}.",
                ),
            ] = usual_turn,
            robot: Robot = keys[0],
        ) -> CallToolResult:
            """Turn on the spot, then stand."""
            driver = self.drivers[robot]
            outcome = await driver.motion(
                f"turn {angle:g} degrees",
                lambda mover: mover.turn(math.radians(angle), turn_rate=math.radians(speed)),
                2 * abs(angle) / speed + SLACK,
            )
            return results.acted(robot, driver, outcome)

        @self._tool("Go to a place", within, is_idempotent=True)
        async def go_to(
            x: Annotated[float, Field(ge=-fence, le=fence, description="Place ahead of the start in m.")],
            y: Annotated[float, Field(ge=-fence, le=fence, description="Place to the left of the start in m.")],
            speed: Speed = usual,
            stop_at_obstacle: Stopping = True,
            robot: Robot = keys[0],
        ) -> CallToolResult:
            """Turn towards a place, drive there in a straight line, then stand. It does not drive round obstacles."""
            driver = self.drivers[robot]
            driver.check_free()
            if math.hypot(x, y) > fence:
                raise CallRefused(
                    "fence",
                    f"({x:g}, {y:g}) is {math.hypot(x, y):.3f} m from the start; the fence is {fence:g} m",
                    "choose a place nearer to (0, 0)",
                )
            turn_rate = min(TURN_RATE, 2 * top / AXLE)
            way = math.hypot(x - driver.pose.x, y - driver.pose.y)
            outcome = await driver.motion(
                f"go_to ({x:g}, {y:g})",
                lambda mover: mover.go_to(x, y, speed=speed, turn_rate=turn_rate),
                2 * (way / speed + math.tau / turn_rate) + SLACK,
                lambda near, is_ahead: stop_at_obstacle and is_ahead and is_near(near, FRONT),
            )
            return results.acted(robot, driver, outcome)

    # -- behaviours, LEDs and the stop --

    def _offer_the_rest(self) -> None:
        keys = self._keys
        behaviours = {each.name: each.summary for each in catalogue() if not each.elsewhere}
        Robot = Annotated[Literal[keys], Field(description=WHICH)]  # type: ignore[valid-type]
        names = tuple(behaviours)
        Name = Annotated[
            Literal[names],  # type: ignore[valid-type]
            Field(description="Name of the behaviour."),
        ]
        Everyone = Annotated[
            Literal[(*keys, "all")],  # type: ignore[valid-type]
            Field(description="Which robot; all stops every robot."),
        ]
        longest = min(MAX_BEHAVIOUR, self.limits.seconds)

        @self._tool("Run a behaviour", "; ".join(f"{name}: {about}" for name, about in behaviours.items()))
        async def run_behaviour(
            name: Name,
            seconds: Annotated[float, Field(ge=0.5, le=longest, description="How long it runs in s.")] = 5.0,
            parameters: Annotated[
                dict[str, int | float | str | bool] | None,
                Field(description="Its own options by name; a wrong one is answered with its rule."),
            ] = None,
            robot: Robot = keys[0],
        ) -> CallToolResult:
            """Run one of elib's behaviours for some seconds, then stand.

            Speed limit and fence hold; near the fence it ends. The behaviours:
            """
            driver = self.drivers[robot]
            return results.acted(robot, driver, await driver.behaviour(name, seconds, parameters or {}))

        @self._tool("Set the LEDs", is_idempotent=True)
        async def set_leds(
            ring: Annotated[
                list[bool] | None,
                Field(
                    min_length=8,
                    max_length=8,
                    description="The 8 red LEDs of the ring, clockwise from the front: on or off.",
                ),
            ] = None,
            body: Annotated[bool | None, Field(description="The green LEDs in the body.")] = None,
            front: Annotated[bool | None, Field(description="The bright red LED in front.")] = None,
            robot: Robot = keys[0],
        ) -> CallToolResult:
            """Switch LEDs on or off; those that are left out stay as they are. A stop switches the ring off."""
            slot = self.drivers[robot].slot
            for name, arguments in Leds(ring, body, front).commands():
                await slot.command(name, *arguments)
            return results.answer({"robot": robot, "ended": "reached"}, "The LEDs are set.")

        @self._tool("Stop at once", is_idempotent=True, is_free=True)
        async def stop(robot: Everyone = keys[0]) -> CallToolResult:
            """Stop the robot at once, whatever it does, and end the call that moves it. Always allowed, and free."""
            stopped = keys if robot == "all" else (robot,)
            outcomes = await asyncio.gather(*(self.drivers[key].stop() for key in stopped))
            if len(stopped) == 1:
                return results.acted(stopped[0], self.drivers[stopped[0]], outcomes[0])
            found = dict(zip(stopped, outcomes, strict=True))
            stands = {key: each.stands for key, each in found.items()}
            texts = [f"robot {key}: {each.text}" for key, each in found.items()]
            return results.answer({"stands": stands}, "\n".join(texts), is_error=not all(stands.values()))


def _mistakes(error: ValidationError) -> str:
    """Return what is wrong with the arguments of a call, shortly: strangers may have sent megabytes."""
    found = error.errors(include_url=False, include_input=False)
    said = [f"{'.'.join(map(str, each['loc']))[:80]}: {each['msg'][:300]}" for each in found[:MAX_MISTAKES]]
    return "; ".join(said)


def _state(slot: Slot) -> str:
    if not slot.drive.may_move:
        return "the robot stands" if slot.is_connected else f"the robot is {slot.phase.value}, and stood before"
    return "the robot may still be moving; the stop is repeated until it confirms"
