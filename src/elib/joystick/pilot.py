"""One robot of the panel: how it is connected, what it last said, and what it is told. No page is needed for it.

Everything runs on one event loop, the panel's. What a page asks for ends in a value or an error, never in a wait
without a bound, and nothing here draws.
"""

from __future__ import annotations

import asyncio
import contextlib
import enum
import math
from collections import deque
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass

from elib.diagnosis.doctor import diagnose
from elib.diagnosis.report import Diagnosis
from elib.emulator.control import Control
from elib.emulator.sim import SimTransport
from elib.errors import ArgumentError, ElibError, LinkClosed
from elib.joystick.behaving import Performer
from elib.joystick.helm import Helm
from elib.pose import Pose
from elib.protocol.commands import SPECS
from elib.protocol.image import Image
from elib.protocol.lamps import ALL
from elib.protocol.quantities import CameraMode
from elib.protocol.values import Reading
from elib.recording.log import Log
from elib.recording.recorder import Recorder
from elib.robot.aio import Epuck, make_robot
from elib.robot.reconnect import Policy
from elib.robot.snapshot import IMAGE
from elib.robot.statistics import Statistics
from elib.session import Called, Ended, Fenced, Greeted, LinkBack, LinkDown, ResetNoticed, TraceEvent
from elib.transport import parse_url

RATE = 10.0
"""Snapshots of all sensors a second."""
PATIENCE = 1.0
"""s that a command from the page may take."""
LEAST_PATIENCE, TRIPS = 0.2, 4
"""s, and round trips, that the answer to a turn of the stick is waited for; the more of both counts."""
STANDING_TIME = 0.4
"""s that a stop may take; then it is repeated."""
KEPT = 500
"""Lines of the event log."""
OPENING_TIME = 25.0
"""s that connecting may take, whatever the link does."""
CAMERA = (40, 40, 8, CameraMode.GREY)
"""Width, height, zoom and mode at the beginning."""
STALE = 1.0
"""s after which a value counts as old, or three periods of its watch if that is more."""
PERIODS = 3
LONGEST_STANDING_TIME = 2.0
"""s that a stop may take at most, on a link however slow."""
WHEELS = ("set_speed", "text", "set_obstacle_avoidance")
"""Commands after which the robot may drive on by itself."""
ACTIONS = ("text", "sensors", "set_obstacle_avoidance")
"""What can be sent beside the rows of the table."""
CHATTER = 1.0
"""s in which one line of the event log stands for all speeds that were set."""
LONGEST_TEXT = 200
"""Characters of a raw command, or of a file's name in a message."""


