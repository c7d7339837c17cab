import asyncio
from statistics import fmean, pstdev

import pytest
from link_rig import Parrot, make_rig

from elib.base.errors import ArgumentError, LinkLost
from elib.link.transport.base import BUFFER_LIMIT
from elib.link.transport.memory import memory_pair
from elib.simulator.emulator.faults import Fault, both
from elib.testing import simulated
from shared import now


@simulated
async def test_without_delay_an_answer_comes_when_the_robot_gives_it() -> None:
    rig = make_rig(Parrot(service=0.25))
    await rig.host.write(b"HELLO\r")
    assert await rig.host.read() == b"hello\r\n"
    assert now() == 0.25


@simulated
async def test_latency_is_paid_each_way() -> None:
    rig = make_rig(Parrot(service=0.5), latency=0.125)
    await rig.host.write(b"A\r")
    assert await rig.host.read() == b"a\r\n"
    assert rig.robot.arrivals == [(0.125, b"A\r")]
    assert now() == 0.75


@pytest.mark.parametrize("origin", [0.0, 0.1, 1e3 / 3, 1e6 / 7])
@simulated
async def test_an_answer_comes_at_its_time_whatever_the_origin(origin: float) -> None:
    await asyncio.sleep(origin)

    class Watched(Parrot):
        looks = 0

        @property
        def due(self) -> float | None:
            self.looks += 1
            assert self.looks < 1000, "the link looks at the robot again and again without end"
            return super().due

    for number in range(1, 30):
        rig = make_rig(Watched(service=number / 7))
        start = now()
        await rig.host.write(b"A\r")
        assert await rig.host.read() == b"a\r\n"
        assert now() - start == pytest.approx(number / 7, abs=1e-6)


