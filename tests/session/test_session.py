import asyncio
from itertools import pairwise
from unittest.mock import AsyncMock

import pytest
from fake_robot import ANSWERS, VERSIONS, FakeRobot, Rig, rig
from honest_rig import HonestRig, block, honest_rig

from elib.base.errors import (
    CommandRejected,
    LinkClosed,
    LinkLost,
    NotAnEpuck,
    RemoteProtocolError,
    ReplyTimeout,
    RobotSilent,
)
from elib.link.protocol.values import Proximity, Steps
from elib.link.session import GRACE, Call, Called, Ended, Greeted, Resynced, Session
from elib.link.transport import Transport
from elib.link.transport.memory import MemoryTransport, memory_pair
from elib.simulator.emulator.faults import Fault
from elib.testing import simulated
from shared import inside

NEAR = Proximity(1, 2, 3, 4, 5, 6, 7, 8)
PROBE_ANSWERS = {
    letter: ANSWERS.get(letter, VERSIONS["btcom-1.1.3"]) for letter in (b"V", b"Q", b"E", b"C", b"N", b"O")
}
PICTURE = bytes((0, 4, 3)) + bytes(range(12))


@inside(rig)
async def test_an_answer_becomes_the_value_of_its_call_and_says_when_and_where_it_came(r: Rig) -> None:
    value = await r.ask("proximity")
    assert isinstance(value, Proximity)
    assert (value, value.time, value.origin) == (NEAR, r.now, r.session.context.origin)
    assert await r.ask("encoders") == Steps(5, -6)


@inside(rig, delay=0.5)
async def test_calls_are_sent_in_their_order_one_at_a_time_each_the_moment_the_answer_before_it_came(r: Rig) -> None:
    calls = [r.begin(name, within=5) for name in ("proximity", "encoders", "selector", "ambient_light")]
    await asyncio.sleep(0.4)
    assert r.robot.raw == b"N\r"
    await asyncio.gather(*calls)
    assert r.robot.lines == [b"N", b"Q", b"C", b"O"]
    times = [time for time, _ in r.robot.heard]
    assert [round(b - a, 6) for a, b in pairwise(times)] == [0.5, 0.5, 0.5]


@inside(rig, delay=0.4)
async def test_the_deadline_counts_from_the_call_queueing_included_and_the_queue_goes_on(r: Rig) -> None:
    began = r.now
    first, second, third = (
        r.begin("proximity", within=2),
        r.begin("encoders", within=0.3),
        r.begin("selector", within=3),
    )
    with pytest.raises(ReplyTimeout, match=r"encoders\(\).*never sent"):
        await second
    assert r.now - began == pytest.approx(0.3)
    assert await first == NEAR
    await third
    await asyncio.sleep(2)
    assert r.robot.lines == [b"N", b"C"], "an expired request is never sent"


@simulated
async def test_timeouts_seconds_apart_do_not_disturb_each_other() -> None:
    def silent(robot: FakeRobot) -> None:
        robot.answers[b"N"] = []

    async with rig(prepare=silent) as r:
        began = r.now

        async def ends(within: float) -> float:
            await r.lose("proximity", within=within)
            return r.now - began

        assert await asyncio.gather(ends(0.5), ends(0.8), ends(5.0)) == pytest.approx([0.5, 0.8, 5.0])


@inside(rig)
async def test_calls_whose_time_is_over_at_the_same_moment_end_in_their_order_before_anything_is_sent(r: Rig) -> None:
    ended: list[str] = []
    r.session.hooks.append(lambda _, event: ended.append(event.request.name) if isinstance(event, Ended) else None)
    for letter in (b"N", b"O", b"Q"):
        r.robot.answers[letter] = []
    names = ["proximity", "ambient_light", "encoders"]
    calls = [r.session.submit(r.request(name), 0.3) for name in names]
    for call in calls:
        assert call.timer is not None
        call.timer.cancel()
    await asyncio.sleep(0.3)
    r.session._expire(calls[1])  # as if its timer rang first
    assert ended == names
    await asyncio.gather(*(call.future for call in calls), return_exceptions=True)
    assert r.robot.lines == [b"N"]


@pytest.mark.parametrize("pause", [0, 1])
@inside(rig)
async def test_a_late_answer_is_never_taken_for_the_next_one(r: Rig, pause: int) -> None:
    r.robot.next_answer(b"N", 0.3, b"n,9,9,9,9,9,9,9,9\r\n")
    with pytest.raises(ReplyTimeout) as caught:
        await r.ask("proximity", within=0.1)
    assert caught.value.request == "proximity()"
    await asyncio.sleep(pause)
    assert await r.ask("proximity", within=2) == NEAR
    assert r.robot.lines == [b"N", b"V", b"N"], "a resync stands between the two"


