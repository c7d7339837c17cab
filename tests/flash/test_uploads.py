"""Uploads to the virtual robot in simulated time: what arrives there, and what an interrupted one leaves behind."""

from __future__ import annotations

import asyncio
import os
import random
from collections.abc import Sequence

import pytest
from hexfiles import expected, hex_file, random_program, small
from robot_rig import Rig

from elib.base.errors import ElibError, LinkLost, RemoteProtocolError, RobotSilent, Unsupported
from elib.link.transport import open_transport
from elib.simulator.emulator.sim_transport import SimTransport
from elib.testing import simulated
from elib.tools.flash import Image, Uploader
from elib.tools.flash.image import image_of
from lanes import short
from shared import now

E_PUCK1 = ("btcom-1.1.3", "btcom-2.0", "asercom-1.2.2")
PROGRAM = small(rows=30)
OTHER = {**small(0x4000, rows=100), 0x17000: 0x123456}
SHORT = small(rows=8)
PROGRAMS = int(os.environ.get("ELIB_PROGRAMS", "12"))
"""Random programs that the long form writes; 1,000 take some minutes."""
UPLOADS = int(os.environ.get("ELIB_UPLOADS", "2"))
"""Uploads that the long form disturbs in each of ten ways."""
SOME = [0, 1, 5, 10]
"""Packets of the quick forms: the first one, both ends of the rows and one in between."""
OTHERS = [2, 3, 4, 6, 7, 8, 9]
"""Those of the long forms."""


def image(program: dict[int, int] = PROGRAM) -> Image:
    return image_of(hex_file(program), "test.hex")


@pytest.mark.parametrize("firmware", E_PUCK1)
@simulated
async def test_a_program_is_written_and_the_robot_says_its_version(firmware: str) -> None:
    rig = Rig(firmware)
    version = await rig.upload(image())
    assert version is not None
    assert version.firmware == firmware
    assert rig.holds(expected(PROGRAM, 1234))
    assert rig.is_flashable
    assert rig.said == [f"The robot runs {firmware}: {version.text}. It is stopped and reset."]


@pytest.mark.parametrize("count", short([3, PROGRAMS], 3))
@simulated
async def test_random_programs_are_in_the_memory_as_they_are_in_the_file(count: int) -> None:
    rng = random.Random(count)
    rig = Rig(baud=0)
    for _ in range(count):
        program = random_program(rng, most_rows=rng.choice([10, 100, 1536]))
        number = rng.randrange(65536)
        await rig.upload(image(program), number)
        assert rig.holds(expected(program, number))
        assert rig.is_flashable


@simulated
async def test_a_driving_robot_is_stopped_before_it_is_reset() -> None:
    rig = Rig()
    rates = []
    host = rig.connect()
    await host.write(b"D,500,-500\r")
    await asyncio.sleep(0.1)
    assert rig.hardware.rates != (0.0, 0.0)
    reset = rig.robot.firmware.TEXT[ord("R")]

    rig.robot.firmware.TEXT = {
        **rig.robot.firmware.TEXT,
        ord("R"): lambda firmware, line: (rates.append(rig.hardware.rates), reset(firmware, line))[1],
    }
    await rig.upload(image())
    assert rates == [(0.0, 0.0)]


@simulated
async def test_a_robot_that_does_not_confirm_that_it_stands_is_not_reset() -> None:
    rig = Rig()
    resets = rig.robot.firmware.resets
    rig.robot.firmware.TEXT = {**rig.robot.firmware.TEXT, ord("S"): lambda firmware, line: b""}
    with pytest.raises(RemoteProtocolError, match="did not confirm that it stands still") as caught:
        await rig.upload(image())
    assert "Nothing was written: the robot keeps the program that it had." in caught.value.hint
    assert rig.robot.firmware.resets == resets


