"""The network between a robot with Wi-Fi and a program: slow, lossy, stalled, cut, but never wrong."""

import asyncio
import contextlib
import itertools
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from clock_rig import jumping
from wifi_rig import command, packets

import elib
from elib.base.errors import LinkBusy, LinkLost, LinkNotFound
from elib.link.transport import open_transport
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.faults import Fault
from elib.simulator.emulator.sim_transport import SimTransport
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.emulator.wifi import WifiEmulator
from elib.simulator.emulator.wifi_link import CONNECTING, RETRANSMISSION, WifiLink
from elib.testing import simulated
from shared import inside, now

URL = "sim://square?firmware=epuck2-wifi&speed=max&quality=ideal"


async def opened(keys: str = "") -> SimTransport:
    transport = await open_transport(URL + keys)
    assert isinstance(transport, SimTransport)
    assert transport.codec == "wifi"
    assert isinstance(transport.robot.link, WifiLink)
    return transport


@contextlib.asynccontextmanager
async def streaming(keys: str = "") -> AsyncIterator[SimTransport]:
    transport = await opened(keys)
    try:
        yield transport
    finally:
        await transport.close()


async def arrivals(transport: SimTransport, seconds: float) -> list[tuple[float, bytes]]:
    """Return what arrives in some seconds, with the times."""
    end, found = now() + seconds, []
    while now() < end:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout_at(end):
                data = await transport.read()
                found.append((now(), data))
    return found


async def stream(transport: SimTransport, seconds: float) -> list[bytes]:
    """Return the whole packets that arrive in some seconds; a part of one at the end is dropped."""
    return packets(b"".join(data for _, data in await arrivals(transport, seconds)), torn=True)


@inside(streaming)
async def test_a_robot_streams_to_the_program_that_opens_it(transport: SimTransport) -> None:
    await transport.write(command(2))
    assert 1 / 0.0215 - 3 <= len(await stream(transport, 1.0 + CONNECTING)) <= 1 / 0.0215


@simulated
async def test_two_runs_with_the_same_seed_are_the_same() -> None:
    runs = []
    for _ in range(2):
        transport = await opened("&seed=5&latency=0.004&jitter=0.003&loss=0.02")
        start = now()
        await transport.write(command(3, left=300, right=200))
        runs.append([(round(time - start, 9), data) for time, data in await arrivals(transport, 5.0)])
        await transport.close()
    assert runs[0] == runs[1]


@inside(streaming, "&latency=0.2")
async def test_latency_delays_commands_and_packets(transport: SimTransport) -> None:
    start = now()
    await transport.write(command(0))
    (time, data), *_ = await arrivals(transport, 1.0)
    assert data == b"\x03"
    assert 0.4 <= time - start - CONNECTING <= 0.4 + 0.04


@inside(streaming, "&latency=0.05")
async def test_acknowledgements_take_their_time_too_and_bound_what_a_slow_network_carries(
    transport: SimTransport,
) -> None:
    await transport.write(command(1))
    await arrivals(transport, 1.0)
    data = b"".join(data for _, data in await arrivals(transport, 20.0))
    assert len(data) / 20.0 == pytest.approx(5744 / 0.1, rel=0.15)  # a send buffer for each way to and fro


@inside(streaming, "&loss=0.05&seed=7")
async def test_a_lost_packet_is_a_pause_and_never_a_gap(transport: SimTransport) -> None:
    assert isinstance(transport.robot.link, WifiLink)
    await transport.write(command(2, left=100, right=100))
    found = await arrivals(transport, 20.0)
    times = [time for time, _ in found]
    pauses = [later - earlier for earlier, later in itertools.pairwise(times) if later - earlier > 0.1]
    assert 10 <= len(pauses) <= 60
    assert max(pauses) >= RETRANSMISSION  # a packet that waits behind a lost one may be lost as well
    whole = packets(b"".join(data for _, data in found))
    assert {packet[0] for packet in whole} == {2}
    steps = [int.from_bytes(packet[80:82], "little") for packet in whole]
    assert steps == sorted(steps)


