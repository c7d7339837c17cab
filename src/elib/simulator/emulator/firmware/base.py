"""The base of all firmwares: dispatch by letter and opcode, shared variables, and the commands that all answer alike.

A firmware is a class of handlers; a decorator says which letter or opcode calls each::

    @binary(0xBC, parameters=4)
    def _binary_set_speed(self, parameters: bytes) -> bytes: ...

    @text("E")
    @binary(0xBB)
    def _speed(self, _: bytes) -> Sequence[int]: ...

A handler gets the line, or the parameters. It returns the bytes of the reply, the numbers in it, or the steps in which
it comes.

Letters, opcodes, lengths and the format of replies are written out here and nowhere shared with ``protocol``:
the emulator is what the host's tables are tested against, and two sides that read one table would agree on any error.
Constants that are not part of the wire format are shared.
"""

from __future__ import annotations

import math
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import suppress
from types import FunctionType
from typing import Any, ClassVar, TypeVar

from elib.base.body import wrapped
from elib.link.protocol.camera import CENTRED, DEFAULT_WINDOW, CameraDriver, WindowRefused
from elib.link.protocol.quantities import pixel_bytes
from elib.link.protocol.robot_connection import scan_integers
from elib.simulator.emulator.build import Build
from elib.simulator.emulator.firmware.bootloader import ProgramMemory
from elib.simulator.emulator.firmware.steps import Busy, FirmwareStep, FirmwareSteps, Hang, Send
from elib.simulator.emulator.hardware import Hardware, Lights
from elib.simulator.emulator.motors import StepMotor
from elib.simulator.emulator.timing import Timing

BANNER = b'\x0c\x07WELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'
NOT_FOUND = b"z,Command not found\r\n"

CALIBRATION_STARTS = b"k, Starting calibration - Remove any object in sensors range\r\n"
CALIBRATION_ENDS = b"k, Calibration finished\r\n"

CALIBRATION_READS = 10
"""Readings that are averaged; the firmwares take 100 in the same time (wire-protocol.md, 5.3)."""

TextHandler = Callable[[Any, bytes], "bytes | Sequence[int] | FirmwareSteps"]
BinaryHandler = Callable[[Any, bytes], "bytes | Sequence[int] | Iterator[FirmwareStep | bytes]"]
TextT = TypeVar("TextT", bound=TextHandler)
BinaryT = TypeVar("BinaryT", bound=BinaryHandler)

_LETTERS: dict[object, int] = {}
_OPCODES: dict[object, tuple[int, int]] = {}


def text(letter: str) -> Callable[[TextT], TextT]:
    """Let a method answer the text command that begins with *letter*."""

    def mark(handler: TextT) -> TextT:
        _LETTERS[handler] = ord(letter)
        return handler

    return mark


def binary(opcode: int, *, parameters: int = 0) -> Callable[[BinaryT], BinaryT]:
    """Let a method answer the binary command *opcode*, which so many parameter bytes follow."""

    def mark(handler: BinaryT) -> BinaryT:
        _OPCODES[handler] = opcode, parameters
        return handler

    return mark


def words(values: Sequence[int]) -> bytes:
    """Pack the low 16 bits of each value, low byte first."""
    return struct.pack(f"<{len(values)}H", *[value & 0xFFFF for value in values])


MEMORY_SIZE = 0x10000


class Memory:
    """The one buffer of a firmware: for the line it receives, the reply it prints, the answer it packs.

    Nothing clears the buffer, so a command that sends more than it wrote also sends what an earlier command left there
    (wire-protocol.md, 2.5 and 3.4). The model is the dsPIC's whole data space of 64 KiB, zero at power-on, with the
    buffer at its start: a picture larger than the buffer overwrites what follows it. Addresses wrap, negative ones
    included.
    """

    def __init__(self) -> None:
        self._bytes = bytearray(MEMORY_SIZE)

    def store(self, address: int, data: bytes) -> None:
        """Write *data* at *address*."""
        address %= MEMORY_SIZE
        end = address + len(data)
        if end <= MEMORY_SIZE:
            self._bytes[address:end] = data
        else:
            for offset, byte in enumerate(data):
                self._bytes[(address + offset) % MEMORY_SIZE] = byte

    def load(self, address: int, count: int) -> bytes:
        """Read *count* bytes, 0..65536, from *address*."""
        address %= MEMORY_SIZE
        piece = bytes(self._bytes[address : address + count])
        return piece + bytes(self._bytes[: count - len(piece)])

    def text(self, address: int) -> bytes:
        """Read up to the next zero byte, which is not returned."""
        address %= MEMORY_SIZE
        end = self._bytes.find(0, address)
        return bytes(self._bytes[address : end if end >= 0 else MEMORY_SIZE])


