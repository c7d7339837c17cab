"""The marker's end of a lock-step link: it owns the world, keeps the time, and believes nothing that comes.

It takes frames and gives frames; what carries them, a socket or a call, is another's.
docs/decisions/0023-the-marker-owns-the-simulator.md describes the frames; elib.lab.lockstep is the other end.
"""

from __future__ import annotations

import asyncio
import hashlib
import struct
from collections import Counter
from collections.abc import Callable

from elib.base.errors import ArgumentError, LinkNotFound
from elib.lab import lockstep
from elib.lab.goals import Requests
from elib.lab.labfile import Lab, Variant, settings_of
from elib.lab.tracer import AFTERWARDS, End, Ending, Tracer, VariantResult
from elib.link.protocol.profiles import profile_named
from elib.link.transport.memory import MemoryTransport
from elib.records.decoding.lines import Kind
from elib.records.decoding.wifi import AnyDecoder, decoder_of
from elib.simulator.emulator.simulation import Simulation, VirtualRobot

WALL = 60.0
"""s of the wall clock for one variant."""
GRACE = 2.0
"""s of the wall clock in which a program may end after its time was over."""
MAX_KEPT = 1_000_000
"""Bytes that wait for one robot. elib's own side waits long before, at 65,536."""


class RunOver(Exception):
    """A run is over before its program has ended; the text says why."""

    def __init__(self, ending: Ending, why: str) -> None:
        super().__init__(why)
        self.ending: Ending = ending


class BrokenRule(RunOver):
    """The program sent what elib's own side never sends."""

    def __init__(self, what: str) -> None:
        super().__init__("broke", f"it broke the link's rules: it sent {what}")


def wall_over(limit: float) -> RunOver:
    """Return the end of a program that was not done when its time by the wall clock was over."""
    return RunOver("wall", f"it was not done after {limit:g} s of the wall clock")


class _End(MemoryTransport):
    """The end of a robot's link that the program has, as long as it has it open."""

    def __init__(self, index: int, robot: VirtualRobot, on_news: Callable[[], None]) -> None:
        self._told = 0  # wake_writer reads it from the beginning
        self._on_news = on_news
        super().__init__("the robot")
        self.index = index
        self.arrived = bytearray()
        robot_end = MemoryTransport("the robot")
        self.join(robot_end)
        robot.link.on_down = self._down
        self._robot = robot
        robot.link.attach(robot_end)
        self.listen(self._arrive, on_news)

    def take(self, data: bytes) -> None:
        """Send what the program wrote."""
        self._push(data)

    def kept(self) -> int:
        """Return how many bytes the robot's link has not taken, and note that the program knows."""
        self._told = self.unsent
        return self._told

    def news(self) -> bytes:
        """Return what the program does not know yet."""
        found = b""
        if self.arrived or self.unsent != self._told:
            data = bytes(self.arrived)
            self.arrived.clear()
            found = lockstep.NEWS.pack(self.index, self.kept(), False, len(data)) + data
        if self.loss is not None:
            text = f"{self.loss.message}\n{self.loss.hint}".encode()
            found += lockstep.NEWS.pack(self.index, 0, True, len(text)) + text
        return found

    def wake_writer(self) -> None:
        """Note that the link has taken bytes."""
        super().wake_writer()
        if self.unsent != self._told:
            self._on_news()

    def _arrive(self, data: bytes) -> None:
        self.arrived += data
        self._on_news()

    def _down(self) -> None:
        player = self._robot.player
        if player is not None and player.is_cut:
            self.lose(
                f"the link was cut at {player.time:.3g} s, as the fault script says",
                hint="open it again when that is over",
            )


