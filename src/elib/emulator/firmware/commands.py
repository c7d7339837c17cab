"""The commands that all four firmwares answer in the same way (wire-protocol.md, 2 and 3)."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import ClassVar

from elib.emulator.firmware.base import Firmware, binary, text
from elib.emulator.firmware.steps import Busy, Send, Steps

CALIBRATION_STARTS = b"k, Starting calibration - Remove any object in sensors range\r\n"
CALIBRATION_ENDS = b"k, Calibration finished\r\n"

CALIBRATION_READS = 10
"""Readings that are averaged; the firmwares take 100 in the same time (wire-protocol.md, 5.3)."""


def words(values: Sequence[int]) -> bytes:
    """Pack the low 16 bits of each value, low byte first."""
    return struct.pack(f"<{len(values)}H", *[value & 0xFFFF for value in values])


class CommonCommands(Firmware):
    """Handlers that all firmwares share; the few that differ are overridden."""

    LIGHTS_CALIBRATION: ClassVar[bool] = True
    """Whether the ring is lit during a calibration and dark after it (wire-protocol.md, 2.2)."""

    def calibrated(self) -> list[int]:
        """Return the eight proximity values minus their offsets, at least 0, counts."""
        return [max(0, value - offset) for value, offset in zip(self.prox_reading()[:8], self.offsets, strict=False)]

    def calibrate(self, seconds: float) -> Steps:
        """Measure the proximity offsets, for *seconds*."""
        self.offsets = [0] * 10
        sums = [0] * 10
        for _ in range(CALIBRATION_READS):
            yield Busy(seconds / CALIBRATION_READS)
            for sensor, value in enumerate(self.prox_reading()):
                sums[sensor] += value
        self.offsets = [int(total / CALIBRATION_READS) for total in sums]

    # -- text commands --

    @text("C")
    def _text_selector(self, line: bytes) -> bytes:
        return self.print(f"c,{self.hardware.selector()}\r\n")

    @text("D")
    def _text_set_speed(self, line: bytes) -> bytes:
        self.scan(line, "speed_left", "speed_right")
        self.drive_as_asked()
        return b"d\r\n"

    @text("E")
    def _text_speed(self, line: bytes) -> bytes:
        return self.print(f"e,{self.variables['speed_left']},{self.variables['speed_right']}\r\n")

    @text("P")
    def _text_set_encoders(self, line: bytes) -> bytes:
        self.scan(line, "position_left", "position_right")
        self.set_steps(self.variables["position_left"], self.variables["position_right"])
        return b"p\r\n"

    @text("Q")
    def _text_encoders(self, line: bytes) -> bytes:
        return self.print(f"q,{self.motors[0].steps},{self.motors[1].steps}\r\n")

    @text("S")
    def _text_stop(self, line: bytes) -> bytes:
        self.ask_speed(0, 0)
        self.light(8, 0)
        self.show()
        return b"s\r\n"

    @text("N")
    def _text_proximity(self, line: bytes) -> bytes:
        return self.print_numbers("n", self.calibrated())

    @text("O")
    def _text_ambient_light(self, line: bytes) -> bytes:
        return self.print_numbers("o", self.hardware.ambient_light()[:8])

    @text("K")
    def _text_calibrate_proximity(self, line: bytes) -> Steps:
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

    @text("U")
    def _text_microphones(self, line: bytes) -> bytes:
        return self.print_numbers("u", self.volumes()[:3])

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
    def _text_camera(self, line: bytes) -> bytes:
        names = ("mode", "width", "height", "zoom", "size")
        return self.print_numbers("i", [self.variables[name] for name in names])

    @text("H")
    def _text_help_text(self, line: bytes) -> bytes:
        return self.HELP

    # -- binary commands --

    @binary(0xBC, parameters=4)
    def _binary_set_speed(self, parameters: bytes) -> bytes:
        self.variables["speed_left"], self.variables["speed_right"] = self.unpacked(parameters)
        self.drive_as_asked()
        return b""

    @binary(0xBB)
    def _binary_speed(self, parameters: bytes) -> bytes:
        return words((self.variables["speed_left"], self.variables["speed_right"]))

    @binary(0xAF)
    def _binary_encoders(self, parameters: bytes) -> bytes:
        return words([motor.steps for motor in self.motors])

    @binary(0xB2)
    def _binary_proximity(self, parameters: bytes) -> bytes:
        return words(self.calibrated())

    @binary(0xB1)
    def _binary_ambient_light(self, parameters: bytes) -> bytes:
        return words(self.hardware.ambient_light()[:8])

    @binary(0x8B)
    def _binary_microphones(self, parameters: bytes) -> bytes:
        return words(self.volumes()[:3])

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
