"""One program that is connected: what it may ask of the door itself, a method a message, and what is done.

A message is a JSON object such as ``{"do": "drive", "id": 7, "robot": "1"}``.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated

from msgspec import Meta

from elib import __version__
from elib.base.errors import ArgumentError, ElibError, LinkClosed, LinkLost, MotionInterrupted
from elib.doors.serve import answers
from elib.link.protocol.image import Image
from elib.link.protocol.values import Reading
from elib.panel import lifecycle
from elib.panel.drivelock import DEAD_MAN
from elib.panel.panel import Panel
from elib.panel.server.access import Access, is_same
from elib.panel.server.conversation import Caller, Decode, Error, Message, Table, Trouble
from elib.panel.server.sockets import Socket
from elib.panel.slot import Phase, Slot, may_drive
from elib.robot.actions import CatalogueEntry
from elib.robot.snapshot import WATCHABLE, watched_names
from elib.simulator.emulator.control_server import time_factor

MAX_WATCHES = 8
"""Watches of one program."""
MAX_WAIT = 20.0
"""s within which a request is answered whatever happens; the slowest command, the calibration, has 8 s."""
EVENT_PERIOD = 0.1
"""s between two looks into the event logs."""
SLOWEST, FASTEST = 0.1, 50.0
"""Range of the rate of a watch, Hz: over Bluetooth, no robot answers more than some 40 questions a second."""
AGAIN = 0.2
"""s until a robot is asked again whose link was down, or whose answers did not come."""

POLICY_VIOLATION = 1008
"""Why a program is left that breaks a rule (RFC 6455, 7.4.1)."""

log = logging.getLogger("elib.serve")

Robot = Annotated[str, Meta(max_length=12, description="Key of the robot; not needed where there is only one.")]
Name = Annotated[str, Meta(max_length=20, extra_json_schema={"enum": list(WATCHABLE)})]


DOOR_MESSAGES = Table()
"""The messages that are not commands of the robot, by their names."""


class Client(Caller):
    """One program, from the opening of its WebSocket to its end.

    It is made as every caller; *access* knows the token, and *hello_time* is s that it may take to show it.
    """

    kind = "program"
    served_by = "elib serve"
    max_wait = MAX_WAIT
    logger = log

    def __init__(
        self,
        panel: Panel,
        decode: Decode,
        connection: Socket,
        access: Access,
        hello_time: float,
    ) -> None:
        super().__init__(panel, decode, connection)
        self.is_let_in = access.token is None
        self._name = ""
        self._access = access
        self._address = connection.address
        self._watches: dict[tuple[str, tuple[str, ...]], asyncio.Task[None]] = {}
        self._minded: set[Slot] = set()
        self._halts: dict[Slot, int] = {}  # how often each robot was stopped when the program began to drive it
        self._minding: asyncio.Task[None] | None = None
        self._events: asyncio.Task[None] | None = None
        self._late = self._loop.call_later(hello_time * time_factor(), self._end_stranger)
        if self.is_let_in:
            self.meet()

    # -- what the program says --

    def _end_stranger(self) -> None:
        if not self.is_let_in:
            ending = self.connection.close(POLICY_VIOLATION, "no token came")
            self._ending = asyncio.ensure_future(ending)
            self._ending.add_done_callback(lambda ended: ended.cancelled() or ended.exception())

    def admit(self, message: Message) -> None:
        """Note that the program is still there."""
        self._beat()

    # -- robots --

    def slot(self, key: str) -> Slot:
        """Return a robot by its key, without a key the only one; an ArgumentError says that there is no such robot."""
        slots = self.panel.slots
        if not key:
            if len(slots) != 1:
                raise ArgumentError(f"there are {len(slots)} robots", hint=f'add "robot", one of {_listed(slots)}')
            (key,) = slots
        found = slots.get(key)
        if found is None:
            raise ArgumentError(f"there is no robot {key!r}", hint=f"there are {_listed(slots)}")
        return found

    @DOOR_MESSAGES.request(is_greeting=True)
    def hello(
        self,
        name: Annotated[str, Meta(max_length=80, description="Name of the program, for the event log.")] = "",
        token: Annotated[
            str, Meta(max_length=200, description="The token that the door printed, if it asks for one.")
        ] = "",
    ) -> answers.Welcome:
        """Say who connects, and ask which robots there are. It comes first where a token is needed."""
        access = self._access
        if access.token is not None and not self.is_let_in:
            if not access.may_try(self._address):
                raise ArgumentError("too many wrong tokens came from this address", hint="wait ten seconds")
            if not is_same(token.strip(), access.token):
                raise ArgumentError("this is not the token", hint="elib serve printed it when it began")
            self.is_let_in = True
            self.meet()
        if not name.isprintable():
            raise ArgumentError("the name has characters that cannot be shown")
        self._name = name or self._name
        robots = [
            answers.RobotInfo(
                robot=key,
                name=slot.name,
                url=slot.url,
                firmware=slot.firmware,
                state=slot.phase.name.lower(),
                driver={"": "", self.key: "you"}.get(slot.drive.driver, "another"),
            )
            for key, slot in self.panel.slots.items()
        ]
        return answers.Welcome(answers.PROTOCOL, __version__, robots)

    # -- driving --

    def _beat(self) -> None:
        self.meet()
        for slot in self._met:
            slot.drive.beat(self.key)

    @DOOR_MESSAGES.request()
    def drive(
        self,
        robot: Robot = "",
        *,
        force: Annotated[
            bool, Meta(description="Whether to take over from another driver, who is stopped first.")
        ] = False,
    ) -> None:
        """Take the wheel: from now on this program may move the robot, and no other.

        While the robot may move, the program has to send a message at least every 0.3 s. The first command that moves a
        robot which no client drives takes the wheel, too.
        """
        slot = self.slot(robot)
        connected, before = slot.robot, slot.drive.driver
        if not slot.drive.take(self.key, by_force=force):
            raise _refusal(slot)
        slot.drive.unlatch(self.key)
        self._halts[slot] = slot.drive.stop_count
        self._mind(slot)
        if before != self.key:
            slot.log.note(f"{self._name or self.key} drives {connected.name}")

    @DOOR_MESSAGES.request()
    def leave(self, robot: Robot = "") -> None:
        """Give the wheel back: the robot stops."""
        slot = self.slot(robot)
        self._minded.discard(slot)
        self._halts.pop(slot, None)
        slot.drive.leave(self.key)

    @DOOR_MESSAGES.request()
    def beat(self) -> answers.Driven:
        """Say that the program is still there. The result names the robots that it drives."""
        return answers.Driven([key for key, slot in self.panel.slots.items() if slot.drive.driver == self.key])

    async def command(self, key: str, entry: CatalogueEntry, arguments: Sequence[object]) -> object:
        """Send a command to a robot and return its answer."""
        slot = self.slot(key)
        if may_drive(entry.name, tuple(arguments)):
            if slot.drive.driver not in ("", self.key):
                raise _refusal(slot)
            if self._halts.setdefault(slot, slot.drive.stop_count) != slot.drive.stop_count:
                raise ArgumentError(
                    f"{entry.name} was not sent: somebody has stopped the robot", hint='send {"do": "drive"} to go on'
                )
        try:
            return answers.plain(await slot.command(entry.name, *arguments, page=self.key))
        finally:
            if slot.drive.driver == self.key:
                self._mind(slot)

    async def stop(self, key: str) -> None:
        """Stop a robot, or all; wait until they have confirmed it."""
        connected = [slot for slot in self.panel.slots.values() if slot.is_connected]
        slots = [self.slot(key)] if key or not connected else connected
        ends = await asyncio.gather(*map(self._stop, slots), return_exceptions=True)
        for end in ends:
            if end is not None:
                raise end

    async def _stop(self, slot: Slot) -> None:
        robot, drive = slot.robot, slot.drive
        drive.stop(self.key)
        if slot in self._halts:
            self._halts[slot] += 1
        await robot.within(lifecycle.patience(robot)).stop()

    def _mind(self, slot: Slot) -> None:
        """Tell the program from now on when the robot is stopped under it."""
        self._minded.add(slot)
        if self._minding is None or self._minding.done():
            self._minding = self._loop.create_task(self._mind_all(), name="elib serve minds")

    async def _mind_all(self) -> None:
        moving: dict[Slot, bool] = {}
        told: set[Slot] = set()
        while self._minded:
            await asyncio.sleep(EVENT_PERIOD * time_factor())
            for slot in tuple(self._minded):
                error = self._loss(slot, was_moving=moving.get(slot, True))
                moving[slot] = slot.drive.may_move
                if error is None:
                    told.discard(slot)
                elif slot not in told:
                    told.add(slot)
                    await self.tell(Error(robot=slot.key, error=Trouble.of(error)))
                if slot.drive.driver != self.key:
                    self._minded.discard(slot)
                    told.discard(slot)

    def _loss(self, slot: Slot, *, was_moving: bool) -> ElibError | None:
        """Return why a robot no longer does what the program wants; None if it does, or if it stood anyway."""
        drive = slot.drive
        if slot.phase is not Phase.CONNECTED:
            return slot.error or LinkLost(f"the link to {slot.name} is down")
        if drive.driver == self.key:
            stopped = f"somebody has stopped {slot.name}"
            return MotionInterrupted(stopped, hint='send {"do": "drive"} to go on') if drive.is_latched else None
        if drive.driver or slot.runner.is_active:
            return MotionInterrupted(f"another one drives {slot.name} now")
        if not was_moving:
            return None
        return MotionInterrupted(
            f"{slot.name} was stopped, because no message came for {DEAD_MAN:g} s",
            hint='send {"do": "beat"} every 0.1 s while the robot may move',
        )

    # -- watching --

    @DOOR_MESSAGES.request()
    def watch(
        self,
        robot: Robot = "",
        readings: Annotated[
            tuple[Name, ...],
            Meta(max_length=len(WATCHABLE), description="Names of the readings; all sensors of the firmware if empty."),
        ] = (),
        rate: Annotated[float, Meta(ge=SLOWEST, le=FASTEST, description="Messages a second, Hz.")] = 20.0,
    ) -> answers.Watched:
        """Ask for readings again and again: a ``readings`` message comes so many times a second, or as fast as the link is.

        Several watches of one robot differ in their readings; the same readings again only change the rate.
        """  # noqa: E501  # the schema has its first line
        slot = self.slot(robot)
        context = slot.context or slot.robot.context
        names = watched_names(readings, context.profile)
        where = slot.key, names
        if where not in self._watches and len(self._watches) >= MAX_WATCHES:
            raise ArgumentError(f"there are {MAX_WATCHES} watches, and no more are possible", hint="unwatch one")
        if (old := self._watches.pop(where, None)) is not None:
            old.cancel()
        self._watches[where] = self._loop.create_task(self._watch(*where, float(rate)), name="elib serve watches")
        return answers.Watched(names, rate)

    async def _watch(self, key: str, names: tuple[str, ...], rate: float) -> None:
        """Tell what a robot reads until it is disconnected; a program that does not read misses old readings."""
        missed = 0

        async def tell(time: float, readings: Mapping[str, Reading | Image]) -> None:
            nonlocal missed
            if self.is_behind:
                missed += 1
            else:
                await self.tell(
                    answers.Readings(
                        robot=key, time=round(time, 6), readings=answers.all_plain(readings), missed=missed
                    )
                )

        while (slot := self.panel.slots.get(key)) is not None and slot.phase not in (Phase.DISCONNECTED, Phase.FAILED):
            pause = AGAIN
            try:
                if slot.is_playing:
                    if readings := {name: slot.readings[name] for name in names or WATCHABLE if name in slot.readings}:
                        await tell(slot.now, readings)
                    pause = 1 / rate
                elif slot.is_connected:
                    async with slot.robot.watch(*names, rate=rate) as snapshots:
                        async for snapshot in snapshots:
                            await tell(snapshot.time, snapshot.readings)
            except ElibError:
                pass  # the event log says what happened; the watch goes on when the link is back
            await asyncio.sleep(pause * time_factor())
        error = None if slot is None else slot.error
        over = LinkClosed(f"robot {key} is not connected any more, and nothing can be read")
        self._watches.pop((key, names), None)
        await self.tell(Error(robot=key, error=Trouble.of(error or over)))

    @DOOR_MESSAGES.request()
    def unwatch(
        self,
        robot: Robot = "",
        readings: Annotated[
            tuple[Name, ...],
            Meta(max_length=len(WATCHABLE), description="Names of the readings as in watch; every watch if empty."),
        ] = (),
    ) -> None:
        """End a watch of these readings, or all watches of the robot."""
        own = self.slot(robot).key
        for where in tuple(self._watches):
            if where[0] == own and (not readings or set(where[1]) == set(readings)):
                self._watches.pop(where).cancel()

    @DOOR_MESSAGES.request()
    def events(self, *, on: Annotated[bool, Meta(description="Whether events are wanted.")] = True) -> None:
        """Ask for what happens on the robots and their links, as ``event`` messages, or end that."""
        if self._events is not None:
            self._events.cancel()
            self._events = None
        if on:
            self._events = self._loop.create_task(self._tell_events(), name="elib serve events")

    async def _tell_events(self) -> None:
        """Send every new line of the event logs; a program that does not read loses the oldest ones."""
        told = {slot: slot.log.count for slot in self.panel.slots.values()}
        while True:
            await asyncio.sleep(EVENT_PERIOD * time_factor())
            for key, slot in tuple(self.panel.slots.items()):
                seen = told.get(slot, 0)
                for line in slot.log.since(seen):
                    if self.is_behind:
                        break
                    event = answers.Event(
                        robot=key,
                        time=round(line.time, 6),
                        kind=line.kind,
                        text=line.text,
                        is_bad=line.is_bad,
                        missed=line.number - seen,
                    )
                    seen = line.number + 1
                    await self.tell(event)
                told[slot] = seen

    @property
    def is_behind(self) -> bool:
        """Whether the program has not taken yet what it was sent before."""
        return self.unread > 0

    # -- the end --

    async def close(self) -> None:
        """Leave all robots: what the program drove stops now; every request that waits is answered."""
        self._late.cancel()
        self.events(on=False)
        if self._minding is not None:
            self._minding.cancel()
        for watch in self._watches.values():
            watch.cancel()
        self._watches.clear()
        await super().close()


def _refusal(slot: Slot) -> ArgumentError:
    return ArgumentError(f"another one drives {slot.name}", hint='{"do": "drive", "force": true} takes over')


def _listed(keys: Iterable[str]) -> str:
    return ", ".join(f'"{key}"' for key in keys) or "none"
