"""A virtual e-puck1 on a link in simulated time, and uploads to it."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from elib.link.protocol.values import Version
from elib.link.transport.memory import MemoryTransport, memory_pair
from elib.simulator.emulator.emulator import Emulator
from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.link import Link
from elib.tools.flash import Image, Uploader

BOOTLOADER_ROWS = (0x17F40, 0x17F80, 0x17FC0)


class Rig:
    """A robot that stays while links come and go.

    Attributes:
        said: The sentences of all uploads.
    """

    def __init__(self, firmware: str = "btcom-2.0", *, baud: int = 115200, latency: float = 0.002) -> None:
        self.hardware = FixedHardware(firmware=firmware)
        self.robot = Emulator(firmware, self.hardware, baud=baud, booted=True)
        self.link = Link(self.robot, baud=baud, latency=latency)
        self.said: list[str] = []

    def connect(self) -> MemoryTransport:
        end, host = memory_pair("memory://robot")
        self.link.attach(end)
        return host

    def uploader(self, image: Image, number: int = 1234) -> Uploader:
        return Uploader(self.connect(), image, number, say=self.said.append)

    async def upload(self, image: Image, number: int = 1234) -> Version | bytes:
        return await self.uploader(image, number).run()

    async def begin(self, image: Image, *, rows: int) -> tuple[Uploader, asyncio.Task[Version | bytes]]:
        """Begin an upload, and return when so many rows are written."""
        is_there = asyncio.Event()

        def on_row(written: int, all_rows: int) -> None:
            if written == rows:
                is_there.set()

        uploader = Uploader(self.connect(), image, 1234, on_row=on_row)
        task = asyncio.ensure_future(uploader.run())
        await is_there.wait()
        return uploader, task

    async def upload_by_button(self, image: Image, number: int = 1234, *, after: float = 8.0) -> Version | bytes:
        """Upload while a person presses the reset button some time after the start."""
        pressing = asyncio.get_running_loop().call_later(after, self.press_reset)
        try:
            return await self.upload(image, number)
        finally:
            pressing.cancel()

    def mend(self) -> None:
        """End what a test did to the bytes of the line."""
        for name in ("receive", "advance"):
            self.robot.__dict__.pop(name, None)

    def press_reset(self) -> None:
        self.robot.press_reset(self.link.now)
        self.link.rearm()

    def power_cycle(self) -> None:
        self.robot.power_cycle(self.link.now)
        self.link.rearm()

    def holds(self, program: Mapping[int, int]) -> bool:
        """Return whether the robot's memory holds every instruction of *program*."""
        instruction = self.robot.memory.instruction
        return all(instruction(address) == value for address, value in program.items())

    @property
    def is_flashable(self) -> bool:
        """Whether a reset leads to an intact bootloader."""
        memory = self.robot.memory
        return memory.starts_bootloader and not set(BOOTLOADER_ROWS) & set(memory.rows)