@simulated
async def test_a_defect_of_the_session_loses_the_link_with_its_reason_and_is_told_to_the_event_loop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[dict[str, object]] = []
    asyncio.get_running_loop().set_exception_handler(lambda loop, context: told.append(context))
    async with rig() as r:
        r.robot.next_answer(b"N", 0.3, b"n,9,9,9,9,9,9,9,9\r\n")
        await r.lose("proximity")
        defect = ZeroDivisionError("by mistake")
        monkeypatch.setattr(r.session, "_resynchronise", AsyncMock(side_effect=defect))
        with pytest.raises(LinkLost, match=r"by mistake(.|\n)*a defect of elib"):
            await r.ask("proximity", within=2)
        assert [context["exception"] for context in told] == [defect]


@inside(rig)
async def test_a_late_acknowledgement_does_not_confirm_the_same_command_again(r: Rig) -> None:
    r.robot.next_answer(b"F", 0.3, b"f\r\n")
    await r.lose("set_front_led", 1)
    r.robot.next_answer(b"F")  # the second one is lost
    await r.lose("set_front_led", 0, within=1)


@simulated
async def test_a_resync_begins_with_zeros_and_a_carriage_return() -> None:
    for firmware, zeros in (("btcom-1.1.3", 5), ("asercom-1.2.2", 36), ("epuck2", 36)):
        async with rig(firmware) as r:
            r.robot.next_answer(b"N")
            await r.lose("proximity")
            await r.ask("proximity", within=2)
            assert r.robot.raw == b"N\r" + bytes(zeros) + b"\rV\rN\r"


@inside(rig)
async def test_when_the_questions_run_out_the_link_is_lost_once_for_every_waiting_call(r: Rig) -> None:
    for letter in (b"N", b"V", b"Q", b"E", b"C", b"O"):
        r.robot.answers[letter] = []
    await r.lose("proximity")
    calls = [r.begin("proximity", within=60) for _ in range(3)]
    results = await asyncio.gather(*calls, return_exceptions=True)
    assert [type(result) for result in results] == [LinkLost] * 3
    assert "hint" in str(results[0])
    with pytest.raises(LinkLost, match="no longer answers"):
        await r.ask("proximity")


@inside(rig)
async def test_waiting_calls_keep_their_own_deadlines_during_a_resync(r: Rig) -> None:
    r.robot.next_answer(b"N")
    r.robot.next_answer(b"V")
    await r.lose("proximity")
    began = r.now
    with pytest.raises(ReplyTimeout, match="out of sync"):
        await r.ask("selector", within=0.5)
    assert r.now - began <= 0.5 + GRACE


@inside(rig, delay=0.0)
async def test_a_probe_answered_on_the_turn_of_its_timeout_does_not_end_the_session(r: Rig) -> None:
    r.robot.next_answer(b"N")
    r.robot.next_answer(b"V", 0.4, VERSIONS["btcom-1.1.3"])
    await r.lose("proximity")
    call = r.begin("proximity", within=5)
    await asyncio.sleep(0.1)
    block(0.6)  # the answer and the end of the probe's time are both due when the loop goes on
    assert await call == NEAR
    assert r.session.error is None
    assert await r.ask("encoders") == Steps(5, -6)


@inside(rig)
async def test_a_resync_asks_other_questions_than_the_abandoned_one_and_survives_four_lost_answers(r: Rig) -> None:
    for letter in (b"E", b"V", b"Q", b"C"):
        r.robot.next_answer(letter)
    await r.lose("speed")
    assert await r.ask("ambient_light", within=5)
    assert r.robot.lines == [b"E", b"V", b"Q", b"C", b"N", b"O"]


@inside(rig)
async def test_a_resync_asks_nothing_that_is_part_of_what_was_abandoned(r: Rig) -> None:
    r.robot.next_answer(b"\xbf")
    r.robot.next_answer(b"C")
    r.robot.next_answer(b"V")
    r.robot.next_answer(b"Q")
    r.robot.next_answer(b"E")
    await r.lose("attitude", within=0.3)  # its guard is the selector's question
    assert await r.ask("ambient_light", within=5)
    assert b"C" not in r.robot.lines[2:]


@inside(rig)
async def test_a_call_cancelled_on_the_turn_of_its_answer_is_counted_once(r: Rig) -> None:
    ended = []
    r.session.hooks.append(lambda _, event: ended.append(event) if isinstance(event, Ended) else None)
    call = r.begin("proximity")
    r.session.hooks.append(lambda _, event: call.cancel() if isinstance(event, Ended) else None)
    with pytest.raises(asyncio.CancelledError):
        await call
    assert len(ended) == 1


