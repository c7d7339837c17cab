"""The emulator of an e-puck2 that is reached over Wi-Fi: the ESP32 in front of the emulated main processor.

The ESP32 is a TCP server that streams packets. It has three tasks, which are three generators here: one serves the
client, one exchanges commands and readings with the main processor over their serial line, and one fetches pictures
from the camera. Each task yields when it wants to go on: a time, and a condition that may come true before.

The durations of the exchange and the picture's way between the chips are those of the sources (wire-protocol.md, 4.4);
that of the states was measured. Times of the network are not here: :mod:`elib.simulator.emulator.wifi_link` adds them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from math import inf

from elib.simulator.emulator.emulator import Chunk, Emulator
from elib.simulator.emulator.firmware.epuck2 import BLUE, DARK, GREEN, EPuck2Wifi
from elib.simulator.emulator.hardware import Hardware
from elib.simulator.emulator.timing import Timing

COMMAND_SIZE = 21
"""Bytes of a command (wire-protocol.md, 4.2)."""

COMMAND_ID = 0x80
"""First byte of a command (wire-protocol.md, 4.2)."""

WANTS_IMAGE, WANTS_SENSORS = 0x01, 0x02
"""Bits of a command's second byte (wire-protocol.md, 4.2)."""

IMAGE, SENSORS, EMPTY = b"\x01", b"\x02", b"\x03"
"""First bytes of the robot's packets (wire-protocol.md, 4.3)."""

SEND_BUFFER = 5744
"""Bytes that the robot's TCP keeps until the client has acknowledged them (wire-protocol.md, 4.4)."""

CROWD = 5 * COMMAND_SIZE
"""Waiting bytes from which on all commands but the newest are thrown away (wire-protocol.md, 4.2)."""

STEP = 0.01075
"""s of each state of the task which serves the client: it sleeps 10 ms (wire-protocol.md, 4.4), and works for the rest,
so that packets come every 21.5 ms (measured-robots: latency.wifi_packet)."""

ANSWER_SIZE = 103
"""Bytes of the main processor's answer (wire-protocol.md, 4.4)."""

ANSWER_TIMEOUT = 0.05
"""s without a byte after which the ESP32 waits no longer for the rest of an answer (its source, uart_e-puck2.c)."""

SILENCE = 0.005
"""s of silence that must follow an answer (wire-protocol.md, 4.4)."""

DISCARDED = 1.0
"""s of pause after an answer of another length (wire-protocol.md, 4.4)."""

CAPTURE = 0.1
"""s from the request of a picture until it is in the main processor's memory.

Pictures then come every 137 ms, as was measured (measured-robots: latency.wifi_picture); how much of that the camera
takes is not known.
"""

SPI_RATE = 10_500_000
"""bit/s of the line that pictures take (wire-protocol.md, 4.4)."""

PAUSE = 0.000_425
"""s between two blocks on that line (wire-protocol.md, 4.4, which says 0.35 to 0.5 ms for the short one)."""

TRANSFER = (12 + 38_400) * 8 / SPI_RATE + (2 + 7 * 1 + 3 * 3) * PAUSE
"""s that a picture takes from chip to chip: a header of 12 bytes, nine blocks of 4092 bytes and one of 1572.

The pause is double behind the header and threefold behind the last three blocks (wire-protocol.md, 4.4).
"""

NETWORK_START = 3.0
"""s from power-on until the ESP32 has joined the network and listens. It is a guess: no source gives it."""

ANSWERING = frozenset((3, 15))
"""Selector positions in which the main processor answers on its line to the ESP32 (wire-protocol.md, 1.1)."""

WIFI_POSITION = 15
"""Selector position in which the main processor also hands out pictures (wire-protocol.md, 4.1)."""

Wait = tuple[float, Callable[[], bool] | None]
"""Until when a task waits at the latest, s, and the condition that lets it go on earlier."""

TaskSteps = Generator[Wait, None, None]


class Connection:
    """One client's TCP connection, as the robot's side has it.

    Attributes:
        is_ended: Whether the client will send nothing more.
        is_closed: Whether the client does not read any more either: what is sent to it is refused.
        is_reset: Whether the connection is dead, so that reading and sending fail.
    """

    def __init__(self) -> None:
        self.received = bytearray()  # bytes that the robot has not read
        self.unacknowledged = 0  # bytes in the robot's send buffer
        self.is_ended = self.is_closed = self.is_reset = False


