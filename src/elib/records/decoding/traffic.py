"""The traffic of a simulated line, decoded: time, robot, direction, bytes and their meaning."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from elib.records.decoding import AnyDecoder, Direction, Line, decoder_of
from elib.records.decoding.words import PAUSE, to_text


class TrafficLog:
    """Shows what goes over the lines of several robots, each line of a robot by a decoder of its own.

    Bytes are decoded by the rules of *firmware* until the robot says its version.
    """

    def __init__(self, firmware: str, show: Callable[[str], object]) -> None:
        self._firmware = firmware
        self._show = show
        self._decoders: dict[str, AnyDecoder] = {}
        self._pauses: dict[str, asyncio.TimerHandle] = {}

    def note(self, name: str, time: float, direction: Direction, data: bytes) -> None:
        """Take some bytes; an event loop must be running."""
        if name in self._pauses:
            self._pauses[name].cancel()
        else:
            self._decoders[name] = decoder_of(assumed=self._firmware)
        self._show_lines(name, self._decoders[name].feed(direction, time, data))
        self._pauses[name] = asyncio.get_running_loop().call_later(PAUSE, self._end, name)

    def flush(self) -> None:
        """Show the bytes that wait."""
        for name in self._decoders:
            self._end(name)

    def _end(self, name: str) -> None:
        self._show_lines(name, self._decoders[name].flush())

    def _show_lines(self, name: str, lines: list[Line]) -> None:
        for line in lines:
            self._show(to_text(line, robot=name))