@inside(streaming)
async def test_what_waited_behind_a_lost_packet_comes_at_once(transport: SimTransport) -> None:
    await transport.write(command(2))
    await arrivals(transport, 1.0)
    transport.robot.link.lose_next_reply()
    (_time, data), *_ = await arrivals(transport, 1.0)
    assert len(data) == 105 * 24  # half a second of packets


@pytest.mark.parametrize("fault", [Fault(lose=True), Fault(halve=True), Fault(corrupt=3), Fault(delay=RETRANSMISSION)])
@inside(streaming)
async def test_a_fault_of_a_packet_delays_it(transport: SimTransport, fault: Fault) -> None:
    await transport.write(command(2))
    await arrivals(transport, 1.0)
    transport.robot.link.faults.append(fault)
    start = now()
    found = await arrivals(transport, 2.0)
    assert found[0][0] - start == pytest.approx(RETRANSMISSION, abs=0.03)
    assert {packet[0] for packet in packets(b"".join(data for _, data in found))} == {2}


@inside(streaming)
async def test_a_copy_and_noise_do_not_reach_the_program(transport: SimTransport) -> None:
    await transport.write(command(2))
    await arrivals(transport, 0.99)
    transport.robot.link.double_next_reply(0.001)
    transport.robot.link.inject_noise(b"noise")
    assert 45 <= len(await stream(transport, 1.0)) <= 50


@inside(streaming)
async def test_a_stalled_network_holds_everything_up_and_then_delivers_it(transport: SimTransport) -> None:
    link = transport.robot.link
    await transport.write(command(2))
    await arrivals(transport, 1.0)
    link.stall()
    await transport.write(command(2, left=100, right=100))
    assert await arrivals(transport, 5.0) == []
    assert transport.robot.emulator.firmware.report()["speed"] == [0, 0]
    link.resume()
    found = await stream(transport, 1.0)
    assert len(found) >= 45 + 5744 // 105
    assert transport.robot.emulator.firmware.report()["speed"] == [100, 100]


@inside(streaming)
async def test_silence_holds_the_packets_up_and_lets_commands_pass(transport: SimTransport) -> None:
    link = transport.robot.link
    await transport.write(command(2))
    await arrivals(transport, 1.0)
    link.silence()
    await transport.write(command(2, left=100, right=100))
    assert await arrivals(transport, 0.5) == []
    assert transport.robot.emulator.firmware.report()["speed"] == [100, 100]
    link.end_silence()
    assert len(await stream(transport, 0.5)) >= 40


@inside(streaming)
async def test_a_program_that_does_not_read_slows_the_robot_and_loses_nothing(transport: SimTransport) -> None:
    await transport.write(command(1))
    await asyncio.sleep(10)  # 115 pictures, if somebody read them
    await transport.write(command(0))
    data = bytearray()
    while not data.endswith(b"\x03" * 5):
        data += await transport.read()
    found = packets(bytes(data))
    assert 2 <= sum(packet[0] == 1 for packet in found) <= 5


@pytest.mark.parametrize("count", [0, 1, 50, 104, 105, 106, 5_743, 5_744, 5_745, 38_400, 38_401, 38_402])
@inside(streaming)
async def test_a_connection_that_breaks_anywhere_delivers_what_came_before(transport: SimTransport, count: int) -> None:
    await transport.write(command(3))
    transport.robot.link.cut_after(to_host=count)
    data = bytearray()
    with pytest.raises(LinkLost):
        while True:
            data += await transport.read()
    assert len(data) == count


@pytest.mark.parametrize("count", [1, 20, 21, 22, 41])
@simulated
async def test_a_connection_that_breaks_within_a_command_leaves_the_robot_with_the_whole_ones(count: int) -> None:
    transport = await opened("&seed=1")
    emulator = transport.robot.emulator
    assert isinstance(emulator, WifiEmulator)
    await transport.write(command(2))
    await arrivals(transport, 0.5)
    transport.robot.link.cut_after(to_robot=count)
    with contextlib.suppress(LinkLost):
        await transport.write(command(2, left=100) + command(2, left=200))
    await asyncio.sleep(0.5)
    speed = emulator.firmware.report()["speed"]
    assert speed in ([0, 0], [100, 0])
    assert not emulator.is_stuck
    again = await opened("&seed=1")
    assert again.robot is transport.robot
    await again.write(command(0))
    assert set(await stream(again, 0.5)) == {b"\x03"}
    await transport.close()
    await again.close()