# -- an urgent stop ----------------------------------------------------------------------------------------------------


@inside(rig)
async def test_a_stop_on_a_line_out_of_sync_goes_out_before_any_probe_and_again_when_it_is_in_sync(r: Rig) -> None:
    r.robot.next_answer(b"N")
    await r.lose("proximity")
    r.robot.heard.clear()
    began = r.now
    await r.ask("stop", within=2)
    assert [line for _, line in r.robot.heard] == [b"S", b"V", b"S"]
    assert r.robot.heard[0][0] == began


@inside(rig)
async def test_a_stop_behind_a_probe_that_nobody_answers_goes_out_at_once(r: Rig) -> None:
    for letter in (b"N", b"V"):
        r.robot.next_answer(letter)
    await r.lose("proximity")
    waits = r.begin("encoders", within=5)
    await asyncio.sleep(0.1)
    began = r.now
    await r.ask("stop", within=5)
    assert next(time for time, line in r.robot.heard if line == b"S") == began
    assert await waits == Steps(5, -6)
    assert await r.ask("proximity") == NEAR
    assert r.session.error is None


@inside(rig)
async def test_a_stop_behind_a_call_whose_answer_is_lost_goes_out_within_a_twentieth_of_a_second(r: Rig) -> None:
    r.robot.next_answer(b"N")
    lost = r.begin("proximity", within=3)
    await asyncio.sleep(0.1)
    began = r.now
    stop = r.begin("stop", within=5)
    with pytest.raises(ReplyTimeout):
        await lost
    await stop
    times = [time for time, line in r.robot.heard if line == b"S"]
    assert times[0] - began == pytest.approx(0.05)
    assert len(times) == 2


@inside(rig)
async def test_a_stop_behind_a_call_that_is_answered_soon_goes_out_once_and_in_its_turn(r: Rig) -> None:
    near = r.begin("proximity")
    await asyncio.sleep(0)
    await r.ask("stop")
    assert await near == NEAR
    assert r.robot.lines == [b"N", b"S"]
    assert await r.ask("encoders") == Steps(5, -6)
    assert r.robot.lines == [b"N", b"S", b"Q"]


@inside(rig, delay=0.3)
async def test_the_answer_of_a_stop_that_went_ahead_is_not_taken_for_another_answer(r: Rig) -> None:
    near = r.begin("proximity", within=3)
    stop = r.begin("stop", within=5)
    light = r.begin("ambient_light", within=5)
    assert await near == NEAR
    await stop
    assert list(await light) == [11, 12, 13, 14, 15, 16, 17, 18]
    assert r.robot.lines == [b"N", b"S", b"V", b"S", b"O"]


@inside(honest_rig, "btcom-2.0", latency=0.25)
async def test_pressing_stop_many_times_on_a_slow_line_out_of_sync_does_not_end_the_session(r: HonestRig) -> None:
    r.link.faults.append(Fault(lose=True))
    assert (await r.call("ambient_light", within=0.6)).error is not None
    stops = []
    for _ in range(60):
        stops.append(asyncio.ensure_future(r.call("stop", within=0.4)))
        await asyncio.sleep(0.2)
    await asyncio.gather(*stops)
    assert r.session.error is None
    outcome = await r.call("ambient_light", within=5)
    r.check(outcome)
    assert outcome.error is None


@simulated
async def test_a_stop_and_the_probe_behind_it_fit_the_receive_ring_of_a_busy_robot() -> None:
    for firmware in ("btcom-2.0", "asercom-1.2.2", "epuck2"):
        async with rig(firmware) as r:
            r.robot.next_answer(b"N")
            await r.lose("proximity")
            r.robot.raw.clear()
            stop = r.begin("stop", within=2)
            await asyncio.sleep(0.01)
            assert b"S\r" in r.robot.raw
            assert len(r.robot.raw) <= r.session.profile.receive_ring
            await stop


@inside(rig)
async def test_a_stale_line_of_another_command_is_thrown_away(r: Rig) -> None:
    r.robot.next_answer(b"N", b"f\r\n", 0.01, b"n,1,2,3,4,5,6,7,8\r\n")
    assert await r.ask("proximity") == NEAR
    await r.ask("selector")
    assert r.robot.lines == [b"N", b"V", b"C"], "a line out of sync is resynchronised"


@inside(rig)
async def test_a_stale_acknowledgement_does_not_confirm_another_command(r: Rig) -> None:
    r.robot.next_answer(b"D", b"f\r\n")
    await r.lose("set_speed", 0.1, 0.1, within=0.2)


