"""Drives one robot for an agent: one complete action at a time, which always ends with wheels at 0."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field

from elib.base.body import AXLE, METRES_PER_STEP
from elib.base.errors import ArgumentError, ElibError, MotionInterrupted
from elib.base.pose import Pose
from elib.behaviours import OpenAir
from elib.doors.agent.limits import REACTION, Budget, Guard, Limits
from elib.link.protocol.values import Proximity
from elib.panel.behaviours import RunPhase
from elib.panel.interlock import Interlock, ProxiedRobot
from elib.panel.slot import Phase, Slot

NAME = "agent"
"""The name of the agent in the panel."""
OBSTACLE = 300
"""Counts of an infrared sensor above those in the open at which something is about 2 cm away: a driving robot stops
there."""
PERIOD = 0.05
"""s from one look at sensors, fence and link to the next while the robot drives."""
READING_TIME = 0.5
"""s that the answer to a reading may take while the robot drives."""
SILENCE = 2.0
"""s without any reading after which an action is given up."""
STANDING_TIME = 1.5
"""s that the robot has to confirm, at the end of an action, that it stands."""
ENDING_TIME = 3.0
"""s that an action has to end after it was told to."""
SLACK = 5.0
"""s that a motion may take longer than twice the time that its way needs at its speed."""
FRONT = ("diagonal_left", "front_left", "front_right", "diagonal_right")
REAR = ("rear_left", "rear_right")
MOVING = "the robot did not confirm that it stands, so it may still be moving; the stop is repeated"
STOPPED_BY_A_PERSON = "a person stopped the robot"
RELEASE = "ask the person to press Continue on the robot's page; until then nothing moves"


@dataclass
class Outcome:
    """How an action ended."""

    # one word: `reached`, `obstacle`, `fence`, `budget`, `time`, `person`, `link`, `stopped` (by the stop tool),
    # `cancelled`, `busy` or `failed`
    ended: str
    text: str  # the same as a sentence
    hint: str = ""  # what to try; empty where nothing needs to be tried
    stands: bool = True  # whether the robot confirmed that it stands; True for an action that did not begin
    began: bool = True  # whether the robot was told to move
    driven: float = 0.0  # distance along the robot's own direction, backwards negative, m
    turned: float = 0.0  # angle by which it turned, positive to the left, degrees
    seconds: float = 0.0  # how long the action took, s
    near: Proximity | None = None  # what the infrared sensors see at its end; None if they could not be read
    lines: list[str] = field(default_factory=list)  # what a behaviour said

    @property
    def is_error(self) -> bool:
        """Whether the caller has to do something about it."""
        return not self.began or self.ended in ("link", "person", "failed")


class CallRefused(Exception):
    """An action that does not begin."""

    def __init__(self, ended: str, text: str, hint: str = "") -> None:
        super().__init__(text)
        self.outcome = Outcome(ended, text, hint, began=False)  # why not


Motion = Callable[[ProxiedRobot], Awaitable[object]]
Sight = Callable[[Proximity, bool], bool]
"""Returns whether an obstacle is in the way, from an infrared reading and whether both wheels turn forwards."""


def nothing_seen(near: Proximity, is_ahead: bool) -> bool:
    """Return that no obstacle matters."""
    return False


class Driver:
    """One robot of an agent."""

    def __init__(self, slot: Slot, limits: Limits, budget: Budget) -> None:
        self.slot = slot
        self.limits = limits
        self.budget = budget
        self.busy = ""  # the action that has the wheels, as text; empty while none has
        self.mover: asyncio.Task[object] | None = None  # the task of the call that has the wheels; None while none has
        self._loop = asyncio.get_running_loop()
        self._open_air = OpenAir()
        self._end: asyncio.Future[str] | None = None
        self._hand = slot.drive.on_hand
        slot.drive.on_hand = self._on_hand
        slot.is_always_read = True

    # -- what is known --

    @property
    def is_latched(self) -> bool:
        """Whether a person has stopped the robot, and has not released it yet."""
        return self.slot.runner.is_held

    def near(self, reading: object) -> Proximity | None:
        """Return an infrared reading without what its sensors read in the open; None if it is none."""
        return self._open_air(reading) if isinstance(reading, Proximity) else None

    @property
    def pose(self) -> Pose:
        """Where the robot is by its odometry, from where it was connected."""
        return self.slot.robot.odometry_pose if self.slot.is_connected else Pose(0.0, 0.0)

    @property
    def distance(self) -> float:
        """How far it is from its start, m."""
        return math.hypot(self.pose.x, self.pose.y)

    def way_to_fence(self, *, backwards: bool = False) -> float:
        """Return how far the robot can drive straight on before it reaches its fence, m."""
        pose = self.pose
        side = -1 if backwards else 1
        along = side * (pose.x * math.cos(pose.heading) + pose.y * math.sin(pose.heading))
        rest = self.limits.fence**2 - pose.x**2 - pose.y**2
        root = along**2 + rest
        return max(0.0, math.sqrt(root) - along) if root > 0 else 0.0

    # -- what a person does --

    def _on_hand(self, what: str) -> None:
        """Note that a person took the stick or pressed Stop; called before the stop is sent."""
        if what == "stop":
            if not self.is_latched:
                self.slot.runner.hold(NAME, f"{STOPPED_BY_A_PERSON}; Continue lets it drive again")
        else:
            self._hand(what)
        self.end("person")

    # -- one action --

    def check_free(self) -> None:
        """Refuse an action that may not begin now.

        Raises:
            CallRefused: A person stopped the robot or drives it, an action is under way, the budget is spent, or there
                is no link.
        """
        if self.is_latched:
            raise CallRefused("person", STOPPED_BY_A_PERSON, RELEASE)
        if self.busy:
            raise CallRefused("busy", f"the robot is busy: {self.busy}", "wait for its result, or call stop")
        if self.slot.phase is not Phase.CONNECTED:
            reason = "" if self.slot.error is None else f": {self.slot.error.message}"
            raise CallRefused(
                "link", f"the robot is {self.slot.phase.value}{reason}", "call status until it is connected"
            )
        if self.slot.drive.is_driven_by_hand:
            raise CallRefused(
                "person", "a person drives the robot", "wait until the person lets go; status says who drives"
            )
        if self.slot.runner.is_active or self.slot.is_playing:
            raise CallRefused(
                "person", f"a person runs {self.slot.runner.name} on the robot", "wait until it has ended"
            )
        if self.budget.seconds <= 0:
            raise CallRefused("budget", "no seconds of driving are left", "report to the person what was found")

    def end(self, why: str) -> None:
        """End the action that is under way, for one word of a reason, and stop the robot. Waits for nothing."""
        if self._end is not None and not self._end.done():
            self._end.set_result(why)
        if self.busy and why != "person":
            self.slot.drive.halt()

    async def stop(self) -> Outcome:
        """Stop the robot and end what the agent does with it; always allowed."""
        self.end("stopped")
        if self.slot.is_connected and not self.slot.drive.is_driven_by_hand:
            self.slot.drive.halt()
        if await self._stands():
            return Outcome("stopped", "the robot stands")
        return Outcome("link", MOVING, "hold the robot or switch it off", stands=False)

    async def motion(self, name: str, motion: Motion, longest: float, sees: Sight = nothing_seen) -> Outcome:
        """Carry out a motion whose goal was checked before."""
        self.check_free()
        robot = self.slot.robot
        guard = Guard(robot.session, self.limits, lambda: self.pose, margin=0.0)
        interlock = Interlock(guard, self.slot.drive)

        async def move() -> None:
            self.slot.drive.release()
            await self.slot.drive.wait_until_stopped()
            mover = ProxiedRobot(robot, interlock)
            await mover.pose()
            mover.motion.odometry.pose = self.pose
            await motion(mover)

        action = self._loop.create_task(move(), name=f"elib agent {name}")
        return await self._act(name, guard, action, interlock.end, longest, sees)

    async def behaviour(self, name: str, seconds: float, options: Mapping[str, object]) -> Outcome:
        """Run a behaviour for so many seconds, or until it ends."""
        self.check_free()
        runner = self.slot.runner
        guard = Guard(self.slot.robot.session, self.limits, lambda: self.pose, margin=REACTION)
        try:
            runner.start(name, options, channel=guard)
        except ElibError:
            guard.end()
            raise
        self.slot.join(NAME)  # its behaviour goes on when the last page is closed

        async def run() -> None:
            await runner.finished(math.inf)
            if runner.phase is RunPhase.FAILED and not guard.is_over:
                raise ArgumentError(runner.error)

        try:
            outcome = await self._act(
                f"run_behaviour {name}", guard, self._loop.create_task(run()), runner.halt, seconds, nothing_seen
            )
        finally:
            self.slot.leave(NAME)
        outcome.lines = [f"{time:.1f} s: {text}" for time, text in runner.lines][-20:]
        return outcome

    async def _act(
        self,
        name: str,
        guard: Guard,
        action: asyncio.Task[None],
        halt: Callable[[], None],
        longest: float,
        sees: Sight,
    ) -> Outcome:
        """Watch an action to its end, and see that the robot stands then."""
        self.busy, self.mover = name, asyncio.current_task()
        self._end = end = self._loop.create_future()
        began, before = self._loop.time(), self._travelled()
        limit = min(longest, self.budget.seconds)
        is_short = limit < longest
        watch = self._loop.create_task(self._watch(guard, sees), name="elib agent watches")
        why, error = "cancelled", None
        try:
            await asyncio.wait([action, end, watch], timeout=limit, return_when=asyncio.FIRST_COMPLETED)
            why, error = self._why(guard, action, end, watch, "budget" if is_short else "time")
        finally:
            # Whatever ends it, also a cancellation: from here on no command of the action reaches the robot.
            halt()
            if why not in ("reached", "person"):
                self.slot.drive.halt()
            action.cancel()
            watch.cancel()
            guard.end()
            self.budget.spend_seconds(self._loop.time() - began)
        await asyncio.wait([action, watch], timeout=ENDING_TIME)
        stands = await self._stands()
        near = await self._near() if stands else None
        after = self._travelled()
        self.busy, self.mover, self._end = "", None, None
        outcome = Outcome(why, *self._words(why, error, stands), stands=stands)
        outcome.driven, outcome.turned = _way(before, after)
        outcome.seconds, outcome.near = self._loop.time() - began, near
        return outcome

    def _why(
        self,
        guard: Guard,
        action: asyncio.Task[None],
        end: asyncio.Future[str],
        watch: asyncio.Task[str],
        late: str,
    ) -> tuple[str, BaseException | None]:
        """Return why an action has ended, in a word, and its error."""
        if end.done():
            return end.result(), None
        if action.done():
            error = None if action.cancelled() else action.exception()
            if guard.is_over:
                return "fence", None
            if error is None:
                return "reached", None
            if isinstance(error, MotionInterrupted):
                return "person", error
            return ("failed" if isinstance(error, ArgumentError) else "link"), error
        if watch.done():
            return (watch.result(), None) if watch.exception() is None else ("failed", watch.exception())
        return late, None

    async def _watch(self, guard: Guard, sees: Sight) -> str:
        """Read sensors and counters while the robot drives; return why the action has to end."""
        heard = self._loop.time()
        while True:
            began = self._loop.time()
            if self.slot.phase is not Phase.CONNECTED:
                return "link"
            try:
                robot = self.slot.robot.within(READING_TIME)
                near = self._open_air(await robot.proximity())
                await robot.encoders()
                heard = self._loop.time()
                if sees(near, guard.is_ahead):
                    return "obstacle"
            except ElibError:
                if self._loop.time() - heard > SILENCE:
                    return "link"
            if not guard.check():
                return "fence"
            await asyncio.sleep(max(0.01, began + PERIOD - self._loop.time()))

    async def _near(self) -> Proximity | None:
        """Read the infrared sensors, and the counters too; return None if they could not be read."""
        try:
            robot = self.slot.robot.within(READING_TIME)
            await robot.encoders()
            return self._open_air(await robot.proximity())
        except ElibError:
            return None

    async def _stands(self) -> bool:
        """Wait until the robot has confirmed that it stands; return whether it did in time."""
        try:
            async with asyncio.timeout(STANDING_TIME):
                await self.slot.drive.wait_until_stopped()
        except TimeoutError:
            return False
        return self.slot.is_connected and (not self.slot.drive.may_move or self.slot.drive.is_driven_by_hand)

    def _travelled(self) -> tuple[int, int]:
        """Return the steps of both wheels since the start."""
        if not self.slot.is_connected:
            return 0, 0
        odometry = self.slot.robot.motion.odometry
        return odometry.left, odometry.right

    def _words(self, why: str, error: BaseException | None, stands: bool) -> tuple[str, str]:
        """Return what happened as a sentence, and what to try."""
        said = error.message if isinstance(error, ElibError) else "" if error is None else type(error).__name__
        state = "it stands" if stands else MOVING
        match why:
            case "reached":
                return "done; " + state, ""
            case "obstacle":
                return f"an obstacle is about 2 cm away ({OBSTACLE} counts); {state}", "turn, or drive the other way"
            case "fence":
                return f"the fence of {self.limits.fence:g} m ended it; {state}", "drive towards the start at (0, 0)"
            case "budget":
                return f"the seconds of driving are spent; {state}", "report to the person what was found"
            case "time":
                return f"the time is over; {state}", ""
            case "person" if self.is_latched:
                return f"{STOPPED_BY_A_PERSON}; {state}", RELEASE
            case "person":
                return "a person, or another page, drives the robot now", "wait until status says that no client drives"
            case "link":
                cause = said or (self.slot.error.message if self.slot.error is not None else "it does not answer")
                hint = "" if stands else "; a person should hold the robot or switch it off"
                again = f"call status until the robot is connected, then try again{hint}"
                return f"the link to the robot failed: {cause}; {state}", again
            case "stopped":
                return f"the stop tool ended it; {state}", ""
            case "cancelled":
                return f"the call was cancelled; {state}", ""
            case _:
                return f"it failed: {said}; {state}", "correct the arguments, or choose another tool"


def _way(before: tuple[int, int], after: tuple[int, int]) -> tuple[float, float]:
    """Return metres driven and degrees turned between two counts of the steps."""
    left, right = after[0] - before[0], after[1] - before[1]
    return METRES_PER_STEP * (left + right) / 2, math.degrees(METRES_PER_STEP * (right - left) / AXLE)


def is_near(near: Proximity, sensors: tuple[str, ...]) -> bool:
    """Return whether one of the sensors sees something about 2 cm away."""
    return any(getattr(near, name) >= OBSTACLE for name in sensors)