@simulated
async def test_the_robot_restarts_with_its_connection_lost_and_listens_again() -> None:
    transport = await opened("&seed=2")
    await transport.write(command(2, left=500, right=500))
    await arrivals(transport, 0.5)
    transport.robot.link.power_cycle()
    with pytest.raises(LinkLost):
        await transport.read()
    assert transport.robot.emulator.firmware.report()["speed"] == [0, 0]
    again = await opened("&seed=2")
    await again.write(command(2))
    found = await arrivals(again, 15.0)
    assert {packet[0] for packet in packets(b"".join(data for _, data in found))} == {2}
    await transport.close()
    await again.close()


@simulated
async def test_what_an_old_program_left_unread_the_next_one_does_not_get() -> None:
    first = await opened("&robots=2&robot=1&latency=0.1")
    other = await opened("&robots=2&robot=2&latency=0.1")
    await first.write(command(2))
    await asyncio.sleep(1.0)
    await first.close()
    again = await opened("&robots=2&robot=1&latency=0.1")
    await asyncio.sleep(1.0)
    await again.write(command(0))
    assert set(await stream(again, 1.0)) == {b"\x03"}
    await again.close()
    await other.close()


@simulated
async def test_one_program_at_a_time_has_a_robot() -> None:
    first = await opened("&robots=2&robot=1")
    with pytest.raises(LinkBusy):
        await opened("&robots=2&robot=1")
    await first.close()