@simulated
async def test_a_robot_whose_program_does_not_answer_is_flashed_after_its_reset_button() -> None:
    rig = Rig()
    rig.robot.switch_off(0.0)
    await rig.upload_by_button(image(), after=20.0)
    assert rig.holds(expected(PROGRAM, 1234))
    assert rig.said == ["Press the robot's reset button now; its bootloader is called for 30 s."]


@simulated
async def test_what_a_program_without_sercom_sends_is_returned(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig()
    kind = type(rig.robot.firmware)
    monkeypatch.setattr(kind, "TEXT", {**kind.TEXT, ord("V"): lambda firmware, line: b"data,1,2\r\n"})
    assert b"data,1,2" in await rig.upload_by_button(image())


@simulated
async def test_without_a_bootloader_the_upload_ends_after_30_s_and_says_that_nothing_was_written() -> None:
    rig = Rig()
    rig.robot.switch_off(0.0)
    start = now()
    with pytest.raises(RobotSilent, match="no bootloader answered for 30 s") as caught:
        await rig.upload(image())
    assert "Nothing was written" in caught.value.hint
    assert now() - start < 36


@simulated
async def test_an_e_puck2_is_refused_before_anything_is_sent_that_changes_it() -> None:
    rig = Rig("epuck2")
    with pytest.raises(Unsupported, match="not an e-puck1"):
        await rig.upload(image())


@simulated
async def test_a_refused_packet_is_sent_again_when_both_sides_count_alike_again() -> None:
    rig = Rig()
    uploader = rig.uploader(image())
    spoil(rig, [2000])
    await uploader.run()
    assert rig.holds(expected(PROGRAM, 1234))
    assert uploader.upload is not None
    assert [failure.partition(": ")[2] for failure in uploader.upload.failures] == ["the check sum was wrong (N)"]


@pytest.mark.parametrize("latency", short([0.11, 0.0, 0.03, 0.06, 0.16, 0.24], 0.11))
@simulated
async def test_calls_that_were_still_on_their_way_do_not_shift_the_packets(latency: float) -> None:
    rig = Rig("asercom-1.2.2", latency=latency)
    await rig.upload(image())
    assert rig.holds(expected(PROGRAM, 1234))
    assert rig.is_flashable
    assert set(rig.robot.memory.rows) == set(image().rows)


def spoil(rig: Rig, places: list[int], *, how: str = "change") -> None:
    """Change, lose or double some of the bytes that the robot hears, counted from now."""
    receive, heard = rig.robot.receive, 0

    def spoiled(data: bytes, time: float) -> None:
        nonlocal heard
        found = bytearray()
        for byte in data:
            heard += 1
            if heard not in places:
                found.append(byte)
            elif how == "change":
                found.append(byte ^ 0x10)
            elif how == "double":
                found += bytes((byte, byte))
        receive(bytes(found), time)

    rig.robot.receive = spoiled  # type: ignore[method-assign]


@pytest.mark.parametrize("how", ["change", "lose", "double"])
@pytest.mark.parametrize("seed", short(range(4), 0))
@simulated
async def test_bytes_that_change_vanish_or_come_twice_cost_time_and_nothing_else(how: str, seed: int) -> None:
    rng = random.Random(f"{how} {seed}")
    rig = Rig()
    spoil(rig, sorted(rng.sample(range(60, 3500), 3)), how=how)
    await rig.upload(image())
    assert rig.holds(expected(PROGRAM, 1234))
    assert set(rig.robot.memory.rows) == set(image().rows), "no row was written that is not in the program"
    assert rig.is_flashable


@pytest.mark.parametrize("rows", short([SOME, OTHERS], SOME))
@pytest.mark.parametrize("how", ["change", "lose", "double", "the answer is lost"])
@simulated
async def test_a_fault_at_any_row_is_mended(how: str, rows: Sequence[int]) -> None:
    for row in rows:
        rig = Rig()
        uploader = rig.uploader(image(SHORT))
        if how == "the answer is lost":
            lose_answer(rig, row)
        else:
            spoil(rig, [46 + 101 * row + 50], how=how)  # 46 bytes ask, stop, reset and call the robot
        await uploader.run()
        assert rig.holds(expected(SHORT, 1234)), f"row {row}"
        assert set(rig.robot.memory.rows) == set(image(SHORT).rows), f"row {row}"
        assert uploader.upload is not None
        assert len(uploader.upload.failures) == 1, f"row {row}"


def lose_answer(rig: Rig, number: int) -> None:
    """Lose the *number*-th K that answers a packet."""
    advance, count = rig.robot.advance, -1

    def advanced(time: float) -> list:
        nonlocal count
        kept = []
        for chunk in advance(time):
            if chunk.data == b"K":
                count += 1
                if count == number:
                    continue
            kept.append(chunk)
        return kept

    rig.robot.advance = advanced  # type: ignore[method-assign]


@simulated
async def test_a_robot_that_refuses_everything_is_given_up() -> None:
    rig = Rig()
    spoil(rig, list(range(46, 10**5, 100)))
    with pytest.raises(RemoteProtocolError, match="given up") as caught:
        await rig.upload(image())
    assert "Give the same command again" in caught.value.hint


CUTS = ("link", "power", "cancelled", "button", "change", "lose", "double", "answers", "silence", "stall")
"""What happens in the middle of an upload; "change", "lose" and "double" are what happens to bytes of the packets."""


async def disturbed_upload(rig: Rig, rng: random.Random, how: str) -> Exception | asyncio.CancelledError | None:
    """Begin an upload, let something happen at a random moment, and return its error."""
    loop, link = asyncio.get_running_loop(), rig.link
    moment = rng.uniform(0.2, 2.4)  # the rows are written from 0.4 to 1.8 s
    if how in ("change", "lose", "double"):
        # At most one in a packet: a check sum of 8 bits finds one wrong byte, but two may cancel out.
        pieces = rng.sample(range(0, 10_500, 300), rng.randint(1, 30))
        spoil(rig, [piece + rng.randrange(150) for piece in pieces], how=how)
    upload = asyncio.ensure_future(rig.upload(image(OTHER)))
    match how:
        case "power":  # the link goes with it
            loop.call_later(moment, rig.power_cycle)
            loop.call_later(moment, link.cut)
        case "answers":
            lose_answer(rig, rng.randrange(104))
            loop.call_later(moment, link.inject_noise, rng.choice([b"K", b"N", b"qK", b"\xff", b"KKKK"]))
        case "silence":
            loop.call_later(moment, link.silence)
            loop.call_later(moment + rng.uniform(0.0, 60.0), link.end_silence)
        case "stall":
            loop.call_later(moment, link.stall)
            loop.call_later(moment + rng.uniform(0.0, 60.0), link.resume)
        case "link" | "cancelled" | "button":
            acts = {"link": link.cut, "cancelled": upload.cancel, "button": rig.press_reset}
            loop.call_later(moment, acts[how])
        case _:
            pass
    try:
        await upload
    except (ElibError, asyncio.CancelledError) as error:
        return error
    finally:
        await asyncio.sleep(100.0)  # clock: simulated; the trouble is over then
        rig.mend()
    return None


@pytest.mark.parametrize("uploads", short([1, UPLOADS], 1))
@pytest.mark.parametrize("how", CUTS)
@simulated
async def test_uploads_that_are_disturbed_at_random_moments_leave_a_robot_that_is_flashed_again(
    how: str, uploads: int
) -> None:
    rng = random.Random(f"{how} {uploads}")
    for number in range(uploads):
        rig = Rig(rng.choice(E_PUCK1), latency=rng.choice([0.0, 0.002, 0.02]))
        error = await disturbed_upload(rig, rng, how)
        assert error is not None or rig.holds(expected(OTHER, 1234)), "an upload that ends well has written all"
        assert rig.is_flashable
        await rig.upload_by_button(image(), number)
        assert rig.holds(expected(PROGRAM, number))
        assert rig.is_flashable


@pytest.mark.parametrize("rows", short([SOME[1:], OTHERS], SOME[1:]))
@pytest.mark.parametrize("how", ["link", "power", "cancelled", "button"])
@simulated
async def test_an_upload_that_ends_behind_any_row_leaves_a_robot_that_is_flashed_again(
    how: str, rows: Sequence[int]
) -> None:
    for row in rows:
        rig = Rig()
        _, upload = await rig.begin(image(SHORT), rows=row)
        if how in ("power", "button"):
            (rig.power_cycle if how == "power" else rig.press_reset)()
        if how in ("power", "link"):
            rig.link.cut()
        if how == "cancelled":
            upload.cancel()
        if how != "button":
            with pytest.raises((ElibError, asyncio.CancelledError)):
                await upload
        else:
            await upload
            assert rig.holds(expected(SHORT, 1234))
        assert rig.is_flashable
        await rig.upload_by_button(image(), 7)
        assert rig.holds(expected(PROGRAM, 7))


@pytest.mark.parametrize("query", ["", "&loss=0.02&seed=3", "&latency=0.08&jitter=0.02", "&baud=0"])
@simulated
async def test_the_robot_of_a_sim_url_keeps_the_program_in_its_memory(query: str) -> None:
    transport = await open_transport(f"sim://square?firmware=btcom-1.1.3{query}")
    assert isinstance(transport, SimTransport)
    await Uploader(transport, image(), 99).run()
    memory = transport.robot.emulator.memory
    assert all(memory.instruction(address) == value for address, value in expected(PROGRAM, 99).items())
    await transport.close()


@simulated
async def test_a_cut_link_says_how_far_it_came_and_what_to_do() -> None:
    rig = Rig()
    uploader, upload = await rig.begin(image(), rows=10)
    rig.link.cut()
    with pytest.raises(LinkLost) as caught:
        await upload
    assert uploader.upload is not None
    assert f"{uploader.upload.written} of 32 rows are written" in caught.value.hint
    assert "waits in its bootloader" in caught.value.hint


@simulated
async def test_a_robot_whose_upload_was_interrupted_starts_nothing_and_is_found_at_once() -> None:
    rig = Rig()
    _, upload = await rig.begin(image(), rows=10)
    upload.cancel()
    with pytest.raises(asyncio.CancelledError):
        await upload
    listener = rig.connect()
    await asyncio.sleep(0.1)
    listener.take_unread()  # the last answer
    await asyncio.sleep(60.0)
    assert listener.unread == 0, "no program starts"
    await rig.upload(image(OTHER))
    assert rig.holds(expected(OTHER, 1234))


@simulated
async def test_after_an_interrupted_upload_it_is_not_said_that_the_robot_keeps_a_program() -> None:
    rig = Rig()
    _, upload = await rig.begin(image(), rows=10)
    rig.link.cut()
    with pytest.raises(LinkLost):
        await upload
    rig.mend()
    uploader = rig.uploader(image())
    upload = asyncio.ensure_future(uploader.run())
    await asyncio.sleep(0.1)
    upload.cancel()
    with pytest.raises(asyncio.CancelledError):
        await upload
    assert "no program has answered: the robot holds what it held before" in uploader.state
    assert "only a part of a program" in uploader.state


@simulated
async def test_power_that_fails_while_row_0_is_rewritten_is_the_one_case_without_a_way_back() -> None:
    rig = Rig()
    erase = rig.robot.memory.erase

    def erased(address: int) -> None:
        erase(address)
        if address == 0:
            asyncio.get_running_loop().call_later(0.001, rig.power_cycle)

    rig.robot.memory.erase = erased  # type: ignore[method-assign]
    with pytest.raises(ElibError):
        await rig.upload(image())
    assert not rig.is_flashable