class Marker:
    """Serves one program in one variant of a lab, on the running event loop, a simulated one.

    Args:
        lab: The lab.
        variant: The variant.
        send: Sends a frame to the program.
        rival: Serves the first program of a game; this one has the other half of the robots in the same world.
    """

    def __init__(
        self, lab: Lab, variant: Variant, send: Callable[[bytes], object], rival: Marker | None = None
    ) -> None:
        assert variant.time is not None
        simulation = Simulation(settings_of(variant)) if rival is None else rival.simulation
        self.simulation: Simulation = simulation  # the world and the robots, which both programs of a game share
        self.tracer: Tracer = Tracer(lab, variant, simulation) if rival is None else rival.tracer  # and their judge
        self._player = 0 if rival is None else 1
        share = lab.share(simulation.count, self._player)
        self._first = share.start
        self._robots = [simulation.robots[index] for index in range(share.start, share.stop)]
        self._until = variant.time
        self._send = send
        self._requests: Counter[str] = Counter()
        self._transcript = hashlib.blake2b(digest_size=16)
        self._loop = asyncio.get_running_loop()
        self._ends: dict[int, _End] = {}
        self._waiter: asyncio.Future[None] | None = None
        self._has_met = False
        self._decoders: list[AnyDecoder] = []
        if any(isinstance(goal, Requests) for goal in lab.goals):
            self._decoders = [decoder_of(robot.firmware) for robot in self._robots]

    async def take(self, frame: bytes) -> None:
        """Do what a frame of the program says, and answer it.

        Raises:
            RunOver: The program broke the link's rules, or the lab's time is over and it was told.
        """
        self._transcript.update(frame)
        letter, body = frame[lockstep.LETTER.size - 1], frame[lockstep.LETTER.size :]
        if letter == lockstep.GO:
            await self._go(self._one(lockstep.TIME, body))
        else:
            self._obey(letter, body)

    def note(self, end: End) -> End:
        """Note how the program has ended, now, and return it."""
        self._end, self._ended = end, self.simulation.time
        return end

    async def afterwards(self, *ends: End) -> None:
        """Let the world go on for a while if all its programs have ended by themselves."""
        if all(code is not None for _, _, code in ends):
            await asyncio.sleep(AFTERWARDS)

    def result(self, output: str) -> VariantResult:
        """Return what became of a program, when its world has come to its end."""
        digest = self._transcript.hexdigest()
        return self.tracer.judged(self._end, self._ended, self._requests, output, digest, self._player)

    def close(self) -> None:
        """End the world."""
        self.simulation.close()

    def _answer(self, letter: int, body: bytes) -> None:
        frame = lockstep.LETTER.pack(1 + len(body), letter) + body
        self._transcript.update(frame)
        self._send(frame)

    # -- the frames --

    def _obey(self, letter: int, body: bytes) -> None:
        if letter == lockstep.HELLO:
            if self._has_met or body != bytes((lockstep.VERSION,)):
                raise BrokenRule("a hello that is wrong, or a second one")
            self._has_met = True
            codecs = "".join(profile_named(robot.firmware).codec[0] for robot in self._robots).encode()
            self._answer(
                lockstep.HELLO, lockstep.GREETING.pack(lockstep.VERSION, self._loop.time(), len(codecs)) + codecs
            )
            return
        if not self._has_met:
            raise BrokenRule("something before its hello")
        if letter not in (lockstep.OPEN, lockstep.CLOSE, lockstep.WRITE, lockstep.SAY, lockstep.HEAR):
            raise BrokenRule(f"the unknown letter {bytes((letter,))!r}")
        index = self._one(lockstep.ROBOT, body[: lockstep.ROBOT.size])
        rest = body[lockstep.ROBOT.size :]
        if rest and letter not in (lockstep.WRITE, lockstep.SAY):
            raise BrokenRule(f"a frame {bytes((letter,))!r} that is too long")
        if letter == lockstep.OPEN:
            self._open(index)
            return
        end = self._ends.get(index)
        if end is None:
            raise BrokenRule(f"something for robot {index + 1}, which is not open")
        if letter == lockstep.CLOSE:
            del self._ends[index]
            end.abort()
        elif letter == lockstep.WRITE:
            self._write(end, rest)
        elif letter == lockstep.SAY:
            self._say(index, rest)
        else:
            self._hear(index)

    def _one(self, form: struct.Struct, body: bytes) -> int:
        if len(body) != form.size:
            raise BrokenRule(f"{len(body)} bytes in the place of {form.size}")
        [value] = form.unpack(body)
        return value  # type: ignore[no-any-return]  # struct's answer has no type

    def _open(self, index: int) -> None:
        if not 0 <= index < len(self._robots) or index in self._ends:
            raise BrokenRule(f"robot {index + 1}, which does not exist or is open already")
        robot = self._robots[index]
        try:
            robot.check_link("")
        except LinkNotFound as error:
            self._answer(lockstep.OPEN, f"{error.message.removeprefix(': ')}\n{error.hint}".encode())
            return
        self._ends[index] = _End(index, robot, self._wake)
        self._answer(lockstep.OPEN, b"")

    def _write(self, end: _End, data: bytes) -> None:
        if not data or end.unsent + len(data) > MAX_KEPT:
            raise BrokenRule("no bytes, or more than a robot's link can keep")
        if self._decoders:
            for line in self._decoders[end.index].feed("to robot", None, data):
                if line.kind in (Kind.REQUEST, Kind.SWALLOWED):
                    self._requests.update(call.name for call in line.calls)
        if end.is_open:
            end.take(data)
        self._answer(lockstep.WRITE, lockstep.KEPT.pack(end.kept()))

    def _say(self, index: int, message: bytes) -> None:
        world = self.simulation.world
        assert world is not None
        try:
            world.send_message(self._first + index, message, at=self.simulation.time)
        except ArgumentError as error:
            raise BrokenRule(f"a message that cannot be: {error}") from None

    def _hear(self, index: int) -> None:
        world, robot = self.simulation.world, self._robots[index]
        assert world is not None
        robot.link.catch_up()
        robot.hardware.advance(robot.link.now)
        heard = (
            lockstep.HEARD.pack(each.distance, each.bearing, each.time, len(each.message)) + each.message
            for each in world.neighbours(self._first + index)
        )
        self._answer(lockstep.HEAR, b"".join(heard))

    # -- the time --

    async def _go(self, until: float) -> None:
        if not self._has_met or not until >= self._loop.time():  # not a number is not greater either
            raise BrokenRule(f"a time that has passed, or is not a time: {until}")
        news = self._news()
        if not news:
            self._waiter = self._loop.create_future()
            timer = self._loop.call_at(min(until, self._until), self._wake)
            await self._waiter
            self._waiter = None
            timer.cancel()
            news = self._news()
        now = self._loop.time()
        if now >= self._until:
            self._answer(
                lockstep.GO, lockstep.PASSED.pack(now, True) + f"the lab's time of {self._until:g} s is over".encode()
            )
            raise RunOver("time", f"it was not done after {self._until:g} s of robot time")
        self._answer(lockstep.GO, lockstep.PASSED.pack(now, False) + news)

    def _wake(self) -> None:
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    def _news(self) -> bytes:
        news = []
        for index, end in tuple(self._ends.items()):
            news.append(end.news())
            if end.loss is not None:
                del self._ends[index]
        return b"".join(news)