@simulated
async def test_an_answer_may_come_in_any_pieces_with_any_line_end_and_in_capital_letters() -> None:
    answer = b"n,1,2,3,4,5,6,7,8\r\n"
    async with rig() as r:
        r.robot.next_answer(b"N", *(part for byte in answer for part in (bytes((byte,)), 0.001)))
        assert await r.ask("proximity") == NEAR
        for line in (*(answer.rstrip() + end for end in (b"\n", b"\r\n", b"\r\r\n")), answer.upper()):
            r.robot.next_answer(b"N", line)
            assert await r.ask("proximity") == NEAR


@inside(rig)
async def test_a_doubled_answer_is_noticed_and_resynchronised(r: Rig) -> None:
    r.robot.next_answer(b"N", b"n,1,2,3,4,5,6,7,8\r\n" * 2)
    assert await r.ask("proximity") == NEAR
    r.robot.answers[b"N"] = [b"n,8,8,8,8,8,8,8,8\r\n"]
    assert await r.ask("proximity") == Proximity(8, 8, 8, 8, 8, 8, 8, 8)
    assert r.robot.lines == [b"N", b"V", b"N"]


@inside(rig)
async def test_a_copy_of_a_probes_answer_costs_no_second_resync(r: Rig) -> None:
    r.robot.next_answer(b"N")
    r.robot.next_answer(b"V", VERSIONS["btcom-1.1.3"], 0.005, VERSIONS["btcom-1.1.3"])
    await r.lose("proximity")
    assert await r.ask("proximity", within=2) == NEAR
    assert await r.ask("encoders") == Steps(5, -6)
    assert r.robot.lines == [b"N", b"V", b"N", b"Q"]


@simulated
async def test_a_link_that_doubles_every_answer_still_works() -> None:
    def doubling(robot: FakeRobot) -> None:
        for letter, answer in ((b"N", b"n,1,2,3,4,5,6,7,8\r\n"), (b"Q", b"q,5,-6\r\n"), (b"E", b"e,0,0\r\n")):
            robot.answers[letter] = [answer * 2]

    async with rig(prepare=doubling) as r:
        r.robot.answers[b"V"] = [b"v,Version 1.1.3 September 2006\r\n" * 2]
        for _ in range(10):
            assert await r.ask("proximity", within=2) == NEAR


@inside(rig)
async def test_calibration_is_complete_only_after_its_second_line(r: Rig) -> None:
    r.robot.next_answer(
        b"K",
        b"k, Starting calibration - Remove any object in sensors range\r\n",
        3.66,
        b"k, Calibration finished\r\n",
    )
    began = r.now
    await r.ask("calibrate_proximity", within=5)
    assert r.now - began == pytest.approx(3.66)


@pytest.mark.parametrize("first", [b"r\r", b"r\r\n", b"r\rSelector pos 3\r\n"])
@inside(rig)
async def test_a_reset_is_confirmed_by_the_greeting(r: Rig, first: bytes) -> None:
    greeting = b'\x0c\x07WELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'
    r.robot.next_answer(b"R", first, 1.4, greeting)
    began = r.now
    await r.ask("reset", within=3)
    assert r.now - began == pytest.approx(1.4)
    assert await r.ask("proximity") == NEAR
    assert r.robot.lines == [b"R", b"N"]


@inside(rig)
async def test_a_refused_command_is_an_error_at_once(r: Rig) -> None:
    r.robot.next_answer(b"N", b"z,Command not found\r\n")
    began = r.now
    with pytest.raises(CommandRejected, match="proximity"):
        await r.ask("proximity")
    assert r.now == began
    assert await r.ask("encoders") == Steps(5, -6)


@pytest.mark.parametrize("answer", [b"n,1,2\r\n", b"n,1,2,3,4,5,6,7,x\r\n", b"n\r\n", b"n,1,2,3,4,5,6,7,8,9\r\n"])
@inside(rig)
async def test_a_malformed_answer_is_an_error_never_silence(r: Rig, answer: bytes) -> None:
    r.robot.next_answer(b"N", answer)
    began = r.now
    with pytest.raises(RemoteProtocolError, match="expected"):
        await r.ask("proximity")
    assert r.now == began
    assert await r.ask("proximity", within=2) == NEAR


# -- order -----------------------------------------------------------------------------------------------------------


@inside(rig, delay=0.04)
async def test_stop_overtakes_what_waits(r: Rig) -> None:
    calls = [r.begin("proximity", within=5)]
    await asyncio.sleep(0.01)
    calls += [r.begin(name, within=5) for name in ("encoders", "selector", "stop")]
    await asyncio.gather(*calls)
    assert r.robot.lines == [b"N", b"S", b"Q", b"C"]


