"""Clients that speak to a virtual e-puck2 over Wi-Fi as other projects do: their order of sending and reading."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import dataclass

import pytest

from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import PATIENCE

PAYLOADS = {1: 38_400, 2: 104, 3: 0}


@pytest.fixture
async def port() -> AsyncIterator[int]:
    async with serve(SimulationSettings(world="square", firmware="epuck2-wifi"), wifi="0") as served:
        yield int(served[0].url.rpartition(":")[2])


@dataclass
class Client:
    """A client with one command that it changes and sends again."""

    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter
    command: bytearray

    def send(self) -> None:
        self.writer.write(self.command)

    async def receive(self) -> tuple[int, bytes]:
        """Read the first byte of a packet and then its rest."""
        async with asyncio.timeout(PATIENCE):
            kind = (await self.reader.readexactly(1))[0]
            return kind, await self.reader.readexactly(PAYLOADS[kind])

    def set_speed(self, left: int, right: int) -> None:
        self.command[3:7] = left.to_bytes(2, "little", signed=True) + right.to_bytes(2, "little", signed=True)


@contextlib.asynccontextmanager
async def connected(port: int, request: int) -> AsyncIterator[Client]:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        yield Client(reader, writer, bytearray([0x80, request, *([0] * 19)]))
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()


async def step(client: Client) -> tuple[int, bytes]:
    """Send one command and read one packet, as UNIFR's client does in each step; its calibration bit is sent once."""
    client.send()
    client.command[2] = 0
    return await client.receive()


@pytest.mark.long
async def test_a_client_that_sends_one_command_and_reads_one_packet_in_each_step(port: int) -> None:
    async with connected(port, 2) as robot:
        assert (await step(robot))[0] == 2
        robot.set_speed(300, 300)
        counts = [int.from_bytes((await step(robot))[1][79:81], "little", signed=True) for _ in range(50)]
        assert counts == sorted(counts)
        assert counts[-1] > 200
        robot.command[1] = 3  # the camera is switched on
        kinds: list[int] = []
        async with asyncio.timeout(PATIENCE):
            # On a busy computer, what it has not read yet comes first.
            while kinds[-6:] not in ([1, 2] * 3, [2, 1] * 3):
                kinds.append((await step(robot))[0])
            robot.command[1] = 0
            while (await step(robot))[0] != 3:
                pass


@pytest.mark.long
async def test_a_client_that_reads_until_it_has_a_picture_and_readings_in_each_step(port: int) -> None:
    """So does Webots; at the end it sends a stop until an empty packet answers."""
    async with connected(port, 3) as robot:
        for _ in range(8):
            robot.send()
            got: set[int] = set()
            while not {1, 2} <= got:
                got.add((await robot.receive())[0])
        for _ in range(20):
            robot.writer.write(bytes([0x80, *([0] * 19), 0x20]))
            if (await robot.receive())[0] == 3:
                break
        else:
            pytest.fail("no empty packet came")


async def test_a_client_that_sends_more_than_the_robot_takes_still_steers_it(port: int) -> None:
    async with connected(port, 2) as robot:
        for speed in range(200):
            robot.set_speed(speed, -speed)
            robot.send()
        robot.set_speed(0, 0)
        robot.send()
        stood = [(await robot.receive())[1][79:83] for _ in range(20)]
        assert stood[-1] == stood[-5]  # the newest command counts, at once