class EspTask:
    """A task of the ESP32."""

    def __init__(self, steps: TaskSteps, at: float) -> None:
        self._steps = steps
        self.at = at  # when it goes on at the latest, s
        self.condition: Callable[[], bool] | None = None  # it goes on earlier when this is true; None never is

    def run(self, now: float) -> bool:
        """Go on if it can; return whether it could."""
        if self.at > now and (self.condition is None or not self.condition()):
            return False
        self.at, self.condition = next(self._steps)
        return True


class WifiEmulator(Emulator):
    """A virtual e-puck2 at the other end of a TCP connection.

    The base class is its main processor, at the end of the serial line to the ESP32. What the caller hands in and gets
    out is what goes over the network. A client is announced by :meth:`connect`. One client is served at a time; one
    more waits, and hears nothing meanwhile.

    Args:
        firmware: ``epuck2-wifi``.
        hardware: The hardware that the firmware runs on. The emulator advances it before each access.
        timing: How long the main processor's work takes; None for its own durations.
        booted: Whether the robot is on already and listens.

    Attributes:
        is_stuck: Whether a client left without a valid command. As the real robot, it then accepts no other client
            until it is switched off and on (wire-protocol.md, 4.1).
    """

    firmware: EPuck2Wifi  # the running firmware of the main processor

    def __init__(
        self, firmware: str, hardware: Hardware, *, timing: Timing | None = None, booted: bool = False
    ) -> None:
        super().__init__(firmware, hardware, timing=timing, booted=booted)
        self._now = 0.0
        self.on_stuck: Callable[[], None] | None = None  # called when that happens
        self._switch_on(0.0 if booted else NETWORK_START)

    # -- the interface for the caller --

    def connect(self, time: float) -> None:
        """Let a client connect at *time*, s; what the robot sends from now on is for this one."""
        self._touch(time)
        self._newest = Connection()
        self._waiting.append(self._newest)

    def end_of_input(self, time: float) -> None:
        """Let the client send nothing more, at *time*, s; it still reads."""
        self._touch(time)
        self._newest.is_ended = True

    def disconnect(self, time: float, *, reset: bool = False) -> None:
        """Let the client leave at *time*, s.

        Args:
            time: When.
            reset: Whether the connection breaks at once. Otherwise it is closed in good order, and the robot notices
                when it sends.
        """
        self._touch(time)
        self._newest.is_ended = self._newest.is_closed = True
        if reset:
            self._newest.is_reset = True
        self._packets.clear()
        self._newest.unacknowledged = 0

    def acknowledge(self, count: int, time: float) -> None:
        """Free *count* bytes of the send buffer, at least one, at *time*, s: the client has them."""
        self._touch(time)
        self._newest.unacknowledged = max(0, self._newest.unacknowledged - count)

    def receive(self, data: bytes, time: float) -> None:
        """Hand *data* from the client to the robot at *time*, s."""
        self._touch(time)
        if not self._is_hung:
            self._newest.received += data

    def advance(self, time: float) -> list[Chunk]:
        """Run everything that is due up to *time*, s.

        Returns:
            What the robot has sent to the newest client up to then, in order.
        """
        if self._is_touched:
            self._run_tasks()
        event = self._next_task()
        while event <= time:
            self._now = max(self._now, event)
            self._run_tasks()
            event = self._next_task()
        self._now = max(self._now, time)
        self._hear(super().advance(time))
        sent = list(self._packets)
        self._packets.clear()
        return sent

    @property
    def due(self) -> float | None:
        """When :meth:`advance` has something to do next, s; None while only a client can change that."""
        if (self._packets or self._is_touched) and not self._is_hung:
            return self._now
        event = self._next_task()
        return None if event == inf else event

    @property
    def is_idle(self) -> bool:
        """Whether nothing will happen until a client does something."""
        return self.due is None

    @property
    def unread(self) -> int:
        """How many bytes of the newest client the robot has not read yet."""
        return len(self._newest.received)

    def power_cycle(self, time: float) -> None:
        """Take the battery out and put it back at *time*, s: every connection is lost."""
        super().power_cycle(time)
        self._now = max(self._now, time)
        self._switch_on(time + NETWORK_START)

    # -- its parts --

    def _switch_on(self, listens_at: float) -> None:
        """Start the ESP32; the main processor has read its selector."""
        position = self._hardware.selector()
        self._answers, self._has_pictures = position in ANSWERING, position == WIFI_POSITION
        self._newest = Connection()
        self._newest.is_reset = True
        self._waiting: deque[Connection] = deque()
        self._packets: deque[Chunk] = deque()
        self._actuators = bytes(19)
        self._heard = bytearray()
        self._sending_until = -inf
        self._sensors: bytes | None = None
        self._picture: bytes | None = None
        self._films = False
        self.is_stuck = False
        self._is_touched = True
        self._count = 0
        self._show(DARK)
        self._tasks = (
            EspTask(self._exchange(), listens_at),
            EspTask(self._film(), listens_at),
            EspTask(self._serve(), listens_at),
        )

    def _next_task(self) -> float:
        """Return when a task, or the main processor, does something next."""
        if self._is_hung:
            return inf
        event = min(task.at for task in self._tasks)
        if self._now >= self._sending_until:  # until then there are only bytes on their way, read all together
            main = super().due
            if main is not None:
                event = min(event, main)
        return event

    def _run_tasks(self) -> None:
        """Run the main processor up to now, and each task as far as it can."""
        if self._is_hung:
            return
        self._hear(super().advance(self._now))
        while any(task.run(self._now) for task in self._tasks):
            pass
        self._is_touched = False

    def _hear(self, chunks: list[Chunk]) -> None:
        for chunk in chunks:
            self._heard += chunk.data
            self._is_touched = True

    def _touch(self, time: float) -> None:
        """Let the tasks look at *time*, s, whether they can go on: something has come from outside."""
        self._now = max(self._now, time)
        self._is_touched = True

    def _sleep(self, seconds: float) -> Wait:
        return self._now + seconds, None

    # -- the task that talks to the main processor --

    def _exchange(self) -> TaskSteps:
        """Send the actuators, fetch the readings, and wait until somebody takes these."""
        while True:
            frame = b"\xf8\xf7" + self._actuators + b"\0"
            self._sending_until = self._now + len(frame) * self._line.byte_time
            if self._answers:
                super().receive(frame, self._now)
            yield self._sending_until, None
            answer = yield from self._read_answer()
            is_clean = yield from self._hear_silence()
            if len(answer) == ANSWER_SIZE and is_clean:
                self.let_world_run(self._now)
                pressed = self._hardware.button_is_pressed()
                self._sensors = answer[:-1] + bytes((pressed,)) + answer[-1:]
                yield inf, lambda: self._sensors is None
            else:
                yield self._sleep(DISCARDED)

    def _read_answer(self) -> Generator[Wait, None, bytes]:
        """Return the bytes of an answer, or fewer if no more come."""
        heard = self._heard
        while len(heard) < ANSWER_SIZE:
            before = len(heard)
            yield self._now + ANSWER_TIMEOUT, lambda before=before: len(heard) > before  # type: ignore[misc]
            if len(heard) == before and not self._is_answering():
                break
        answer = bytes(heard[:ANSWER_SIZE])
        del heard[:ANSWER_SIZE]
        return answer

    def _hear_silence(self) -> Generator[Wait, None, bool]:
        """Drop bytes until none comes for a while; return whether there were none."""
        is_clean = True
        while True:
            is_clean = is_clean and not self._heard
            self._heard.clear()
            yield self._now + SILENCE, lambda: bool(self._heard)
            if not self._heard and not self._is_answering():
                return is_clean
            is_clean = False

    def _is_answering(self) -> bool:
        """Return whether bytes of the main processor are on the line."""
        if not self._out:
            return False
        first = self._out[0]
        return first.time - len(first.data) * self._line.byte_time < self._now

    def _take_sensors(self) -> Generator[Wait, None, bytes]:
        """Return the readings that were fetched, and let the next ones be fetched."""
        while self._sensors is None:
            yield inf, lambda: self._sensors is not None
        sensors, self._sensors = self._sensors, None
        return sensors

    # -- the task that fetches pictures --

    def _film(self) -> TaskSteps:
        """Fetch a picture, and wait until somebody takes it.

        The camera films even while only readings are streamed. For a client that never asked for a picture these are
        left out; the first one that it asks for is then taken when it is sent.
        """
        while True:
            if not self._has_pictures:
                yield inf, None
            yield self._sleep(CAPTURE)
            picture = self._photograph() if self._films else b""
            yield self._sleep(TRANSFER)
            self._picture = picture
            yield inf, lambda: self._picture is None

    def _photograph(self) -> bytes:
        self.let_world_run(self._now)
        return self.firmware.take_picture()

    def _take_picture(self) -> Generator[Wait, None, bytes]:
        """Return the picture that was fetched, and let the next one be fetched."""
        while self._picture is None:
            yield inf, lambda: self._picture is not None
        picture, self._picture = self._picture, None
        return picture or self._photograph()

    # -- the task that serves the client --

    def _serve(self) -> TaskSteps:
        """Serve one client after the other."""
        while True:
            self._show(GREEN)
            yield inf, lambda: bool(self._waiting)
            client = self._waiting.popleft()
            yield self._sleep(STEP)
            yield from self._stream(client)
            self._films = False
            yield self._sleep(STEP)

    def _stream(self, client: Connection) -> TaskSteps:
        """Adopt a command and send what it asks for, again and again, until the client is gone."""
        command = bytearray(COMMAND_SIZE)
        has_begun = False
        while not client.is_reset:
            has_begun |= yield from self._receive_command(client, command)
            if self._colour == BLUE:
                self._show(DARK)
            request = command[1]
            if has_begun:
                self._actuators = bytes(command[2:])
                self._films |= bool(request & WANTS_IMAGE)
            if has_begun and (not request or request & (WANTS_IMAGE | WANTS_SENSORS)):
                yield self._sleep(STEP)
                if not (yield from self._send_all(client, request)):
                    return
            elif client.is_ended and not client.received:
                self._get_stuck()
                yield inf, lambda: client.is_reset
            else:  # the real one looks again every 10 ms
                yield inf, lambda: bool(client.received) or client.is_ended
            yield self._sleep(STEP)

    def _receive_command(self, client: Connection, command: bytearray) -> Generator[Wait, None, bool]:
        """Put the next command in the place of *command*; return whether it came in one piece and begins as it should.

        The rest of one that came in part is waited for, and taken as it is, without a look at its first byte. If the
        first byte of a whole one is wrong, the ESP32 waits in the same way for 0 more bytes: until anything comes.
        """
        received = client.received
        if len(received) >= CROWD:
            del received[: (len(received) - 1) // COMMAND_SIZE * COMMAND_SIZE]
        if not received:
            return False
        count = self._move(received, command, 0)
        if count == COMMAND_SIZE and command[0] == COMMAND_ID:
            return True
        yield inf, lambda: len(received) >= max(1, COMMAND_SIZE - count) or client.is_ended
        self._move(received, command, count)
        return False

    @staticmethod
    def _move(received: bytearray, command: bytearray, start: int) -> int:
        """Move received bytes into *command* from *start* on; return how many."""
        piece = received[: COMMAND_SIZE - start]
        del received[: len(piece)]
        command[start : start + len(piece)] = piece
        return len(piece)

    def _get_stuck(self) -> None:
        self.is_stuck = True
        if self.on_stuck is not None:
            self.on_stuck()

    def _send_all(self, client: Connection, request: int) -> Generator[Wait, None, bool]:
        """Send what a command asks for; return False if the connection is dead."""
        if not request:
            return (yield from self._send_empty(client))
        if request & WANTS_IMAGE:
            if not (yield from self._send_picture(client)):
                return False
            if not request & WANTS_SENSORS:
                yield from self._take_sensors()
                return True
            yield self._sleep(STEP)
        return (yield from self._send_sensors(client))

    def _send_empty(self, client: Connection) -> Generator[Wait, None, bool]:
        self._picture = None  # this also carries the colours of the RGB LEDs, on the line that pictures take
        is_sent = yield from self._transmit(client, EMPTY)
        yield from self._take_sensors()
        return is_sent

    def _send_sensors(self, client: Connection) -> Generator[Wait, None, bool]:
        self._picture = None
        sensors = yield from self._take_sensors()
        self._show(BLUE)
        return (yield from self._transmit(client, SENSORS + sensors))

    def _send_picture(self, client: Connection) -> Generator[Wait, None, bool]:
        picture = yield from self._take_picture()
        self._show(BLUE)
        return (yield from self._transmit(client, IMAGE + picture))

    def _transmit(self, client: Connection, data: bytes) -> Generator[Wait, None, bool]:
        """Put a packet into the send buffer as there is room; return False if the connection is dead."""
        self._count += 1
        while data:
            if client.is_closed:  # its computer refuses the data, which the next attempt learns
                was_reset, client.is_reset = client.is_reset, True
                return not was_reset
            if client.is_reset:
                return False
            room = SEND_BUFFER - client.unacknowledged
            if room > 0:
                client.unacknowledged += len(data[:room])
                self._packets.append(Chunk(self._now, data[:room], self._count))
                data = data[room:]
            else:
                yield inf, lambda: client.unacknowledged < SEND_BUFFER or client.is_closed
        return True

    def _show(self, colour: tuple[int, int, int]) -> None:
        """Show a state with LED2, which is the ESP32's own."""
        self._colour = colour
        self.let_world_run(self._now)
        self.firmware.show_status(colour)