@inside(rig, delay=0.1)
async def test_a_newer_speed_replaces_an_unsent_older_one_and_both_get_its_outcome(r: Rig) -> None:
    first = r.begin("proximity", within=5)
    await asyncio.sleep(0.01)
    calls = [r.begin("set_speed", speed, speed, within=5) for speed in (0.1, 0.2, 0.3)]
    assert await asyncio.gather(*calls) == [None, None, None]
    await first
    assert r.robot.lines == [b"N", b"D,300,300"]


@inside(rig, delay=0.5)
async def test_a_replaced_speed_keeps_its_own_deadline(r: Rig) -> None:
    first = r.begin("proximity", within=5)
    await asyncio.sleep(0.01)
    older, newer = r.begin("set_speed", 0.1, 0.1, within=0.2), r.begin("set_speed", 0.2, 0.2, within=5)
    results = await asyncio.gather(first, older, newer, return_exceptions=True)
    assert isinstance(results[1], ReplyTimeout)
    assert results[2] is None
    assert r.robot.lines == [b"N", b"D,200,200"]


@inside(rig, delay=0.04)
async def test_a_speed_that_waits_is_not_driven_after_a_stop_that_overtook_it(r: Rig) -> None:
    first = r.begin("proximity", within=5)
    await asyncio.sleep(0.01)
    calls = [r.begin("set_speed", 0.5, 0.5, within=5), r.begin("stop", within=5)]
    await asyncio.gather(first, *calls)
    assert r.robot.lines == [b"N", b"S"]


@inside(rig, delay=0.1)
async def test_a_cancelled_call_that_waits_is_never_sent(r: Rig) -> None:
    first, second = r.begin("proximity"), r.begin("encoders")
    await asyncio.sleep(0.01)
    second.cancel()
    await first
    await asyncio.sleep(1)
    assert r.robot.lines == [b"N"]


@inside(rig)
async def test_a_cancelled_call_on_the_wire_is_resynchronised(r: Rig) -> None:
    r.robot.next_answer(b"N", 0.3, b"n,9,9,9,9,9,9,9,9\r\n")
    call = r.begin("proximity")
    await asyncio.sleep(0.1)
    call.cancel()
    assert await r.ask("proximity", within=2) == NEAR
    assert r.robot.lines == [b"N", b"V", b"N"]


# -- pictures --------------------------------------------------------------------------------------------------------


@inside(rig)
async def test_a_late_picture_is_received_to_its_end_and_travels_on_the_error(r: Rig) -> None:
    r.robot.next_answer(b"\xb7", PICTURE[:5], 0.05, PICTURE[5:10], 0.08, PICTURE[10:])
    with pytest.raises(ReplyTimeout) as caught:
        await r.ask("image", within=0.06)
    assert caught.value.image.raw == PICTURE[3:]
    assert await r.ask("proximity") == NEAR
    assert r.robot.lines == [b"\xb7", b"N"], "a picture that came whole needs no resync"


@inside(rig)
async def test_a_tenth_of_a_second_of_silence_ends_a_late_picture(r: Rig) -> None:
    r.robot.next_answer(b"\xb7", PICTURE[:5], 0.05, PICTURE[5:9])
    began = r.now
    with pytest.raises(ReplyTimeout) as caught:
        await r.ask("image", within=0.04)
    assert caught.value.image is None
    assert r.now - began == pytest.approx(0.15)
    assert await r.ask("proximity", within=2) == NEAR


@inside(rig)
async def test_a_picture_of_which_nothing_comes_ends_and_the_queue_goes_on(r: Rig) -> None:
    r.robot.next_answer(b"\xb7")
    began = r.now
    await r.lose("image", within=0.3)
    assert r.now - began <= 0.3 + GRACE
    assert await r.ask("proximity", within=2) == NEAR


@inside(rig)
async def test_a_picture_that_begins_after_its_deadline_is_not_read_as_text(r: Rig) -> None:
    r.robot.next_answer(b"\xb7", 0.5, b"n,9,9,9,9,9,9,9,9\r\n" + PICTURE)
    await r.lose("image")
    assert await r.ask("proximity", within=3) == NEAR


@inside(rig)
async def test_an_impossible_picture_header_is_an_error(r: Rig) -> None:
    r.robot.next_answer(b"\xb7", bytes((7, 200, 200)) + bytes(50))
    with pytest.raises(RemoteProtocolError, match="mode 7"):
        await r.ask("image")
    assert await r.ask("proximity", within=2) == NEAR


# -- the end ---------------------------------------------------------------------------------------------------------


class SlowTransport:
    """A transport that can only be read and written, and takes its time for each write."""

    def __init__(self, inner: Transport) -> None:
        self.url, self.origin = inner.url, inner.origin
        self.read, self.close = inner.read, inner.close
        self._inner = inner

    async def write(self, data: bytes) -> None:
        await asyncio.sleep(0.1)  # clock: simulated
        await self._inner.write(data)