@simulated
async def test_jitter_varies_the_delay_and_never_the_order() -> None:
    rig = make_rig(latency=0.2, jitter=0.02, seed=7)
    delays = []
    for number in range(200):
        await rig.host.write(b"%d\r" % number)
        await asyncio.sleep(0.01)
        await asyncio.sleep(1 if number % 2 else 0)
    times = [time for time, _ in rig.robot.arrivals]
    assert times == sorted(times)
    assert [data for _, data in rig.robot.arrivals] == [b"%d\r" % number for number in range(200)]
    sent = [1.02 * (number // 2) + 0.01 * (number % 2) for number in range(200)]
    delays = [time - start for time, start in zip(times[::2], sent[::2], strict=True)]
    assert fmean(delays) == pytest.approx(0.2, abs=0.01)
    assert pstdev(delays) == pytest.approx(0.02, rel=0.3)


@simulated
async def test_the_same_seed_jitters_the_same_way() -> None:
    seen = []
    for _ in range(2):
        rig = make_rig(latency=0.1, jitter=0.05, seed=3)
        for _ in range(10):
            await rig.ask(b"A\r")
        seen.append([time for time, _ in rig.robot.arrivals])
    assert seen[0] == pytest.approx(seen[1])
    assert len(set(seen[0])) == 10


@simulated
async def test_loss_takes_whole_answers_in_the_proportion_asked_for() -> None:
    rig = make_rig(Parrot(piece=3), loss=0.25, seed=1)
    answers = [await rig.ask(b"ABCDEFG\r", 0.01) for _ in range(400)]
    assert set(answers) == {b"", b"abcdefg\r\n"}
    assert answers.count(b"") == pytest.approx(100, abs=25)


@simulated
async def test_bytes_that_answer_nothing_use_up_no_fault() -> None:
    rig = make_rig()
    assert await rig.ask(b"A\r") == b"a\r\n"
    rig.link.lose_next_reply()
    rig.robot.say(b"banner\r\n", now())
    rig.link.catch_up()
    assert await rig.listen() == b"banner\r\n"
    assert await rig.ask(b"A\r") == b""
    assert await rig.ask(b"B\r") == b"b\r\n"


@simulated
async def test_faults_change_successive_answers_in_order() -> None:
    rig = make_rig()
    rig.link.faults.extend([Fault(), Fault(lose=True), Fault(halve=True)])
    rig.link.corrupt_next_reply(0)
    rig.link.double_next_reply()
    answers = [await rig.ask(b"WORD\r") for _ in range(6)]
    assert answers == [
        b"word\r\n",
        b"",
        b"wor",
        bytes([ord("w") ^ 0x80]) + b"ord\r\n",
        b"word\r\nword\r\n",
        b"word\r\n",
    ]


@simulated
async def test_a_delayed_answer_holds_up_those_behind_it() -> None:
    rig = make_rig()
    rig.link.delay_next_reply(0.5)
    await rig.host.write(b"A\r")
    await rig.host.write(b"B\r")
    assert await rig.host.read() == b"a\r\nb\r\n"
    assert now() == 0.5


@simulated
async def test_a_late_copy_lets_others_pass() -> None:
    rig = make_rig()
    rig.link.double_next_reply(0.5)
    assert await rig.ask(b"A\r", 0.2) == b"a\r\n"
    assert await rig.ask(b"B\r", 0.2) == b"b\r\n"
    assert await rig.host.read() == b"a\r\n"
    assert now() == 0.5


@simulated
async def test_half_of_a_long_answer_is_half_of_all_its_bytes() -> None:
    rig = make_rig(Parrot(service=0.01, piece=3))
    rig.link.halve_next_reply()
    assert await rig.ask(b"ABCDEFGHIJKLM\r") == b"abcdefg"
    assert await rig.ask(b"N\r") == b"n\r\n"


@simulated
async def test_the_copy_of_a_long_answer_comes_after_its_end() -> None:
    rig = make_rig(Parrot(service=0.01, piece=3))
    rig.link.double_next_reply()
    await rig.host.write(b"ABCDEFG\rNEXT\r")
    assert await rig.listen() == b"abcdefg\r\nabcdefg\r\nnext\r\n"


@simulated
async def test_several_faults_of_one_answer_combine() -> None:
    rig = make_rig()
    rig.link.faults.append(Fault(delay=0.25, halve=True, copy_after=0.25, corrupt=1, mask=0x20))
    await rig.host.write(b"WORD\r")
    assert await rig.host.read() == b"wOr"
    assert now() == 0.25
    assert await rig.host.read() == b"wOr"
    assert now() == 0.5


@simulated
async def test_a_random_byte_is_chosen_by_the_seed() -> None:
    answers = []
    for _ in range(2):
        rig = make_rig(seed=5)
        rig.link.corrupt_next_reply(mask=1)
        answers.append(await rig.ask(b"ABCDEFGH\r"))
    assert answers[0] == answers[1]
    assert sum(a != b for a, b in zip(answers[0], b"abcdefgh\r\n", strict=True)) == 1


@simulated
async def test_a_silent_robot_still_hears() -> None:
    rig = make_rig()
    rig.link.silence()
    assert await rig.ask(b"A\r") == b""
    rig.link.end_silence()
    assert await rig.ask(b"B\r") == b"b\r\n"
    assert rig.robot.heard == b"A\rB\r"


@simulated
async def test_a_stalled_link_keeps_everything_for_later() -> None:
    rig = make_rig(latency=0.1)
    await rig.host.write(b"A\r")
    await asyncio.sleep(0.05)
    rig.link.stall()
    assert await rig.ask(b"B\r", 5) == b""
    assert rig.robot.heard == b""
    rig.link.resume()
    assert await rig.listen() == b"a\r\nb\r\n"


@simulated
async def test_a_program_that_writes_into_a_stalled_link_is_told_after_five_seconds() -> None:
    rig = make_rig()
    rig.link.stall()
    with pytest.raises(LinkLost, match="took no byte for 5 s"):
        await rig.host.write(bytes(100_000))
    assert now() == 5.0


@simulated
async def test_a_program_faster_than_the_line_waits_for_it() -> None:
    rig = make_rig(baud=9600)
    await rig.host.write(b"A" * 100_000)
    assert now() == pytest.approx((100_000 - 65_536) / 960, abs=1.5), "a buffer's worth may wait"
    await asyncio.sleep(70)
    assert len(rig.robot.heard) == 100_000


@simulated
async def test_a_cut_link_is_lost_at_once_and_the_robot_is_not() -> None:
    rig = make_rig(Parrot(service=0.1))
    await rig.host.write(b"A\r")
    rig.link.cut()
    with pytest.raises(LinkLost):
        await rig.host.read()
    host, end = memory_pair()
    rig.link.attach(end)
    await host.write(b"B\r")
    assert await host.read() == b"a\r\n", "the robot answered after the new link was there"
    assert await host.read() == b"b\r\n"


@simulated
async def test_a_link_can_be_cut_in_the_middle_of_an_answer() -> None:
    rig = make_rig()
    rig.link.cut_after(to_host=5)
    assert await rig.ask(b"A\r") == b"a\r\n"
    await rig.host.write(b"B\r")
    assert await rig.host.read() == b"b\r"
    with pytest.raises(LinkLost):
        await rig.host.read()


@simulated
async def test_a_link_can_be_cut_in_the_middle_of_a_command() -> None:
    rig = make_rig()
    rig.link.cut_after(to_robot=3)
    await rig.host.write(b"A\rBCD\r")
    with pytest.raises(LinkLost):
        await rig.host.write(b"E\r")
    assert rig.robot.heard == b"A\rB"


@simulated
async def test_what_a_program_wrote_before_it_left_still_reaches_the_robot() -> None:
    rig = make_rig(latency=0.2)
    await rig.host.write(b"STOP\r")
    await rig.host.close()
    await asyncio.sleep(0.3)
    assert rig.robot.heard == b"STOP\r"
    assert not rig.link.is_connected


@simulated
async def test_after_a_hang_up_the_next_client_gets_nothing_of_the_last_ones() -> None:
    rig = make_rig(latency=0.2)
    await rig.host.write(b"A\r")
    await asyncio.sleep(0.3)
    rig.link.hang_up()
    assert await rig.ask(b"B\r") == b"b\r\n"


@simulated
async def test_everything_that_arrives_is_traced_with_its_time() -> None:
    rig = make_rig(Parrot(service=0.25), latency=0.25)
    seen: list[tuple[float, str, bytes]] = []
    rig.link.trace = lambda *event: seen.append(event)
    await rig.ask(b"A\r")
    assert seen == [(0.25, "to robot", b"A\r"), (0.75, "to host", b"a\r\n")]


@simulated
async def test_an_idle_link_wakes_nobody() -> None:
    rig = make_rig()
    await rig.ask(b"A\r")
    loop = asyncio.get_running_loop()
    assert not [timer for timer in loop._scheduled if not timer.cancelled()]


@pytest.mark.parametrize(
    "option", [{"latency": -1}, {"jitter": float("nan")}, {"loss": 1.5}, {"latency": 1e9}], ids=str
)
@simulated
async def test_a_value_out_of_range_is_refused(option: dict[str, float]) -> None:
    with pytest.raises(ArgumentError, match="must be a number from 0 to"):
        make_rig(**option)


@pytest.mark.parametrize("fault", [{"delay": -1}, {"copy_after": float("inf")}, {"mask": 0}, {"corrupt": -2}], ids=str)
def test_an_impossible_fault_is_refused(fault: dict[str, float]) -> None:
    with pytest.raises(ArgumentError):
        Fault(**fault)


def test_of_two_faults_the_one_that_inverts_bits_says_which() -> None:
    corrupting, slow = Fault(corrupt=3, mask=0x01), Fault(delay=0.1)
    for found in (both(corrupting, slow), both(slow, corrupting)):
        assert found == Fault(delay=0.1, corrupt=3, mask=0x01)


@simulated
async def test_cutting_after_nothing_at_all_is_refused() -> None:
    with pytest.raises(ArgumentError, match="to_robot=N or to_host=N"):
        make_rig().link.cut_after()


@simulated
async def test_whatever_a_client_wrote_before_it_left_arrives_however_much_it_is_up_to_a_bound() -> None:
    for size in (1_000, 60_000, 300_000):
        rig = make_rig()
        _, end = memory_pair("sim://toy")
        rig.link.attach(end)
        end.feed(b"\r" * size)
        end.lose("the client left")
        assert not rig.link.is_connected
        await asyncio.sleep(400)
        assert min(size, BUFFER_LIMIT) <= len(rig.robot.heard) <= min(size, 2 * BUFFER_LIMIT)
        assert set(rig.robot.heard) == {ord("\r")}
        host, end = memory_pair("sim://toy")
        rig.link.attach(end)
        await host.write(b"HELLO\r")
        await asyncio.sleep(1)
        assert await host.read() == b"hello\r\n"
