"""One robot of the panel: its connection, its newest readings, and the commands that it gets. It needs no page.

Everything runs on the panel's event loop. Every request of a page ends in a value or an error after a bounded time.
"""

from __future__ import annotations

import asyncio
import contextlib
import copy
import dataclasses
import enum

from elib.base.errors import ArgumentError, ElibError, LinkClosed
from elib.base.tasks import Tasks, end_tasks
from elib.link.protocol.actuators import ALL, restoring_calls
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import Reading
from elib.link.session import Disconnected, Ended, Greeted, Reconnected, ResetNoticed, TraceEvent
from elib.link.session.statistics import LinkStats
from elib.link.transport import parse_url
from elib.link.transport.url import Url
from elib.panel import lifecycle
from elib.panel.behaviours import BehaviourRunner
from elib.panel.drivelock import DriveLock
from elib.panel.events import EventLog
from elib.panel.machine import RunningMachine
from elib.panel.playback import Playback
from elib.panel.records import Records
from elib.panel.watching import ReadingsWatcher, virtual
from elib.records.messages import readings_in
from elib.robot.actions import catalogue
from elib.robot.aio import Epuck
from elib.robot.link import Link, LinkSettings
from elib.robot.reconnect import Policy
from elib.robot.snapshot import IMAGE
from elib.robot.watchdog import is_supported
from elib.simulator.emulator.control import Control
from elib.tools.diagnosis.report import Diagnosis

LIVE = 0.5
"""s between two pictures of a virtual robot that a page shows. Each takes the line for 0.1 s at most, so they leave it
four fifths of the time."""
BLINKS, BLINK_TIME = 3, 0.3
"""How often the LEDs blink when a person looks for a robot, and s for which they are on, and off, each time."""
OPENING_TIME = 25.0
"""s that connecting may take, whatever the link does."""
MAX_TEXT = 200
"""Characters of a raw command: the robots' own line buffers are shorter."""


class Phase(enum.Enum):
    """How a robot is connected."""

    DISCONNECTED = "disconnected"
    CONNECTING = "connecting"
    CONNECTED = "connected"
    GAP = "connection lost, trying again"
    PLAYING = "playing a recording"
    WATCHED = "a program drives it"
    FAILED = "not connected"