@simulated
async def test_what_was_sent_unqueued_leaves_a_slow_line_before_it_is_closed() -> None:
    host, far = memory_pair()
    robot = FakeRobot(far)
    task = asyncio.ensure_future(robot.run())
    session = await Session.open(SlowTransport(host))
    assert session.send_unqueued(b"S\r")
    await session.close()
    await task
    assert robot.lines[-1] == b"S"


class TricklingTransport(MemoryTransport):
    """A transport that takes a byte a second from when it is told to."""

    is_slow = False

    def flush(self) -> None:
        if not self.is_slow:
            super().flush()

    async def trickle(self, far: MemoryTransport) -> None:
        self.is_slow = True
        while self.is_open:
            await asyncio.sleep(1)  # clock: simulated
            if self._out:
                far.feed(bytes([self._out.pop(0)]))
                self.wake_writer()


@simulated
async def test_a_line_that_moves_a_byte_a_second_is_not_lost() -> None:
    host, far = TricklingTransport("memory://"), MemoryTransport("memory://")
    host.join(far)
    robot = FakeRobot(far)
    task = asyncio.ensure_future(robot.run())
    r = Rig(await Session.open(host), robot, far)
    robot.next_answer(b"N", 0.3)
    await r.lose("proximity")
    trickling = asyncio.ensure_future(host.trickle(far))
    assert await r.ask("proximity", within=60) == NEAR
    await r.session.close()
    await asyncio.gather(trickling, task)


@inside(rig)
async def test_closing_ends_every_call_queued_and_under_way(r: Rig) -> None:
    r.robot.answers[b"N"] = []
    calls = [r.begin("proximity", within=9) for _ in range(3)]
    await asyncio.sleep(0.1)
    began = r.now
    await r.session.close()
    await r.session.close()
    results = await asyncio.gather(*calls, return_exceptions=True)
    assert [type(result) for result in results] == [LinkClosed] * 3
    assert r.now == began
    with pytest.raises(LinkClosed):
        await r.ask("proximity")


@inside(rig)
async def test_a_link_that_breaks_ends_every_call_with_the_first_reason(r: Rig) -> None:
    r.robot.answers[b"N"] = []
    calls = [r.begin("proximity", within=9) for _ in range(3)]
    await asyncio.sleep(0.1)
    await r.link.close()
    results = await asyncio.gather(*calls, return_exceptions=True)
    assert [type(result) for result in results] == [LinkLost] * 3
    with pytest.raises(LinkLost):
        await r.ask("stop")


@inside(rig)
async def test_waiting_and_unanswered_calls_are_counted(r: Rig) -> None:
    r.robot.answers[b"N"] = []
    calls = [r.begin("proximity", within=0.5) for _ in range(3)]
    await asyncio.sleep(0.1)
    assert (r.session.waiting, r.session.unanswered) == (2, 3)
    await asyncio.gather(*calls, return_exceptions=True)
    assert (r.session.waiting, r.session.unanswered) == (0, 0)


# -- opening ---------------------------------------------------------------------------------------------------------


@simulated
async def test_opening_survives_what_an_earlier_program_left_on_the_line() -> None:
    host, far = memory_pair()
    robot = FakeRobot(far)
    await far.write(b"n,1,2,3,4,5\xff\x00\r\nhalf a li")
    task = asyncio.ensure_future(robot.run())
    session = await Session.open(host)
    assert session.profile.name == "btcom-1.1.3"
    await session.close()
    await asyncio.gather(task, return_exceptions=True)


@simulated
async def test_a_port_where_nobody_answers_is_a_silent_robot() -> None:
    host, _far = memory_pair()
    began = asyncio.get_running_loop().time()
    with pytest.raises(RobotSilent, match="switch the robot on"):
        await Session.open(host)
    assert asyncio.get_running_loop().time() - began < 6


@simulated
async def test_a_silent_first_channel_that_was_asked_for_may_be_an_epuck2s_which_talks_on_the_second() -> None:
    hints = []
    for channel in ("", "?channel=1", "?channel=2"):
        host, _far = memory_pair(f"rfcomm://08:3A:F2:00:00:01{channel}")
        with pytest.raises(RobotSilent) as caught:
            await Session.open(host)
        hints.append("rfcomm://08:3A:F2:00:00:01?channel=2" in caught.value.hint)
    assert hints == [False, True, False]


@pytest.mark.parametrize("firmware", VERSIONS)
@simulated
async def test_a_robot_that_answers_too_late_is_not_called_something_else(firmware: str) -> None:
    with pytest.raises(RobotSilent, match=r"answered too late, after more than 4 s: v,Version"):
        async with rig(firmware, delay=4.12):
            pass


