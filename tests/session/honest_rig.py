"""A real emulated robot on a faulty link, whose every reading carries its own number and time."""

import asyncio
import contextlib
import math
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass, field

from elib.base.errors import ElibError, LocalProtocolError, ReplyTimeout
from elib.base.timebase import SimulatedLoop
from elib.link.protocol.camera import CameraWindow
from elib.link.protocol.commands import SPECS
from elib.link.protocol.image import Image
from elib.link.protocol.table import Request
from elib.link.protocol.values import AmbientLight, CameraSettings, Distance, Microphones, Steps, Wheels
from elib.link.session import GRACE, MAX_SILENCE_WAIT, PICTURE_SILENCE, Session
from elib.link.transport import open_transport
from elib.link.transport.base import BufferedTransport, Transport
from elib.link.transport.memory import memory_pair
from elib.link.transport.pty import PtyTransport
from elib.simulator.emulator.emulator import Emulator
from elib.simulator.emulator.faults import Fault
from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.hardware import Lights
from elib.simulator.emulator.link import Link


def block(seconds: float) -> None:
    """Let the event loop do nothing for *seconds* of simulated time, as a program that computes would."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, SimulatedLoop)
    loop._set_time(loop.time() + seconds)


Call = tuple[str, tuple[object, ...], float, float, bool]
"""One call: row, arguments, timeout, pause before it, and whether the program waits for its end."""
NUMBERS = 3800
"""Readings are numbered modulo this: every count stays within the converter's 12 bits."""


class NumberedHardware(FixedHardware):
    """Every reading is a new number, and its time is kept; every act is kept too."""

    def __init__(self, firmware: str) -> None:
        super().__init__(firmware=firmware)
        self.clock = 0.0
        self.number = 0
        self.readings: dict[str, list[tuple[float, int]]] = {}
        self.acts: list[tuple[float, str, object]] = []

    def advance(self, time: float) -> None:
        self.clock = time

    def _next(self, kind: str) -> int:
        self.number = self.number % NUMBERS + 1
        self.readings.setdefault(kind, []).append((self.clock, self.number))
        return self.number

    def ambient_light(self) -> list[int]:
        return [self._next("ambient_light")] * 10

    def distance(self) -> int:
        return self._next("distance")

    def picture(self, window: CameraWindow) -> bytes:
        number = self._next("image")
        size = window.width * window.height * (1 if window.mode == 0 else 2)
        return number.to_bytes(2, "big") + bytes(max(0, size - 2))

    def drive(self, left: float, right: float) -> None:
        self.acts.append((self.clock, "drive", (left, right)))

    def show(self, lights: Lights) -> None:
        self.acts.append((self.clock, "show", (lights.body, lights.front)))


@dataclass
class Outcome:
    """How one call ended."""

    name: str
    args: tuple[object, ...]
    called: float
    deadline: float
    ended: float = math.nan
    value: object = None
    error: BaseException | None = None
    ends: int = 0