class Slot:
    """A robot's place in the panel. It outlives its connections."""

    def __init__(self, url: str, *, name: str = "", key: str = "") -> None:
        parse_url(url)
        self.url = url  # URL that will be opened
        self.name = name or url
        self.key = key  # its key in the panel
        self.phase = Phase.DISCONNECTED  # how the robot is connected
        self.error: ElibError | None = None  # why it is not connected, after a failure
        self.diagnosis: Diagnosis | None = None  # what the doctor found after a failure, or None
        self.edition = 0  # a number that changes when firmware, lamps, instruments or world may have changed
        self._loop = asyncio.get_running_loop()
        self.log = EventLog()  # the event log
        self.machine = RunningMachine()
        # the log and the recording that are written of it
        self.records = Records(lambda: self._robot, lambda text, is_bad: self.log.note(text, "panel", is_bad=is_bad))
        # the newest readings, and where the robot was
        self.watcher = ReadingsWatcher(lambda text: self.log.note(text, "link", is_bad=True), self._lost)
        self._parting: asyncio.Task[None] | None = None
        # the drive lock: who drives, and how
        self.drive = DriveLock(lambda *speeds: lifecycle.drive(self.robot, *speeds), lambda: lifecycle.stop(self.robot))
        self.drive.detach()
        self.runner = BehaviourRunner(self)  # runs behaviours on this robot
        self._robot: Epuck | None = None
        self._playback: Playback | None = None
        self._watched: Epuck | None = None
        self._left: Context | None = None
        self._tasks = Tasks()
        self._doctor: asyncio.Task[None] | None = None
        self._opening: asyncio.Task[bool] | None = None
        self.is_always_read = False  # whether its sensors are read while no page is open, too: a door needs them
        self._pages: set[str] = set()
        self._viewers: set[str] = set()
        self._has_live_camera = False
        self._was_live_chosen = False

    # -- the link --

    @property
    def robot(self) -> Epuck:
        """The robot; LinkClosed is raised while it is not connected."""
        if self._playback is not None:
            raise LinkClosed(
                f"{self.name} is a recording: it can be watched, and told nothing",
                hint="replay://FILE?fork=SECONDS goes on from any moment in the simulator",
            )
        if self._watched is not None:
            raise LinkClosed(f"{self.name} belongs to a program", hint="let the program drive it")
        if self._robot is None:
            raise LinkClosed(f"{self.name} is not connected", hint="press Connect")
        return self._robot

    @property
    def is_connected(self) -> bool:
        """Whether there is a robot; also while its lost link is opened again."""
        return self._robot is not None

    @property
    def now(self) -> float:
        """The panel's clock, s."""
        return self._loop.time()

    @property
    def firmware(self) -> str:
        """Name of the firmware; empty without a robot."""
        return "" if self.context is None else self.context.profile.name

    @property
    def context(self) -> Context | None:
        """Firmware of the robot and what was set on it; None without a robot.

        It stays when a program has closed its robot, whose last readings are shown.
        """
        if self._playback is not None:
            return self._playback.context
        return self._left if self._seen is None else self._seen.context

    @property
    def statistics(self) -> LinkStats | None:
        """Statistics of the link; None without a link."""
        return None if self._seen is None else self._seen.statistics

    @property
    def _seen(self) -> Epuck | None:
        """The robot whether this panel or a program drives it."""
        return self._robot or self._watched

    @property
    def control(self) -> Control | None:
        """The control of the robot's world; None unless the robot is simulated in this program."""
        transport = virtual(self._seen)
        if transport is None or transport.simulation.world is None:
            return None
        return Control(transport.simulation)

    @property
    def index(self) -> int:
        """The robot's index in that world."""
        transport = virtual(self._seen)
        return 0 if transport is None else transport.robot.index

    async def connect(self) -> bool:
        """Open the link, stop the robot, set its camera and switch its lamps off; then watch its sensors.

        A recording is played from its beginning instead; at its end it is disconnected. Return whether the robot is
        connected, or the recording is played. If not, :attr:`error` says why, and the doctor looks for the cause.
        """
        if self.phase in (Phase.CONNECTING, Phase.CONNECTED, Phase.GAP, Phase.PLAYING):
            return self.is_connected or self.phase is Phase.PLAYING
        self.phase, self.error, self.diagnosis = Phase.CONNECTING, None, None
        opening = self._opening = self._loop.create_task(self._open(), name="elib panel opens")
        try:
            return await opening
        except asyncio.CancelledError:
            me = asyncio.current_task()
            if me is not None and me.cancelling():
                await end_tasks(opening)
                raise
            return False  # disconnected meanwhile
        finally:
            self._opening = None

    async def _open(self) -> bool:
        await end_tasks(self._doctor)  # it may hold the port
        url = parse_url(self.url)
        if url.scheme == "replay" and "fork" not in url.keys:
            return self._play(url)
        settings = LinkSettings(policy=Policy(during_gap="fail"), watchdog=is_supported())
        robot = Epuck(Link(self.url, self.name, settings))
        try:
            async with asyncio.timeout(OPENING_TIME):
                await robot.__aenter__()
                self._robot = robot
                self.records.begin()
                line, profile = virtual(robot), robot.context.profile
                camera = None if line is None else lifecycle.live_camera(line.simulation.settings.baud, profile.zooms)
                self._has_live_camera = camera is not None or profile.codec == "wifi"
                self.drive.attach(await lifecycle.prepare(robot, camera or lifecycle.CAMERA))
        except (ElibError, OSError, TimeoutError) as error:
            await self._give_up(robot, error)
            return False
        except BaseException:
            self._robot = None
            self.phase = Phase.DISCONNECTED
            await robot.close()
            self.records.break_off()
            raise
        self.phase = Phase.CONNECTED
        self.edition += 1
        robot.trace(self._see)
        self.log.note(f"connected to {self.name} ({robot.firmware})", "link")
        self.watcher.begin(robot)
        self._follow_viewers()
        return True

    def _play(self, url: Url) -> bool:
        """Begin to play a recording; return whether it can be played."""
        try:
            playback = Playback(url)
        except ElibError as error:
            self._fail(error)
            return False
        playback.on_reading = self.watcher.note
        playback.on_pose = self.watcher.put
        playback.on_line = lambda kind, text, is_bad: self.log.note(text, kind, is_bad=is_bad)
        playback.on_program = self.machine.see
        self._playback = playback
        self.machine.forget()
        self.watcher.forget()
        self.phase = Phase.PLAYING
        self.edition += 1
        self.log.note(f"playing {playback.recording.name} ({self.firmware})", "panel")
        self._tasks.begin(self._follow(playback), "elib panel plays")
        return True

    async def _follow(self, playback: Playback) -> None:
        """Play a recording to its end."""
        try:
            await playback.play()
            self.log.note(f"{playback.recording.name} is over", "panel")
        except ElibError as error:
            self._fail(error)
        else:
            self.phase = Phase.DISCONNECTED
        self._playback = None
        self.edition += 1

    def watch(self, robot: Epuck) -> None:
        """Show what a robot tells the program that has opened it, and send nothing to it, until :meth:`unwatch`."""
        self._watched, self.phase = robot, Phase.WATCHED
        self.machine.forget()
        self.edition += 1
        self.watcher.forget()
        robot.trace(self._overhear)

    def unwatch(self) -> None:
        """Note that the program has closed its robot; what it told last stays."""
        self._left = self.context
        self._watched, self.phase = None, Phase.DISCONNECTED
        self.edition += 1

    def _overhear(self, time: float, event: TraceEvent) -> None:
        self.log.see(time, event)
        self.machine.see(event)
        if isinstance(event, Ended) and self._watched is not None:
            for name, reading in readings_in(event.request.name, event.value):
                # The program may have a clock of its own.
                self.watcher.note(name, dataclasses.replace(reading, time=self.now))
            self.watcher.place(self._watched)

    def disconnect(self) -> asyncio.Future[None]:
        """Stop the robot and free its port; also while it is being connected. Safe to repeat.

        It goes on when the task that waits for the returned future is cancelled, as when a page was closed.
        """
        if self._parting is None or self._parting.done():
            self._parting = self._loop.create_task(self._disconnect(), name="elib panel disconnects")
        return asyncio.shield(self._parting)

    async def _disconnect(self) -> None:
        await end_tasks(self._opening)
        robot, self._robot = self._robot, None
        self.runner.halt()
        self.drive.detach()
        await self.watcher.end()
        await self._tasks.end()
        self._playback = None
        if robot is not None:
            error = await robot.stop_and_close()
            if error is None:
                self.drive.note_rest(self.drive.move_count)
            else:
                self.log.note(error.message, "link", is_bad=True)
        await self.runner.stop()
        self.records.stop()
        if robot is not None:
            self.log.note(f"disconnected from {self.name}", "link")
            if self.drive.may_move:
                warning = f"{self.name} did not confirm that it stands: it may still be moving"
                self.log.note(warning, "link", is_bad=True)
        if self.phase is not Phase.FAILED:
            self.phase = Phase.DISCONNECTED
        self.readings.clear()
        self.edition += 1

    async def _give_up(self, robot: Epuck, error: Exception) -> None:
        self._robot = None
        with contextlib.suppress(ElibError):
            await robot.close()
        self.records.break_off()
        if isinstance(error, TimeoutError) and not isinstance(error, ElibError):
            error = LinkClosed(f"{self.name} took longer than {OPENING_TIME:g} s to open")
        self._fail(error if isinstance(error, ElibError) else LinkClosed(f"{self.name}: {error}"))

    def _fail(self, error: ElibError) -> None:
        self.error = error
        self.phase = Phase.FAILED
        self.log.note(self.error.message, "link", is_bad=True)
        self._doctor = self._tasks.begin(self._ask_doctor(), "elib panel asks the doctor")

    async def _ask_doctor(self) -> None:
        from elib.tools.diagnosis.doctor import diagnose  # it needs what opens serial ports

        with contextlib.suppress(ElibError, OSError):
            self.diagnosis = await diagnose(self.url)

    # -- what it says --

    @property
    def readings(self) -> dict[str, Reading | Image]:
        """The newest reading of each kind, by name, with its own time."""
        return self.watcher.readings

    def is_stale(self, name: str) -> bool:
        """Return whether a reading is too old to be trusted."""
        return self.phase not in (Phase.CONNECTED, Phase.PLAYING, Phase.WATCHED) or self.watcher.is_stale(name)

    def watch_camera(self, seconds: float | None) -> None:
        """Take a picture every so many seconds, 0.4 to 60; None ends that."""
        self.watcher.watch_camera(seconds)
        self._was_live_chosen = True

    async def take_picture(self) -> Image:
        """Take one picture; an ElibError says why it did not arrive."""
        request = SPECS[IMAGE].request(self.robot.context)
        picture = await self.robot.within(request.timeout).image()
        self.readings[IMAGE] = picture
        return picture

    def _lost(self, error: ElibError) -> None:
        self.error = error
        self.phase = Phase.FAILED
        robot, self._robot = self._robot, None
        self.runner.halt()
        self.drive.detach()
        self.log.note(error.message, "link", is_bad=True)
        if robot is not None:
            self._tasks.begin(robot.close(), "elib panel closes")
        self.edition += 1

    # -- what it is told --

    async def command(self, name: str, *arguments: object, page: str = "") -> object:
        """Send one command of the table and return its answer.

        A command that may move the robot has the same dead man's switch as the stick: *page* drives from then on, and
        has to call ``drive.beat(page)`` every tenth of a second. After an ArgumentError nothing was sent.
        """
        robot = self.robot
        if name not in catalogue():
            raise ArgumentError(f"there is no command {name!r}")
        catalogue()[name].check(robot.context, *arguments)
        if name == "text" and len(str(arguments[0])) > MAX_TEXT:
            raise ArgumentError(f"a raw command is one line of 1 to {MAX_TEXT} characters")
        if name == "stop":
            self.drive.stop()
        if may_drive(name, arguments) and not self.drive.note_command(page):
            raise ArgumentError(f"{name} was not sent: another page drives", hint="take over first")
        moves = self.drive.move_count
        patient = robot.within(max(lifecycle.patience(robot), SPECS[name].timeout if name in SPECS else 0.0))
        value: object = await getattr(patient, name)(*arguments)
        if name == "set_speed" and not any(arguments):
            self.drive.note_rest(moves)
        elif name == "reset":
            self.drive.invalidate()
        return value

    async def set_camera(self, width: int, height: int, zoom: int, mode: CameraMode) -> None:
        """Set the camera, then light the lamps again that an e-puck1 switches off with it."""
        memory = self.robot.context.last_set
        before = copy.deepcopy(memory)
        await self.command("set_camera", width, height, zoom, mode)
        if memory.lamps != before.lamps:
            before.camera = None  # the new settings stay
            for name, arguments in restoring_calls(before):
                await self.command(name, *arguments)

    async def blink(self) -> None:
        """Let all LEDs blink for about two seconds, then show what they showed before.

        It goes on when the task that waits here is cancelled, as when a page was closed.
        """
        blinking = self._tasks.begin(self._blink(), "elib panel blinks")
        # A page that was closed meanwhile does not ask any more how it ended.
        blinking.add_done_callback(lambda task: task.cancelled() or task.exception())
        await asyncio.wait([blinking])
        if blinking.cancelled():
            raise LinkClosed(f"{self.name} was disconnected while it was to blink")
        blinking.result()

    async def _blink(self) -> None:
        before = copy.deepcopy(self.robot.context.last_set)
        before.camera = None
        for _ in range(BLINKS):
            for action in (1, 0):
                await self.command("set_led", ALL, action)
                await asyncio.sleep(BLINK_TIME)
        for name, arguments in restoring_calls(before):
            await self.command(name, *arguments)

    @property
    def playback(self) -> Playback:
        """The recording that is played; an ArgumentError says that there is none."""
        if self._playback is None:
            raise ArgumentError(f"{self.name} is not a recording that is being played", hint="press Play")
        return self._playback

    @property
    def is_playing(self) -> bool:
        """Whether a recording is played."""
        return self._playback is not None

    def stop(self) -> None:
        """Stop the robot, past all commands that wait, and the behaviour that drives it."""
        self.drive.stop()

    # -- pages --

    def join(self, page: str) -> None:
        """Note that a page is open that may show the robot."""
        self._pages.add(page)
        self.watcher.wake()

    def look(self, page: str) -> None:
        """Note that a page shows the robot's camera: a virtual robot's is live, unless a person chose otherwise."""
        self._viewers.add(page)
        self._follow_viewers()

    def look_away(self, page: str) -> None:
        """Note that a page no longer shows the robot's camera."""
        self._viewers.discard(page)
        self._follow_viewers()

    def _follow_viewers(self) -> None:
        wanted = LIVE if self._viewers and self._has_live_camera else None
        if not self._was_live_chosen and wanted != self.watcher.pictures:
            self.watcher.watch_camera(wanted)

    def leave(self, page: str) -> None:
        """Note that a page is closed: if it drove, the robot stops; with the last page the behaviour ends.

        After the last page the robot's sensors are no longer read, unless a door needs them, or a log or a recording is
        written. A page that is only hidden calls ``drive.leave(page)`` instead.
        """
        self.drive.leave(page)
        self.look_away(page)
        self._pages.discard(page)
        if not self._pages:
            self.runner.halt("ended, because the last page was closed")
            if not self.records.is_writing and not self.is_always_read:
                self.watcher.rest()

    # -- events --

    def _see(self, time: float, event: TraceEvent) -> None:
        self.log.see(time, event)
        self.machine.see(event)
        match event:
            case Disconnected():
                self.phase = Phase.GAP
                self.drive.invalidate()
            case Reconnected():
                self.phase = Phase.CONNECTED
                self.drive.note_rest(self.drive.move_count)  # the reconnector stops the robot first of all
            case ResetNoticed() | Greeted():
                self.drive.invalidate()
            case _:
                pass


def may_drive(name: str, arguments: tuple[object, ...]) -> bool:
    """Return whether the robot may drive on by itself after a command."""
    if name == "text":  # the e-puck2 reads small letters as capitals
        return str(arguments[0]).lstrip().upper().startswith("D")
    return catalogue()[name].wheels == "drive"