@simulated
async def test_something_that_answers_otherwise_is_not_an_epuck() -> None:
    host, far = memory_pair()

    async def modem() -> None:
        while True:
            await far.read()
            await far.write(b"AT\r\nERROR\r\n")

    task = asyncio.ensure_future(modem())
    with pytest.raises(NotAnEpuck, match="ERROR"):
        await Session.open(host)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


# -- noise and other faults ------------------------------------------------------------------------------------------


@inside(rig)
async def test_megabytes_of_noise_end_in_one_error_and_bounded_memory(r: Rig) -> None:
    r.robot.next_answer(b"N", *[bytes(range(1, 256)) * 64 for _ in range(128)])
    began = r.now
    with pytest.raises(RemoteProtocolError, match="65536 bytes came that do not answer it"):
        await r.ask("proximity", within=0.5)
    assert r.now == began  # not at the deadline: nothing is gained by waiting
    assert len(r.session._connection._buffer) < 4096
    assert await r.ask("proximity", within=5) == NEAR


@inside(rig)
async def test_a_resync_among_megabytes_of_noise_keeps_little_of_it(r: Rig) -> None:
    kept = []
    r.session.hooks.append(lambda _, event: kept.append(len(r.session._connection._buffer)))
    r.robot.next_answer(b"N")
    r.robot.next_answer(b"V", *[bytes(range(1, 256)) * 64 for _ in range(128)], VERSIONS["btcom-1.1.3"])
    await r.lose("proximity")
    assert await r.ask("proximity", within=5) == NEAR
    assert max(kept) < 4096


@inside(rig)
async def test_a_hook_that_calls_does_not_get_ahead_of_those_that_wait(r: Rig) -> None:
    late: list[Call[object]] = []

    def hook(_: float, event: object) -> None:
        if isinstance(event, Ended) and not late:
            late.append(r.session.submit(r.request("selector"), 1.0))

    r.session.hooks.append(hook)
    await asyncio.gather(r.ask("proximity"), r.ask("encoders"))
    await late[0].future
    assert r.robot.lines == [b"N", b"Q", b"C"]


@inside(rig)
async def test_a_line_without_end_is_dropped(r: Rig) -> None:
    r.robot.next_answer(b"N", *[b"n,1,2," * 1000 for _ in range(8)], b"\r\nn,1,2,3,4,5,6,7,8\r\n")
    assert await r.ask("proximity", within=0.5) == NEAR


@inside(rig)
async def test_an_unexpected_greeting_is_an_event(r: Rig) -> None:
    seen: list[object] = []
    r.session.hooks.append(lambda time, event: seen.append(event))
    await r.link.write(b"\x0c\x07WELCOME to the SerCom pro")
    await r.link.write(b'tocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n')
    await asyncio.sleep(0.1)
    assert seen.count(Greeted()) == 1
    assert await r.ask("proximity") == NEAR


HELLO = b'\x0c\x07WELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'


@pytest.mark.parametrize(
    "pieces",
    [(b"", HELLO), (HELLO[:20], HELLO[20:]), (HELLO + b"n,1", b"")],
    ids=["behind a probe", "cut by the end of a call", "before that"],
)
@inside(rig)
async def test_a_greeting_among_lost_answers_is_seen_once(r: Rig, pieces: tuple[bytes, bytes]) -> None:
    seen: list[object] = []
    r.session.hooks.append(lambda time, event: seen.append(event))
    r.robot.next_answer(b"N", pieces[0])
    r.robot.next_answer(b"V", pieces[1])  # the answer to the probe is lost too: another one is asked
    await r.lose("proximity")
    assert await r.ask("proximity") == NEAR
    assert seen.count(Greeted()) == 1


@pytest.mark.parametrize("firmware", VERSIONS)
@simulated
async def test_a_reset_that_cuts_a_request_is_no_refusal(firmware: str) -> None:
    async with rig(firmware) as r:
        r.robot.next_answer(b"D", HELLO, b"z,Command not found\r\n")
        with pytest.raises(ReplyTimeout, match="the robot was reset meanwhile"):
            await r.ask("set_speed", 0.1, 0.1)
        assert await r.ask("proximity") == NEAR