class Firmware(ABC):
    """A robot's firmware, from its first instruction to the next reset.

    Args:
        hardware: What it runs on. The caller advances it.
        timing: How long things take.
        resets: How often the chip was reset since power-on, this start included.
    """

    NAME: ClassVar[str]
    TIMING: ClassVar[Timing]
    """How long things take on the robot."""
    BUILD: ClassVar[Build]
    """The robot that it runs on."""
    MOTOR: ClassVar[type[StepMotor]]
    """The step driver of its wheels."""
    INT_BITS: ClassVar[int]
    LONG_BITS: ClassVar[int]
    PAIR: ClassVar[str]
    """How this compiler reads two 16-bit parameters, in the words of :mod:`struct`."""
    TEXT: ClassVar[Mapping[int, TextHandler]]
    """Its text commands, by their letter."""
    BINARY: ClassVar[Mapping[int, BinaryHandler]]
    """Its binary commands, by their opcode."""
    LENGTHS: ClassVar[Mapping[int, int]]
    """Parameter bytes of each binary command, by its opcode."""
    LACKS: ClassVar[frozenset[int]] = frozenset()
    """Opcodes that its base classes know and it does not."""
    CASE_MATTERS: ClassVar[bytes] = b""
    HELP: ClassVar[bytes]
    LIGHTS_CALIBRATION: ClassVar[bool] = True
    """Whether the ring is lit during a calibration and dark after it (wire-protocol.md, 2.2)."""
    DROPS: ClassVar[bool] = False
    """Whether bytes that do not fit into the receive buffer are lost; otherwise they overwrite the oldest ones."""

    def __init_subclass__(cls) -> None:
        """Collect the handlers of the class and its bases; that of the nearest class goes first.

        Raises:
            TypeError: A method replaces a handler and has no decorator itself.
        """
        methods = [each for base in reversed(cls.__mro__) for each in vars(base).values() if type(each) is FunctionType]
        cls.TEXT = {_LETTERS[each]: each for each in methods if each in _LETTERS}
        coded = {_OPCODES[each][0]: each for each in methods if each in _OPCODES}
        cls.BINARY = {code: each for code, each in coded.items() if code not in cls.LACKS}
        cls.LENGTHS = {code: _OPCODES[each][1] for code, each in cls.BINARY.items()}
        for each in (*cls.TEXT.values(), *cls.BINARY.values()):
            if getattr(cls, each.__name__) is not each:
                raise TypeError(f"{cls.__name__}.{each.__name__} needs a decorator: it replaces a handler")

    def __init__(self, hardware: Hardware, timing: Timing, resets: int = 0) -> None:
        self.hardware = hardware
        self.timing = timing
        self.resets = resets
        self.lights = Lights()  # the lamps as last set
        self.sound = 0  # the sound last started, 1..5, or 0 for silence
        self.next_thread = math.inf  # when a background thread is due next, s; infinite if none is
        # the drivers of the left and the right wheel
        self.motors: tuple[StepMotor, StepMotor] = (self.MOTOR(), self.MOTOR())
        self._told = (0.0, 0.0)
        self.window = DEFAULT_WINDOW
        # Uninitialised on the real BTCom, zero in the recordings (tests/golden/README.md).
        self.variables = dict.fromkeys(
            ("speed_left", "speed_right", "position_left", "position_right", "led", "action", "sound"), 0
        )
        self.variables.update(mode=1, width=40, height=40, zoom=8, size=3200)
        self.offsets = [0] * 10
        self.memory = Memory()
        self.answer_length = 0
        self._waits_for_picture = False

    # -- the interface for the emulator --

    @abstractmethod
    def boot(self, memory: ProgramMemory, *, cold: bool) -> FirmwareSteps:
        """Start: after power-on if *cold*, else after a reset.

        The bootloader of an e-puck1 writes *memory*. The firmware itself does not come from there.
        """

    def line(self, line: bytes) -> bytes | FirmwareSteps:
        """Carry out a text command.

        Args:
            line: The command with its terminator.

        Returns:
            The reply, or the steps in which it comes.
        """
        first = line[0]
        if 0x61 <= first <= 0x7A and first not in self.CASE_MATTERS:
            first -= 0x20
        self.memory.store(0, bytes((first,)) + line[1:] + b"\0")
        handler = self.TEXT.get(first)
        if handler is None:
            return NOT_FOUND
        reply = handler(self, line)
        if isinstance(reply, bytes | Generator):
            return reply
        return self.print_numbers(chr(first).lower(), reply)

    def opcode(self, code: int, parameters: bytes) -> FirmwareSteps | None:
        """Carry out a binary command; its answer is kept until the session ends."""
        answer = self.BINARY[code](self, parameters)
        if isinstance(answer, Iterator):
            return self._collect(answer)
        self._append(answer if isinstance(answer, bytes) else words(answer))
        return None

    def end_session(self) -> bytes | FirmwareSteps:
        """End a binary session.

        Returns:
            The collected answer, or the steps in which it comes.
        """
        count, self.answer_length = self.answer_length & 0xFFFF, 0
        if count and self._waits_for_picture:
            self._waits_for_picture = False
            return self._send_with_picture(count)
        return self.memory.load(0, count) if count else b""

    def wants_remote(self) -> bool:
        """Return whether the remote control has sent a command to obey."""
        return False

    def obey_remote(self) -> None:
        """Obey the command that :meth:`wants_remote` found."""
        raise NotImplementedError

    def run_threads(self, time: float) -> None:
        """Run the background threads that are due at *time*, s, as ``next_thread`` says."""
        raise NotImplementedError

    def switch_off(self) -> None:
        """Stop motors, lamps and sound, as a reset does."""
        self.drive(0, 0)
        self.lights = Lights()
        self.show()
        self.play(0)

    def report(self) -> dict[str, object]:
        """Return what it has set; the keys are those of ``hw`` in the golden files (``tests/golden/README.md``)."""
        return {
            "resets": self.resets,
            "led": list(self.lights.ring),
            "body": self.lights.body,
            "front": self.lights.front,
            "speed": [motor.speed for motor in self.motors],
            "steps": [motor.steps for motor in self.motors],
            "sound": self.sound,
        }

    # -- parts of commands --

    @abstractmethod
    def light(self, led: int, action: int) -> None:
        """Set ring LED *led*; any other number sets all."""

    @abstractmethod
    def prox_reading(self) -> Sequence[int]:
        """Return the reflected light, counts, as this firmware corrects it before it subtracts the calibration."""

    def drive(self, left: int, right: int) -> None:
        """Set the speeds, steps/s, at the motor drivers."""
        turned = self.motors[0].turned, self.motors[1].turned
        self.hardware.step(turned[0] - self._told[0], turned[1] - self._told[1])
        self._told = turned
        self.motors[0].set_speed(left)
        self.motors[1].set_speed(right)
        self.hardware.drive(self.motors[0].rate, self.motors[1].rate)

    def ask_speed(self, left: int, right: int) -> None:
        """Set the speeds that a command asks for, steps/s."""
        self.drive(left, right)

    def drive_as_asked(self) -> None:
        """Set the speeds that are in the variables."""
        self.ask_speed(self.variables["speed_left"], self.variables["speed_right"])

    def play(self, number: int) -> None:
        """Start a sound, 1..5; any other number is silence."""
        self.sound = number if 1 <= number <= 5 else 0
        self.hardware.play_sound(self.sound)

    def show(self) -> None:
        """Hand the lamps to the hardware."""
        self.hardware.show(self.lights)

    def scan(self, line: bytes, *names: str) -> None:
        """Scan numbers into variables; a variable without a number keeps its value (wire-protocol.md, 1.6)."""
        numbers = scan_integers(line, len(names), long_bits=self.LONG_BITS)
        for name, number in zip(names, numbers, strict=False):
            self.variables[name] = wrapped(number, self.INT_BITS)

    def unsigned(self, value: int) -> int:
        """Read a variable as unsigned."""
        return value & ((1 << self.INT_BITS) - 1)

    def print(self, text: str) -> bytes:
        """Format a reply in the shared buffer."""
        data = text.encode("ascii")
        self.memory.store(0, data + b"\0")
        return data

    def print_numbers(self, letter: str, values: Sequence[int]) -> bytes:
        """Format the most common reply: a letter and numbers, with commas between them."""
        return self.print(f"{letter},{','.join(map(str, values))}\r\n")

    def switched(self, lamp: int, action: int) -> int:
        """Return the state of a lamp after *action*: 0 is off, 1 is on, more toggles."""
        action = self.unsigned(action)
        return lamp ^ 1 if action > 1 else action

    def unpacked(self, parameters: bytes) -> tuple[int, int]:
        """Return two 16-bit parameters as this compiler reads them."""
        left, right = struct.unpack(self.PAIR, parameters)
        return left, right

    @property
    @abstractmethod
    def camera_driver(self) -> CameraDriver | None:
        """The driver of the camera that it has found; None if it knows no such chip."""

    def aim(self, x: int = CENTRED, y: int = CENTRED) -> None:
        """Set the window by the variables. The firmware ignores a refusal: the old one stays, and no answer says so."""
        with suppress(WindowRefused):
            if self.camera_driver is not None:
                self.window = self.camera_driver.window(*self.wanted_window(), x, y)

    @abstractmethod
    def set_window(self, x: int = CENTRED, y: int = CENTRED) -> FirmwareSteps:
        """Set up the camera by the variables; the window has this corner."""

    @abstractmethod
    def launch_capture(self, address: int) -> None:
        """Start to take a picture for the answer at *address*."""

    @abstractmethod
    def finish_capture(self) -> bool:
        """Put the last picture that was asked for into memory; return False if it never comes."""

    def set_steps(self, left: int, right: int) -> None:
        """Set the step counters."""
        self.motors[0].steps, self.motors[1].steps = left, right

    def volumes(self) -> list[int]:
        """Return the microphones' volumes, peak to peak, counts."""
        return [volume for _, volume in self.hardware.microphones()]

    def take_picture(self) -> bytes:
        """Return a picture through the present window; it is empty if the window has no pixels."""
        if self.window.width == 0 or self.window.height == 0:
            return b""
        return self.hardware.picture(self.window)

    def wanted_window(self) -> tuple[int, int, int, int]:
        """Return mode, width, height and zoom that were last asked for."""
        variables = self.variables
        return variables["mode"], variables["width"], variables["height"], variables["zoom"]

    def keep_size(self) -> None:
        """Compute the size of a picture from the variables, and keep it there."""
        mode, width, height, _ = self.wanted_window()
        self.variables["size"] = wrapped(width * height * pixel_bytes(mode), self.INT_BITS)

    def calibrated(self) -> list[int]:
        """Return the eight proximity values minus their offsets, at least 0, counts."""
        return [max(0, value - offset) for value, offset in zip(self.prox_reading()[:8], self.offsets, strict=False)]

    def calibrate(self, seconds: float) -> FirmwareSteps:
        """Measure the proximity offsets, for *seconds*."""
        self.offsets = [0] * 10
        sums = [0] * 10
        for _ in range(CALIBRATION_READS):
            yield Busy(seconds / CALIBRATION_READS)
            for sensor, value in enumerate(self.prox_reading()):
                sums[sensor] += value
        self.offsets = [int(total / CALIBRATION_READS) for total in sums]

    def _append(self, answer: bytes) -> None:
        self.memory.store(self.answer_length, answer)
        self.answer_length += len(answer)

    def _collect(self, steps: Iterator[FirmwareStep | bytes]) -> FirmwareSteps:
        for step in steps:
            if isinstance(step, bytes):
                self._append(step)
            else:
                yield step

    def _send_with_picture(self, count: int) -> FirmwareSteps:
        yield Busy(self.timing.picture)
        if not self.finish_capture():
            yield Hang()
        yield Send(self.memory.load(0, count))

    # -- commands that answer with the same numbers in both forms --

    @text("E")
    @binary(0xBB)
    def _speed(self, _: bytes) -> Sequence[int]:
        return self.variables["speed_left"], self.variables["speed_right"]

    @text("Q")
    @binary(0xAF)
    def _encoders(self, _: bytes) -> Sequence[int]:
        return [motor.steps for motor in self.motors]

    @text("N")
    @binary(0xB2)
    def _proximity(self, _: bytes) -> Sequence[int]:
        return self.calibrated()

    @text("O")
    @binary(0xB1)
    def _ambient_light(self, _: bytes) -> Sequence[int]:
        return self.hardware.ambient_light()[:8]

    @text("U")
    @binary(0x8B)
    def _microphones(self, _: bytes) -> Sequence[int]:
        return self.volumes()[:3]

    # -- text commands --

    @text("C")
    def _text_selector(self, line: bytes) -> bytes:
        return self.print(f"c,{self.hardware.selector()}\r\n")

    @text("D")
    def _text_set_speed(self, line: bytes) -> bytes:
        self.scan(line, "speed_left", "speed_right")
        self.drive_as_asked()
        return b"d\r\n"

    @text("P")
    def _text_set_encoders(self, line: bytes) -> bytes:
        self.scan(line, "position_left", "position_right")
        self.set_steps(self.variables["position_left"], self.variables["position_right"])
        return b"p\r\n"

    @text("S")
    def _text_stop(self, line: bytes) -> bytes:
        self.ask_speed(0, 0)
        self.light(8, 0)
        self.show()
        return b"s\r\n"

    @text("K")
    def _text_calibrate_proximity(self, line: bytes) -> FirmwareSteps:
        yield Send(CALIBRATION_STARTS)
        if self.LIGHTS_CALIBRATION:
            self.light(8, 1)
            self.show()
        yield from self.calibrate(self.timing.calibration)
        if self.LIGHTS_CALIBRATION:
            self.light(8, 0)
            self.show()
        yield Send(CALIBRATION_ENDS)

    @text("T")
    def _text_play_sound(self, line: bytes) -> bytes:
        self.scan(line, "sound")
        self.play(self.variables["sound"])
        return b"t\r\n"

    @text("G")
    def _text_ir_receiver(self, line: bytes) -> bytes:
        check, address, data = self.hardware.infrared()
        return self.print(f"g IR check : 0x{check:x}, address : 0x{address:x}, data : 0x{data:x}\r\n")

    @text("L")
    def _text_set_led(self, line: bytes) -> bytes:
        self.scan(line, "led", "action")
        self.light(self.variables["led"], self.variables["action"])
        self.show()
        return b"l\r\n"

    @text("B")
    def _text_set_body_led(self, line: bytes) -> bytes:
        self.scan(line, "action")
        self.lights.body = self.switched(self.lights.body, self.variables["action"])
        self.show()
        return b"b\r\n"

    @text("F")
    def _text_set_front_led(self, line: bytes) -> bytes:
        self.scan(line, "action")
        self.lights.front = self.switched(self.lights.front, self.variables["action"])
        self.show()
        return b"f\r\n"

    @text("I")
    def _text_camera(self, line: bytes) -> Sequence[int]:
        return [self.variables[name] for name in ("mode", "width", "height", "zoom", "size")]

    @text("H")
    def _text_help_text(self, line: bytes) -> bytes:
        return self.HELP

    # -- binary commands --

    @binary(0xBC, parameters=4)
    def _binary_set_speed(self, parameters: bytes) -> bytes:
        self.variables["speed_left"], self.variables["speed_right"] = self.unpacked(parameters)
        self.drive_as_asked()
        return b""

    @binary(0xB4, parameters=2)
    def _binary_set_led(self, parameters: bytes) -> bytes:
        led, action = parameters
        if led == 8:
            self.lights.body = self.switched(self.lights.body, action)
        elif led == 9:
            self.lights.front = self.switched(self.lights.front, action)
        else:
            self.light(led, action)
        self.show()
        return b""

    @binary(0xB7)
    def _binary_image(self, parameters: bytes) -> bytes:
        header = bytes(self.variables[name] & 0xFF for name in ("mode", "width", "height"))
        self._waits_for_picture = True
        self.launch_capture(self.answer_length + len(header))
        self.memory.store(self.answer_length, header)
        self.answer_length += len(header) + self.variables["size"]
        return b""
