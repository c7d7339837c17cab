"""An upload over a transport: stop and reset the robot, write the rows, wait for the new program."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from math import inf

from elib.base.errors import ElibError, NotAnEpuck, RemoteProtocolError, RobotSilent, Unsupported
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.shapes import GREETING
from elib.link.protocol.values import Version
from elib.link.session.opening import RecordingTransport, recognise_robot
from elib.link.transport.base import Transport
from elib.tools.flash.image import EPUCK2_HINT, Image
from elib.tools.flash.protocol import CALL_LIMIT, END_LIGHT, QUIET, Phase, Upload

STOP, STOPPED = b"S\r", b"s\r\n"
RESET, RESETTING = b"R\r", b"r\r"
"""The robot cuts its answer off: the line feed is lost (wire-protocol.md, 1.2)."""
ANSWER_TIME = 1.0
RESET_TIME, RESET_PAUSE = 0.3, 0.1
"""s for the answer to a reset, and from there to the first call: a byte that comes while the chip starts may be read as
another one, and end the window of 1.09 s."""
START_LIMIT = 5.0
"""s from the end of the light to the greeting: BTcom 2.0 takes 1.5 s, because it calibrates (wire-protocol.md, 1.2)."""
NOT_THIS_ROBOT = "only the e-puck1 has the bootloader that elib flash talks to"
BUTTON = f"Press the robot's reset button now; its bootloader is called for {CALL_LIMIT:g} s."
BUTTON_TIME = 1.5
"""s of calls before the person is asked for the button: a bootloader that listens answers sooner."""


class Uploader:
    """Writes one program into the robot at the other end of a transport."""

    def __init__(
        self,
        transport: Transport,
        image: Image,
        number: int,
        *,
        say: Callable[[str], None] = lambda text: None,
        on_row: Callable[[int, int], None] = lambda written, rows: None,
    ) -> None:
        self.upload: Upload | None = None  # the dialogue with the bootloader; None while the robot has not been reset
        self._runs = False  # whether it has said which program it has
        self._transport = transport
        self._rows = image.rows_in_order(number)
        self._say = say
        self._on_row = on_row

    async def run(self) -> Version | bytes:
        """Stop and reset the robot, write the program and start it.

        Returns:
            What the new program says its version is; of a program without sercom what it sends, which may be nothing.

        Raises:
            Unsupported: The robot is not an e-puck1.
            RobotSilent: No bootloader answered within 30 s.
            RemoteProtocolError: The bootloader refused the same row again and again, or did not answer.
            LinkLost: The link broke.
        """
        try:
            await self._reset()
            await self._write(Upload(self._rows, self._now))
            return await self._started()
        except ElibError as error:
            raise type(error)(error.message, hint=f"{self.state} {error.hint}".rstrip()) from error

    @property
    def state(self) -> str:
        """What the robot holds now and what to do, in words."""
        upload = self.upload
        if upload is None or not upload.has_begun:
            if self._runs:
                return "Nothing was written: the robot keeps the program that it had."
            return (
                "Nothing was written, and no program has answered: the robot holds what it held before. After an "
                "upload that was interrupted, that is only a part of a program."
            )
        if upload.phase in (Phase.SETTLING, Phase.DONE):
            return (
                f"All {len(self._rows)} rows are written: the robot starts the new program by itself, or after a reset."
            )
        robot = "runs no program and waits in its bootloader" if upload.is_parked else "may have no whole program"
        return (
            f"{upload.written} of {len(self._rows)} rows are written, and the robot {robot}. Give the same command "
            "again, and press the reset button if you are asked to."
        )

    @property
    def _now(self) -> float:
        return asyncio.get_running_loop().time()

    async def _reset(self) -> None:
        """Stop the robot and reset it, if its program can do that."""
        version = await self._version()
        if isinstance(version, bytes):
            return
        self._runs = True
        if PROFILES[version.firmware].absent.get("reset"):
            raise Unsupported(f"this is not an e-puck1 ({version.text}): {NOT_THIS_ROBOT}", hint=EPUCK2_HINT)
        self._say(f"The robot runs {version.firmware}: {version.text}. It is stopped and reset.")
        if not await self._ask(STOP, STOPPED) and not await self._ask(STOP, STOPPED):
            raise RemoteProtocolError(f"{self._transport.url}: the robot did not confirm that it stands still")
        await self._ask(RESET, RESETTING, RESET_TIME)
        await self._read_until(self._now + RESET_PAUSE)

    async def _version(self) -> Version | bytes:
        """Ask the robot for its version; if no sercom answers, return the bytes that came."""
        recorded = RecordingTransport(self._transport)
        recorded.tells_counters = False  # only odometry needs them
        try:
            _, version, _ = await recognise_robot(recorded, None)
        except (RobotSilent, NotAnEpuck):
            return recorded.received
        return version

    async def _ask(self, request: bytes, answer: bytes, seconds: float = ANSWER_TIME) -> bool:
        """Send a text command and return whether it was answered."""
        received = b""
        await self._transport.write(request)
        end = self._now + seconds
        while answer not in received and self._now < end:
            received += await self._read(end)
        return answer in received

    async def _write(self, upload: Upload) -> None:
        """Write all rows."""
        self.upload = upload
        failures = 0
        button_at = self._now + BUTTON_TIME
        while upload.phase not in (Phase.DONE, Phase.FAILED):
            data = upload.send(self._now)
            if data:
                await self._transport.write(data)
                if upload.phase is Phase.CALLING and not upload.is_parked and self._now >= button_at:
                    self._say(BUTTON)
                    button_at = inf
                continue
            received = await self._read(upload.due)
            if received:
                upload.receive(received, self._now)
                self._on_row(upload.written, len(self._rows))
            if len(upload.failures) > failures and upload.phase is Phase.CALLING:
                failures = len(upload.failures)
                self._say(f"{upload.failures[-1]}; the bootloader is called again.")
                if not upload.is_parked:  # it has started the old program
                    await self._read_until(self._now + QUIET)
                    await self._reset()
                    upload.call_again(self._now)
                    button_at = self._now + BUTTON_TIME
        if upload.phase is Phase.FAILED:
            self._give_up(upload)

    def _give_up(self, upload: Upload) -> None:
        url, reason = self._transport.url, upload.failures[-1]
        if upload.has_begun:
            raise RemoteProtocolError(f"{url}: the upload was given up: {reason}")
        raise RobotSilent(
            f"{url}: {reason}",
            hint="Press the reset button while the command waits. The robot must be an e-puck1 with Tiny Bootloader. "
            + EPUCK2_HINT,
        )

    async def _started(self) -> Version | bytes:
        """Wait until the new program has started."""
        end = self._now + END_LIGHT + START_LIMIT
        received = b""
        while GREETING not in received and self._now < end:
            received += await self._read(end)
        return await self._version()

    async def _read_until(self, time: float) -> None:
        while self._now < time:
            await self._read(time)

    async def _read(self, until: float) -> bytes:
        """Return what arrives up to *until*, s; b"" if nothing does."""
        try:
            async with asyncio.timeout_at(until):
                return await self._transport.read()
        except TimeoutError:
            return b""