@pytest.mark.parametrize(
    ("name", "args", "letter", "parts"),
    [
        ("proximity", (), b"N", [HELLO]),
        ("proximity", (), b"N", [HELLO[:20], 0.01, HELLO[20:50], 0.01, HELLO[50:]]),
        ("proximity", (), b"N", [b"n,1,2,3", 1.4, HELLO]),
        ("stop", (), b"S", [b"Selector pos 3\r\n", 0.3, HELLO]),
        ("play_sound", (1,), b"T", [HELLO]),
        ("attitude", (), b"\xbf", [b"\x01\x02", b"Selector pos 3\r\n" + HELLO]),
        ("image", (), b"\xb7", [bytes([0, 40, 40]) + bytes(1590), HELLO]),
        ("image", (), b"\xb7", [HELLO]),
    ],
)
@pytest.mark.parametrize("is_asked_again", [False, True])
@inside(rig, "asercom-1.2.2")
async def test_a_call_whose_answer_a_restart_lost_ends_as_soon_as_the_robot_answers_a_question_behind_it(
    r: Rig, name: str, args: tuple[object, ...], letter: bytes, parts: list[bytes | float], is_asked_again: bool
) -> None:
    if is_asked_again:
        r.robot.next_answer(b"V")
    r.robot.next_answer(letter, *parts)
    began = r.now
    with pytest.raises(ReplyTimeout, match=r"was not answered: the robot was reset meanwhile"):
        await r.ask(name, *args, within=60)
    assert r.now - began < 3
    assert await r.ask("proximity") == NEAR


@pytest.mark.parametrize("firmware", VERSIONS)
@pytest.mark.parametrize("late", [0.0, 0.02, 0.05, 1.0, 4.0])
@simulated
async def test_a_call_is_not_ended_by_a_greeting_while_its_answer_still_comes(firmware: str, late: float) -> None:
    async with rig(firmware) as r:
        r.robot.next_answer(b"N", HELLO, late, b"n,1,2,3,4,5,6,7,8\r\n")
        assert await r.ask("proximity", within=10) == NEAR
        assert await r.ask("selector") is not None


@inside(rig)
async def test_trace_hooks_see_calls_resyncs_and_outcomes(r: Rig) -> None:
    seen: list[object] = []
    r.session.hooks.append(lambda time, event: seen.append(event))
    r.robot.next_answer(b"N")
    await r.lose("proximity")
    await r.ask("selector")
    kinds = [type(event) for event in seen if isinstance(event, (Called, Ended, Resynced))]
    assert kinds == [Called, Ended, Called, Resynced, Ended]


@inside(rig)
async def test_a_trace_hook_that_raises_disturbs_nothing(r: Rig) -> None:
    reports: list[dict[str, object]] = []
    asyncio.get_running_loop().set_exception_handler(lambda loop, context: reports.append(context))

    def hook(time: float, event: object) -> None:
        raise RuntimeError("hook")

    r.session.hooks.append(hook)
    assert await r.ask("proximity") == NEAR
    assert len(reports) == 1
    assert not any(r.session.hooks.values())


@inside(rig, delay=0.2)
async def test_several_robots_share_one_loop(a: Rig) -> None:
    async with rig("epuck2", delay=0.2) as b:
        began = a.now
        await asyncio.gather(a.ask("proximity"), b.ask("proximity"))
        assert a.now - began == pytest.approx(0.2)


@simulated
async def test_an_opening_that_asked_twice_never_shifts_the_answers_by_one() -> None:
    def slow_start(robot: FakeRobot) -> None:
        version = VERSIONS["btcom-1.1.3"]
        robot.next_answer(b"V", 1.2, version)  # later than the first attempt waits
        robot.next_answer(b"V", 0.5, version)  # nobody waits for this one any more
        robot.next_answer(b"N", 0.1, b"n,1,1,1,1,1,1,1,1\r\n")
        robot.next_answer(b"N", 0.1, b"n,2,2,2,2,2,2,2,2\r\n")

    async with rig(prepare=slow_start) as r:
        await r.lose("proximity", within=0.3)
        # It never left: the line was resynchronised first. So this is the robot's first answer, and its own.
        assert await r.ask("proximity", within=2.0) == Proximity(*[1] * 8)
        await r.ask("encoders")
        assert r.robot.lines.count(b"N") == 1


def speak_noisily(robot: FakeRobot) -> None:
    robot.answers.update({letter: [robot_answer + b"aaaaaaaa"] for letter, robot_answer in PROBE_ANSWERS.items()})


@inside(rig, delay=0.001)
async def test_a_short_flood_of_noise_does_not_end_the_session(r: Rig) -> None:
    speak_noisily(r.robot)
    await r.link.write(b"aaaaaaaa")
    asyncio.get_running_loop().call_later(0.06, r.robot.answers.clear)
    assert await r.ask("proximity", within=2.0) == NEAR


@inside(rig, delay=0.001)
async def test_a_line_that_never_becomes_quiet_is_lost_in_bounded_time(r: Rig) -> None:
    speak_noisily(r.robot)
    await r.link.write(b"aaaaaaaa")
    began = r.now
    with pytest.raises(LinkLost, match="never becomes quiet"):
        await r.ask("proximity", within=20.0)
    assert r.now - began < 10