@dataclass
class HonestRig:
    session: Session
    hardware: NumberedHardware
    link: Link
    origin: float
    outcomes: list[Outcome] = field(default_factory=list)
    blocked: list[tuple[float, float]] = field(default_factory=list)
    silences: list[float] = field(default_factory=list)
    """How long each thing beside the faults keeps the robot from answering, s."""

    def block_at(self, delay: float, seconds: float) -> None:
        """Block the event loop in *delay* s, for *seconds*."""
        loop = asyncio.get_running_loop()

        def busy() -> None:
            began = loop.time()
            block(seconds)
            self.blocked.append((began, loop.time()))

        loop.call_later(delay, busy)

    def restart(self) -> None:
        """Press the robot's reset button."""
        self.link.robot.press_reset(asyncio.get_running_loop().time() - self.origin)
        self.link.catch_up()

    def request(self, name: str, *args: object) -> Request[object]:
        return SPECS[name].request(self.session.context, *args)

    async def call(self, name: str, *args: object, within: float) -> Outcome:
        """Make one call and keep how it ended."""
        loop = asyncio.get_running_loop()
        outcome = Outcome(name, args, loop.time(), loop.time() + within)
        self.outcomes.append(outcome)
        try:
            outcome.value = await self.session.execute(self.request(name, *args), within)
        except ElibError as error:
            outcome.error = error
        outcome.ends += 1
        outcome.ended = loop.time()
        return outcome

    async def play(self, script: Iterable[Call], blocks: Iterable[tuple[float, float]] = ()) -> None:
        """Make the calls, some one after the other and some at once, and block the loop meanwhile."""
        at = 0.0
        for gap, seconds in blocks:
            at += gap
            self.block_at(at, seconds)
        running: list[asyncio.Task[Outcome]] = []
        for name, args, within, gap, waits in script:
            await asyncio.sleep(gap)  # clock: simulated
            task = asyncio.ensure_future(self.call(name, *args, within=within))
            running.append(task)
            if waits:
                await task
        await asyncio.gather(*running)

    def check(self, outcome: Outcome, *, punctual: bool = True) -> None:
        """Compare one outcome with what the robot really did, and when."""
        limit = outcome.deadline + GRACE
        if outcome.name == "image":
            limit += MAX_SILENCE_WAIT + PICTURE_SILENCE
        for began, ended in self.blocked:
            if began <= limit:
                limit = max(limit, ended)  # nothing can end while the loop is blocked
        assert not isinstance(outcome.error, LocalProtocolError), outcome
        assert outcome.ends == 1, f"{outcome} ended {outcome.ends} times"
        assert not punctual or outcome.ended <= limit + 1e-9, f"{outcome} ended {outcome.ended - limit} s too late"
        value = outcome.value
        if isinstance(outcome.error, ReplyTimeout) and outcome.error.image is not None:
            value = outcome.error.image
        elif outcome.error is not None:
            return
        began, ended = outcome.called - self.origin - 1e-9, outcome.ended - self.origin + 1e-9
        match value:
            case AmbientLight():
                assert set(value) == {value[0]}
                self._was_read("ambient_light", value[0], began, ended)
            case Distance():
                self._was_read("distance", round(value.metres * 1000), began, ended)
            case Image():
                self._was_read("image", int.from_bytes(value.raw[:2], "big"), began, ended)
            case Wheels():
                speeds = [(0.0, 0.0)] + [args for time, args in self._asked_speeds() if time <= ended]
                assert (value.left, value.right) in speeds
            case None if outcome.name == "set_speed":
                self._was_done("drive", None, began, ended)
            case None if outcome.name == "stop":
                self._was_done("drive", (0, 0), began, ended)
            case None if outcome.name == "set_body_led":
                self._was_done("show", (outcome.args[0], ...), began, ended)
            case None if outcome.name == "set_front_led":
                self._was_done("show", (..., outcome.args[0]), began, ended)
            case CameraSettings() | Steps() | Microphones() | None:
                pass
            case _:
                assert value is not None

    def _asked_speeds(self) -> Iterable[tuple[float, tuple[object, ...]]]:
        return [(o.called - self.origin, o.args) for o in self.outcomes if o.name == "set_speed"]

    def _was_read(self, kind: str, number: int, began: float, ended: float) -> None:
        times = [time for time, found in self.hardware.readings.get(kind, []) if found == number]
        assert any(began <= time <= ended for time in times), (
            f"{kind} {number} was read at {times}, not between {began} and {ended}: a stale value"
        )

    def _was_done(self, kind: str, wanted: tuple[object, ...] | None, began: float, ended: float) -> None:
        for time, what, found in self.hardware.acts:
            if what == kind and began <= time <= ended:
                assert isinstance(found, tuple)
                if wanted is None or all(w is ... or w == f for w, f in zip(wanted, found, strict=True)):
                    return
        raise AssertionError(f"confirmed, but no {kind} {wanted} between {began} and {ended}")


@contextlib.asynccontextmanager
async def honest_rig(
    firmware: str,
    *,
    latency: float = 0.0,
    jitter: float = 0.0,
    seed: int = 0,
    faults: Iterable[Fault] = (),
    pty: bool = False,
) -> AsyncIterator[HonestRig]:
    """A session with an emulated robot; *faults* change its answers one after the other once the session is open."""
    far: BufferedTransport
    host: Transport
    if pty:
        far = PtyTransport()
        host = await open_transport(far.url)
    else:
        host, far = memory_pair()
    hardware = NumberedHardware(firmware)
    emulator = Emulator(firmware, hardware, booted=True)
    link = Link(emulator, latency=latency, jitter=jitter, seed=seed)
    link.attach(far)
    origin = link.loop_time(0.0)  # a busy computer may pause between two looks at the clock
    session = await Session.open(host)
    link.faults.extend(faults)
    try:
        yield HonestRig(session, hardware, link, origin)
    finally:
        await session.close()
        link.close()
        await far.close()