@simulated
async def test_a_fault_script_delays_packets_and_cuts(tmp_path: Path) -> None:
    script = tmp_path / "bad.toml"
    script.write_text(
        'description = "of a test"\n'
        '[[fault]]\nkind = "loss"\nprobability = 0.1\n'
        '[[fault]]\nkind = "corrupt"\nprobability = 0.02\n'
        '[[fault]]\nkind = "duplicate"\nprobability = 0.1\n'
        '[[fault]]\nkind = "noise"\nrate = 2\nsize = 9\n'
        '[[fault]]\nkind = "cut"\nfrom = 10\nuntil = 12\n'
    )
    transport = await opened(f"&fault={script}")
    await transport.write(command(2))
    data = bytearray()
    with pytest.raises(LinkLost):
        while True:
            data += await transport.read()
    whole = packets(bytes(data[: len(data) // 105 * 105]))
    assert {packet[0] for packet in whole} == {2}
    counts = transport.robot.player.counts  # type: ignore[union-attr]
    assert counts.lost > 5
    assert counts.cuts == 1
    with pytest.raises(LinkNotFound):
        await opened(f"&fault={script}")
    await asyncio.sleep(2.5)
    again = await opened(f"&fault={script}")
    await again.write(command(0))
    assert b"\x03" in await stream(again, 5.0)
    await transport.close()
    await again.close()


@simulated
async def test_robots_of_one_world_have_streams_of_their_own() -> None:
    robots = [await opened(f"&robots=3&robot={number}") for number in (1, 2, 3)]
    for index, robot in enumerate(robots):
        await robot.write(command(2, left=100 * (index + 1)))
    await arrivals(robots[0], CONNECTING)
    for index, robot in enumerate(robots):
        found = await stream(robot, 1.0)
        assert int.from_bytes(found[-1][80:82], "little") >= 90 * (index + 1)
        assert int.from_bytes(found[-1][82:84], "little") == 0
    for robot in robots:
        await robot.close()


@jumping
async def test_a_paused_world_sends_nothing_and_goes_on_after_the_pause() -> None:
    transport = await open_transport("sim://square?firmware=epuck2-wifi&quality=ideal")
    assert isinstance(transport, SimTransport)
    simulation: Simulation = transport.simulation
    await transport.write(command(2))
    await arrivals(transport, 0.2)
    control = Control(simulation)
    control.pause()
    await arrivals(transport, 0.05)
    assert await arrivals(transport, 0.2) == []
    simulation.step(0.5)
    assert len(await stream(transport, 0.05)) >= 20
    control.resume()
    assert len(await stream(transport, 0.5)) >= 10
    await transport.close()


@inside(streaming)
async def test_led2_can_be_seen_in_the_world(transport: SimTransport) -> None:
    world = transport.simulation.world
    assert world is not None

    def led2() -> str:
        return str(world.snapshot().robots[0].lamps.ring[1])

    assert led2() == "#00ff00"
    await transport.write(command(2))
    await arrivals(transport, CONNECTING)
    seen = {led2()}
    for _ in range(50):
        await arrivals(transport, 0.003)
        seen.add(led2())
    assert seen == {"#00ff00", "#0000ff", "#000000"}


# -- the times that were measured --


def gaps(request: int, count: int, *, quality: str = "typical", seed: int = 1) -> list[float]:
    """Return the times between whole packets of a kind on their arrival, ms, in rising order."""
    size = {1: 38_401, 2: 105}[request]

    @simulated
    async def listen() -> list[float]:
        transport = await open_transport(f"sim://square?firmware=epuck2-wifi&speed=max&quality={quality}&seed={seed}")
        await transport.write(command(request))
        found: list[float] = []
        received = 0
        while len(found) <= count:
            received += len(await transport.read())
            found += [1000 * now()] * (received // size - len(found))
        await transport.close()
        return found

    found = listen()
    return sorted(late - early for early, late in itertools.pairwise(found))


def percentiles(values: list[float], *shares: float) -> list[float]:
    return [values[int(share / 100 * (len(values) - 1))] for share in shares]


def test_an_ideal_robots_packets_and_pictures_come_in_the_measured_periods() -> None:
    assert gaps(2, 100, quality="ideal") == pytest.approx([21.5] * 100, abs=0.1)
    assert gaps(1, 20, quality="ideal")[1:-1] == pytest.approx([137] * 18, abs=2)


def test_a_typical_robots_packets_come_as_irregularly_as_was_measured() -> None:
    # measured-robots: latency.wifi_packet: 17.6 21.1 22.9 26.5 30.1 56.6 392.4
    found = gaps(2, 4000)
    p25, p50, p75, p90, p95, p99, most = percentiles(found, 25, 50, 75, 90, 95, 99, 100)
    assert (p25, p50, p75) == pytest.approx((18.5, 21.1, 22.9), abs=1.5)
    assert (p90, p95) == pytest.approx((26.5, 30.1), abs=4)
    assert 40 < p99 < 80
    assert 200 < most < 420


def test_a_typical_robots_pictures_have_the_long_tail_that_was_measured() -> None:
    # measured-robots: latency.wifi_picture: 137 300 1115 1500 5000
    found = gaps(1, 600)
    p50, p75, p90, p95, most = percentiles(found, 50, 75, 90, 95, 100)
    assert p50 == pytest.approx(137, abs=20)
    assert p75 == pytest.approx(300, abs=100)
    assert p90 == pytest.approx(1115, rel=0.3)
    assert p95 == pytest.approx(1500, rel=0.3)
    assert 3000 < most < 5200


def test_the_same_seed_gives_the_same_times_and_another_one_others() -> None:
    first = gaps(2, 300, seed=3)
    assert gaps(2, 300, seed=3) == first
    assert gaps(2, 300, seed=4) != first


@pytest.mark.parametrize(("readings", "pictures"), [(500, 30), pytest.param(6_000, 300, marks=pytest.mark.long)])
def test_no_call_gives_up_too_early_on_a_typical_network(readings: int, pictures: int) -> None:
    with elib.connect("sim://square?firmware=epuck2-wifi&speed=max") as robot:
        for _ in range(readings):
            robot.proximity()
        for _ in range(pictures):
            robot.image()
            robot.proximity()  # It may wait behind a picture.