class Phase(enum.Enum):
    """How a robot is connected."""

    DISCONNECTED = "disconnected"
    CONNECTING = "connecting"
    CONNECTED = "connected"
    GAP = "link lost, being opened again"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the event log.

    Attributes:
        time: s on the panel's clock.
        kind: ``call``, ``link``, ``robot``, ``state``, ``note`` or ``panel``.
        text: What happened.
        is_bad: It went wrong.
    """

    time: float
    kind: str
    text: str
    is_bad: bool = False


class Pilot:
    """A robot's place in the panel. It outlives its connections.

    Args:
        url: What will be opened.
        name: What it is called; the URL unless given.

    Attributes:
        url: As given.
        name: As given.
        phase: How it is connected.
        error: Why not, after a failure.
        diagnosis: What the doctor found then, or None.
        helm: Who drives, and how.
        readings: The newest reading of each kind, by name, with its own time.
        trail: Where it was by its odometry, or in its world, oldest first.
        trail_count: Points of the trail that there ever were.
        trail_began: How many there were when the robot was connected last: what came before was another journey.
        lines: The event log.
        line_count: Lines that there ever were.
        edition: Another number when firmware, lamps, instruments or world may be others than before.
        performer: Behaviours on this robot.
        log: The log file that is being written, or None.
        recorder: The recording that is being written, or None.
        on_change: Called after anything but a reading has changed.
    """

    def __init__(self, url: str, *, name: str = "") -> None:
        parse_url(url)
        self.url = url
        self.name = name or url
        self.phase = Phase.DISCONNECTED
        self.error: ElibError | None = None
        self.diagnosis: Diagnosis | None = None
        self.readings: dict[str, Reading | Image] = {}
        self.trail: deque[Pose] = deque(maxlen=5000)
        self.trail_count = self.trail_began = 0
        self.lines: deque[Line] = deque(maxlen=KEPT)
        self.line_count = 0
        self.edition = 0
        self.log: Log | None = None
        self.recorder: Recorder | None = None
        self.on_change: Callable[[], object] = lambda: None
        self._loop = asyncio.get_running_loop()
        self.helm = Helm(self._drive, self._stop)
        self.helm.on_change = self._changed
        self.helm.let_go()
        self.performer = Performer(self)
        self._robot: Epuck | None = None
        self._tasks: set[asyncio.Task[object]] = set()
        self._pictures: float | None = None
        self._watching: asyncio.Task[object] | None = None
        self._doctor: asyncio.Task[object] | None = None
        self._opening: asyncio.Task[bool] | None = None
        self._spoken = -math.inf

    # -- the link --

    @property
    def robot(self) -> Epuck:
        """The robot.

        Raises:
            LinkClosed: It is not connected.
        """
        if self._robot is None:
            raise LinkClosed(f"{self.name} is not connected", hint="press Connect")
        return self._robot

    @property
    def is_connected(self) -> bool:
        """Whether there is a robot, be its link in a gap."""
        return self._robot is not None

    @property
    def now(self) -> float:
        """The panel's clock, s."""
        return self._loop.time()

    @property
    def firmware(self) -> str:
        """Of the robot; empty without one."""
        return "" if self._robot is None else self._robot.firmware

    @property
    def statistics(self) -> Statistics | None:
        """How the link has been; None without one."""
        return None if self._robot is None else self._robot.statistics

    @property
    def waiting(self) -> int:
        """Calls in the queue."""
        return 0 if self._robot is None else self._robot.session.waiting

    @property
    def control(self) -> Control | None:
        """The world's control door, of a robot that is simulated here."""
        if self._robot is None:
            return None
        transport = self._robot.session.transport
        is_here = isinstance(transport, SimTransport) and transport.simulation.world is not None
        return Control(transport.simulation) if isinstance(transport, SimTransport) and is_here else None

    async def connect(self) -> bool:
        """Open the link, stop the robot, set its camera, and put its lamps out; then watch its sensors.

        Returns:
            Whether it is connected. If not, :attr:`error` says why, and the doctor begins to look.
        """
        if self.phase in (Phase.CONNECTING, Phase.CONNECTED, Phase.GAP):
            return self.is_connected
        self.phase, self.error, self.diagnosis = Phase.CONNECTING, None, None
        self._changed()
        opening = self._opening = self._loop.create_task(self._open(), name="elib panel opens")
        try:
            return await opening
        except asyncio.CancelledError:
            me = asyncio.current_task()
            if me is not None and me.cancelling():
                opening.cancel()
                await asyncio.wait([opening])
                raise
            return False  # disconnected meanwhile
        finally:
            self._opening = None

    async def _open(self) -> bool:
        if self._doctor is not None:  # it may hold the port
            self._doctor.cancel()
            await asyncio.wait([self._doctor])
        robot = make_robot(
            self.url,
            name=self.name,
            keep_moving=False,
            firmware=None,
            mounting=None,
            policy=Policy(during_gap="fail"),
        )
        try:
            async with asyncio.timeout(OPENING_TIME):
                await robot.__aenter__()
                self._robot = robot
                await self._greet(robot)
        except (ElibError, OSError, TimeoutError) as error:
            await self._give_up(robot, error)
            return False
        except BaseException:
            self._robot = None
            self.phase = Phase.DISCONNECTED
            await robot.close()
            raise
        self.phase = Phase.CONNECTED
        self._new_edition()
        self.readings.clear()
        self.trail.clear()
        self.trail_began = self.trail_count
        robot.trace(self._see)
        self._note("link", f"connected to {self.name} ({robot.firmware})")
        self._watching = self._begin(self._watch(robot))
        self._changed()
        return True

    async def disconnect(self) -> None:
        """Stop the robot and free its port; also while it is being connected. Safe to repeat."""
        if self._opening is not None:
            self._opening.cancel()
            await asyncio.wait([self._opening])
        robot, self._robot = self._robot, None
        may_move = self.helm.may_move
        self.performer.halt()
        self.helm.let_go()
        for task in tuple(self._tasks):
            task.cancel()
        if self._tasks:
            await asyncio.wait(self._tasks)
        if robot is not None:
            may_move = not await self._part(robot, may_move=may_move)
        await self.performer.stop()
        self.stop_log()
        self.stop_recorder()
        if robot is not None:
            self._note("link", f"disconnected from {self.name}")
            if may_move:
                self._note("link", f"{self.name} did not confirm that it stands: it may still be moving", is_bad=True)
        if self.phase is not Phase.FAILED:
            self.phase = Phase.DISCONNECTED
        self.helm.may_move = may_move
        self.readings.clear()
        self._new_edition()
        self._changed()

    async def _part(self, robot: Epuck, *, may_move: bool) -> bool:
        """Stop *robot* and close its link; return whether it is known to stand."""
        stands = not may_move
        try:
            # Asked for by itself: closing stops it too, and does not say whether that was confirmed.
            await robot.within(STANDING_TIME).stop()
            stands = True
        except ElibError as error:
            if robot.session.error is None and self.phase is Phase.CONNECTED:
                self._note("link", str(error).partition("\n")[0], is_bad=True)
        try:
            await robot.close()
        except ElibError as error:
            self._note("link", error.message, is_bad=True)
        return stands

    def _new_edition(self) -> None:
        self.edition += 1

    async def _greet(self, robot: Epuck) -> None:
        """Begin as the joystick of 2011 did: stop, set the camera, all lamps off."""
        await robot.stop()
        profile = robot.session.profile
        beginning: list[Awaitable[object]] = [
            robot.set_camera(*CAMERA),
            robot.set_led(ALL, 0),
            robot.set_body_led(0),
            robot.set_front_led(0),
        ]
        for call in beginning:
            await call
        self.helm.board(profile.ranges.get("wheel_speed", (-1.0, 1.0))[1])

    async def _give_up(self, robot: Epuck, error: Exception) -> None:
        self._robot = None
        with contextlib.suppress(ElibError):
            await robot.close()
        if isinstance(error, TimeoutError) and not isinstance(error, ElibError):
            error = LinkClosed(f"{self.name} took longer than {OPENING_TIME:g} s to open")
        self.error = error if isinstance(error, ElibError) else LinkClosed(f"{self.name}: {error}")
        self.phase = Phase.FAILED
        self._note("link", self.error.message, is_bad=True)
        self._doctor = self._begin(self._ask_doctor())
        self._changed()

    async def _ask_doctor(self) -> None:
        with contextlib.suppress(ElibError, OSError):
            self.diagnosis = await diagnose(self.url)
        self._changed()

    # -- what it says --

    def age(self, name: str) -> float:
        """Return how old a reading is, s; infinite before the first."""
        reading = self.readings.get(name)
        return math.inf if reading is None else max(0.0, self.now - reading.time)

    def is_stale(self, name: str) -> bool:
        """Return whether a reading is too old to be believed."""
        period = self._pictures if name == IMAGE and self._pictures is not None else 1 / RATE
        return self.age(name) > max(STALE, PERIODS * period) or self.phase is not Phase.CONNECTED

    def watch_camera(self, seconds: float | None) -> None:
        """Take a picture every so many seconds, 0.4 at least; None for no more.

        Raises:
            ArgumentError: The time cannot be.
        """
        is_number = isinstance(seconds, int | float) and not isinstance(seconds, bool)
        if seconds is not None and not (is_number and 0.4 <= seconds <= 60):
            raise ArgumentError(f"the time between two pictures is {seconds!r} s; it must be from 0.4 to 60")
        self._pictures = seconds
        if self._watching is not None and self._robot is not None:
            self._watching.cancel()
            self._watching = self._begin(self._watch(self._robot))

    async def take_picture(self) -> Image:
        """Take one picture.

        Raises:
            ElibError: It did not come.
        """
        picture = await self.robot.within(SPECS[IMAGE].timeout).image()
        self.readings[IMAGE] = picture
        return picture

    async def _watch(self, robot: Epuck) -> None:
        """Keep the newest readings; a lost link is waited for."""
        watches = [self._follow(robot, None, RATE)]
        if self._pictures is not None:
            watches.append(self._follow(robot, IMAGE, 1 / self._pictures))
        async with asyncio.TaskGroup() as group:
            for each in watches:
                group.create_task(each)

    async def _follow(self, robot: Epuck, name: str | None, rate: float) -> None:
        while True:
            try:
                async with robot.watch(*([] if name is None else [name]), rate=rate) as snapshots:
                    async for snapshot in snapshots:
                        self.readings.update(snapshot.readings)
                        self._locate(robot)
                return
            except ElibError as error:
                if robot.session.error is not None:
                    self._lost(robot.session.error)
                    return
                self._note("link", f"watching: {error.message}", is_bad=True)
                await asyncio.sleep(0.5)

    def _locate(self, robot: Epuck) -> None:
        control = self.control
        pose = robot.odometry_pose
        if control is not None:
            transport = robot.session.transport
            assert isinstance(transport, SimTransport)
            pose = control.world.pose(transport.robot.index)
        if not self.trail or (pose.x, pose.y) != (self.trail[-1].x, self.trail[-1].y):
            self.trail.append(pose)
            self.trail_count += 1

    def _lost(self, error: ElibError) -> None:
        self.error = error
        self.phase = Phase.FAILED
        robot, self._robot = self._robot, None
        self.performer.halt()
        self.helm.let_go()
        self._note("link", error.message, is_bad=True)
        if robot is not None:
            self._begin(robot.close())
        self._new_edition()
        self._changed()

    # -- what it is told --

    async def command(self, name: str, *arguments: object, page: str = "") -> object:
        """Send one command of the table and return its answer.

        What may set the robot moving has the same dead man's switch as the stick: *page* drives from then on, and has
        to ``helm.beat(page)`` every tenth of a second.

        Args:
            name: Of the command.
            arguments: Its arguments.
            page: Who sends it.

        Raises:
            ArgumentError: There is no such command, an argument is wrong, or another page drives; nothing was sent.
            ElibError: What became of it.
        """
        robot = self.robot
        if name not in SPECS and name not in ACTIONS:
            raise ArgumentError(f"there is no command {name!r}")
        if name == "stop":
            self.helm.stop()
        self._check(name, arguments)
        is_driving = name in WHEELS and not (name == "text" and not str(arguments[0]).lstrip().startswith(("D", "d")))
        if is_driving and not self.helm.watch_over(page):
            raise ArgumentError(f"{name} was not sent: another page drives", hint="take over first")
        timeout = PATIENCE if name not in SPECS else max(PATIENCE, SPECS[name].timeout)
        try:
            return await getattr(robot.within(timeout), name)(*arguments)
        finally:
            if name == "set_speed":
                self.helm.driven(is_moving=any(arguments))
            elif name == "reset":
                self.helm.forget()

    def _check(self, name: str, arguments: tuple[object, ...]) -> None:
        """Check the arguments of a command before anything is sent.

        Raises:
            ArgumentError: One is wrong.
            Unsupported: This firmware has no such command.
        """
        if name in SPECS:
            SPECS[name].request(self.robot.context, *arguments)
            return
        signature = getattr(type(self.robot), name).__signature__
        try:
            signature.bind(*arguments)
        except TypeError as error:
            raise ArgumentError(f"{name}{signature}: {error}") from None
        if name == "text":
            line = arguments[0]
            if not isinstance(line, str) or not 0 < len(line) <= LONGEST_TEXT or not line.isprintable():
                raise ArgumentError(f"a raw command is one line of 1 to {LONGEST_TEXT} characters")
        elif name == "set_obstacle_avoidance" and not isinstance(arguments[0], bool):
            raise ArgumentError(f"on is {arguments[0]!r}; it must be true or false")

    def stop(self) -> None:
        """Stop the robot, past all that waits, and the behaviour that drives it."""
        self.helm.stop()

    # -- who looks --

    def join(self, page: str) -> None:
        """Note that a page looks at the robot."""
        self.performer.join(page)

    def leave(self, page: str) -> None:
        """Note that a page is gone: what it drove stops, and with the last page the behaviour ends.

        One that is only hidden leaves the helm alone: ``helm.leave(page)``.
        """
        self.helm.leave(page)
        self.performer.leave(page)

    async def _drive(self, left: float, right: float) -> None:
        robot = self.robot
        median = robot.statistics.median
        # A lost answer holds up the stop behind it for as long as it is waited for.
        patience = LEAST_PATIENCE if math.isnan(median) else max(LEAST_PATIENCE, min(PATIENCE, TRIPS * median))
        await robot.within(patience).set_speed(left, right)

    async def _stop(self) -> None:
        robot = self.robot
        median = robot.statistics.median
        patience = STANDING_TIME if math.isnan(median) else max(STANDING_TIME, TRIPS * median)
        await robot.within(min(patience, LONGEST_STANDING_TIME)).stop()

    # -- what is kept --

    def start_log(self, path: str) -> None:
        """Append a line for each call to a file.

        Raises:
            ElibError: It cannot be, or the robot is not connected.
        """
        self.stop_log()
        try:
            self.log = self.robot.log(path)
        except OSError as error:
            raise ArgumentError(f"{path!r} cannot be written: {error.strerror or error}") from None
        self._note("panel", f"logging to {path}")

    def stop_log(self) -> None:
        """Log no more."""
        log, self.log = self.log, None
        if log is not None:
            with contextlib.suppress(ElibError):
                log.close()

    def start_recorder(self, path: str) -> None:
        """Record everything into a file that does not exist yet.

        Raises:
            ElibError: It cannot be, or the robot is not connected.
        """
        self.stop_recorder()
        try:
            self.recorder = self.robot.record(path)
        except OSError as error:
            raise ArgumentError(f"{path!r} cannot be written: {error.strerror or error}") from None
        self._note("panel", f"recording to {path}")

    def stop_recorder(self) -> None:
        """Record no more."""
        recorder, self.recorder = self.recorder, None
        if recorder is not None:
            with contextlib.suppress(ElibError):
                recorder.close()

    # -- how --

    def _see(self, time: float, event: TraceEvent) -> None:
        match event:
            case Ended(request=request, error=error) if not isinstance(error, asyncio.CancelledError):
                is_reading = request.spec is None or request.spec.is_reading
                if error is None and (is_reading or self._is_chatter(time, request.name)):
                    return
                text = "ok" if error is None else str(error).partition("\n")[0]
                self._note("call", f"{request.text}: {text}", is_bad=error is not None)
            case LinkDown(error=error):
                self.phase = Phase.GAP
                self.helm.forget()
                self._note("link", f"the link is down: {error.message}", is_bad=True)
            case LinkBack(gap=gap):
                self.phase = Phase.CONNECTED
                self.helm.may_move = False  # the reconnector stops the robot first of all
                self._note("link", f"the link is back after {gap:.1f} s")
            case ResetNoticed() | Greeted():
                self.helm.forget()
                self._note("robot", "the robot has restarted", is_bad=True)
            case Fenced(dropped=dropped):
                self._note("link", f"the line was in doubt; {dropped} bytes were dropped")
            case Called() | _:
                return
        self._changed()

    def _is_chatter(self, time: float, name: str) -> bool:
        """Return whether a command needs no line: a speed soon after another, ten times a second from a stick."""
        if name != "set_speed":
            return False
        if time - self._spoken < CHATTER:
            return True
        self._spoken = time
        return False

    def note(self, text: str, *, kind: str = "note", is_bad: bool = False) -> None:
        """Add a line to the event log."""
        self._note(kind, text, is_bad=is_bad)
        self._changed()

    def _note(self, kind: str, text: str, *, is_bad: bool = False) -> None:
        self.lines.append(Line(self.now, kind, text, is_bad))
        self.line_count += 1

    def _changed(self) -> None:
        self.on_change()

    def _begin(self, work: object) -> asyncio.Task[object]:
        task: asyncio.Task[object] = self._loop.create_task(work, name="elib panel")  # type: ignore[arg-type]
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task


def lines_of(lines: Iterable[Line], kinds: Iterable[str], text: str = "") -> list[Line]:
    """Return the lines of some kinds that hold a text, in any case."""
    wanted = set(kinds)
    return [line for line in lines if line.kind in wanted and text.lower() in line.text.lower()]


__all__ = ["Line", "Phase", "Pilot", "lines_of"]
