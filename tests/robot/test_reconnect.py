"""A robot whose link is cut, whose battery is pulled, and that comes back."""

import asyncio
import contextlib
import logging
import random
from collections.abc import AsyncIterator
from dataclasses import dataclass, field

import pytest

import elib
from elib.base.errors import ArgumentError, LinkClosed, LinkError, LinkLost, LinkNotFound, ReplyTimeout
from elib.link.protocol.commands import SPECS
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.table import Request
from elib.link.protocol.values import CameraSettings, Steps
from elib.link.session import Disconnected, Ending, Greeted, Reconnected, ResetNoticed, Session, TraceEvent, Wrote
from elib.link.transport.memory import MemoryTransport, memory_pair
from elib.robot.events import LateAnswerDetector
from elib.robot.reconnect import Policy, Reconnector
from elib.simulator.emulator.emulator import Emulator
from elib.simulator.emulator.faults import Fault
from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.link import Link
from elib.testing import simulated
from lanes import short
from shared import inside, until


@dataclass
class RadioLink:
    """The radio link to one robot: a test can cut it, and bring it back."""

    firmware: str
    robot: Emulator = field(init=False)
    hardware: FixedHardware = field(init=False)
    link: Link | None = None
    latency: float = 0.005
    is_clear: bool = True
    opened: int = 0
    attempts: int = 0
    events: list[TraceEvent] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.hardware = FixedHardware(firmware=self.firmware)
        self.robot = Emulator(self.firmware, self.hardware, booted=True)

    async def start(self) -> Session:
        self.attempts += 1
        if not self.is_clear:
            raise LinkNotFound("the robot is out of range")
        near, far = memory_pair()
        self.end: MemoryTransport = far
        if self.link is None:
            self.link = Link(self.robot, latency=self.latency, origin=0.0)
        self.link.attach(far)
        self.opened += 1
        return await Session.open(near)

    def cut(self) -> None:
        assert self.link is not None
        self.is_clear = False
        self.link.detach()
        self.end.abort()

    def pull_battery(self) -> None:
        self.robot.power_cycle(asyncio.get_running_loop().time())
        assert self.link is not None
        self.link.catch_up()

    def press_reset(self) -> None:
        self.robot.press_reset(asyncio.get_running_loop().time())
        assert self.link is not None
        self.link.catch_up()

    def seen(self, kind: type) -> list[TraceEvent]:
        return [event for event in self.events if isinstance(event, kind)]


@dataclass
class Rig:
    radio: RadioLink
    channel: Reconnector

    def request(self, name: str, *args: object) -> Request[object]:
        return SPECS[name].request(self.channel.context, *args)

    async def ask(self, name: str, *args: object, within: float = 1.0) -> object:
        return await self.channel.execute(self.request(name, *args), within)

    @property
    def now(self) -> float:
        return asyncio.get_running_loop().time()


@contextlib.asynccontextmanager
async def rig(
    firmware: str = "asercom-1.2.2",
    policy: Policy = Policy(),  # noqa: B008  # frozen
    latency: float = 0.005,
) -> AsyncIterator[Rig]:
    radio = RadioLink(firmware, latency=latency)
    channel = await Reconnector("test://radio", radio.start, policy).open()
    channel.hooks.append(lambda time, event: radio.events.append(event))
    try:
        yield Rig(radio, channel)
    finally:
        await channel.close()
        if radio.link is not None:
            radio.link.close()


@inside(rig)
async def test_a_call_in_the_gap_waits_for_the_link_and_is_answered(r: Rig) -> None:
    r.radio.cut()
    asyncio.get_running_loop().call_later(1.0, setattr, r.radio, "is_clear", True)
    assert await r.ask("selector", within=5) is not None
    assert r.radio.opened == 2
    (back,) = r.radio.seen(Reconnected)
    assert isinstance(back, Reconnected)
    assert back.gap == pytest.approx(2.0, abs=1.0)
    assert len(r.radio.seen(Disconnected)) == 1


@inside(rig)
async def test_a_call_in_the_gap_keeps_its_own_deadline_and_is_counted_as_never_sent(r: Rig) -> None:
    counter = r.channel._session.counter
    r.radio.cut()
    began = r.now
    with pytest.raises(ReplyTimeout, match="never sent"):
        await r.ask("selector", within=0.5)
    assert r.now - began == pytest.approx(0.5)
    assert counter.read(r.now).unsent == 1


@inside(rig, policy=Policy(during_gap="fail"))
async def test_calls_in_the_gap_fail_at_once_if_asked(r: Rig) -> None:
    r.radio.cut()
    began = r.now
    with pytest.raises(LinkLost, match="being opened again"):
        await r.ask("selector", within=5)
    assert r.now == began
    r.radio.is_clear = True
    await asyncio.sleep(3)
    assert await r.ask("selector") is not None


@inside(rig)
async def test_a_setter_on_its_way_when_the_link_breaks_fails_and_is_not_repeated(r: Rig) -> None:
    call = asyncio.ensure_future(r.ask("set_speed", 0.5, 0.5, within=5))
    await asyncio.sleep(0.001)
    r.radio.cut()
    r.radio.is_clear = True
    with pytest.raises(LinkLost):
        await call
    await asyncio.sleep(3)
    assert r.radio.hardware.rates == (0, 0)


@inside(rig)
async def test_a_reading_on_its_way_when_the_link_breaks_is_made_again(r: Rig) -> None:
    call = asyncio.ensure_future(r.ask("selector", within=5))
    await asyncio.sleep(0.001)
    r.radio.cut()
    r.radio.is_clear = True
    assert await call is not None


@inside(rig, "epuck2")
async def test_camera_lamps_and_colours_are_restored_and_the_wheels_stand(r: Rig) -> None:
    await r.ask("set_camera", 30, 20, 4, "grey")
    await r.ask("set_led", 2, 1)
    await r.ask("set_body_led", 1)
    await r.ask("set_rgb_led", 3, 0.5, 0, 1)
    await r.ask("set_speed", 0.5, 0.5)
    r.radio.cut()
    r.radio.pull_battery()
    await asyncio.sleep(6)
    r.radio.is_clear = True
    assert (await r.ask("camera", within=10))[:4] == (0, 30, 20, 4)  # type: ignore[index]
    lights = r.radio.hardware.lights
    assert (lights.ring[2], lights.body, lights.rgb[3:6]) == (1, 1, [50, 0, 100])
    assert r.radio.hardware.rates == (0, 0)


@inside(rig, policy=Policy(keep_speed=True))
async def test_the_wheels_turn_on_after_a_gap_if_asked(r: Rig) -> None:
    await r.ask("set_speed", 0.5, 0.25)
    r.radio.cut()
    r.radio.pull_battery()
    await asyncio.sleep(4)
    r.radio.is_clear = True
    assert await r.ask("speed", within=10) == (0.5, 0.25)
    assert r.radio.hardware.rates[0] > 400


@pytest.mark.parametrize("stop", [("stop",), ("set_speed", 0, 0)], ids=["stop", "speed"])
@inside(rig, policy=Policy(keep_speed=True))
async def test_a_stop_that_ended_in_a_gap_holds_after_it(r: Rig, stop: tuple[str, int]) -> None:
    await r.ask("set_speed", 0.5, 0.25)
    r.radio.cut()
    await asyncio.sleep(0)
    with pytest.raises(ReplyTimeout):
        await r.ask(*stop, within=0.5)
    r.radio.is_clear = True
    assert await r.ask("speed", within=10) == (0, 0)
    await asyncio.sleep(1)
    assert r.radio.hardware.rates == (0, 0)


@inside(rig, policy=Policy(keep_speed=True))
async def test_after_a_motion_that_was_given_up_before_a_loss_was_noticed_the_wheels_stand(r: Rig) -> None:
    await r.ask("set_speed", 0.5, 0.25)
    r.channel.forget_speed()  # as a motion does that is given up, while the link still seems to be there
    r.radio.cut()
    await asyncio.sleep(1)
    r.radio.is_clear = True
    assert await r.ask("speed", within=10) == (0, 0)


@inside(rig, policy=Policy(give_up_after=20))
async def test_a_setting_of_another_program_that_elib_does_not_make_keeps_no_robot_away(
    r: Rig, caplog: pytest.LogCaptureFixture
) -> None:
    r.channel.context.last_set.camera = CameraSettings(2, 80, 40, 8, 6400)  # as `camera()` tells it
    r.radio.cut()
    await asyncio.sleep(1)
    r.radio.is_clear = True
    assert await r.ask("selector", within=10) is not None
    assert "set_camera() is not restored: " in caplog.text


@inside(rig, policy=Policy(give_up_after=20))
async def test_a_defect_while_a_link_is_opened_again_ends_the_robot_instead_of_holding_it_for_ever(
    r: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def defect() -> Session:
        raise ZeroDivisionError("oops")

    faults: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: faults.append(context["exception"]))
    monkeypatch.setattr(r.channel, "_start", defect)
    r.radio.cut()
    with pytest.raises(LinkLost, match="could not be opened again: ZeroDivisionError"):
        await r.ask("selector", within=10)


@inside(rig)
async def test_step_counters_go_on_where_they_stood_when_the_battery_was_pulled(r: Rig) -> None:
    await r.ask("set_speed", 0.5, 0.5)
    await asyncio.sleep(2)
    await r.ask("stop")
    before = await r.ask("encoders")
    assert isinstance(before, Steps)
    assert before.left > 900
    r.radio.cut()
    r.radio.pull_battery()
    await asyncio.sleep(6)
    r.radio.is_clear = True
    assert await r.ask("encoders", within=10) == before
    assert [event.sign for event in r.radio.seen(ResetNoticed)] == ["encoders"]  # type: ignore[attr-defined]


@inside(rig)
async def test_step_counters_of_a_robot_that_drove_on_in_the_gap_are_left_alone(r: Rig) -> None:
    await r.ask("set_encoders", 5000, 5000)
    await r.ask("encoders")
    await r.ask("set_speed", 0.1, 0.1)
    r.radio.cut()
    await asyncio.sleep(3)
    r.radio.is_clear = True
    after = await r.ask("encoders", within=10)
    assert isinstance(after, Steps)
    assert 5300 < after.left < 5800
    assert r.radio.seen(ResetNoticed) == []


@inside(rig)
async def test_an_unexpected_greeting_is_reported_and_what_was_set_is_restored(r: Rig) -> None:
    await r.ask("set_led", 5, 1)
    await r.ask("set_front_led", 1)
    r.radio.pull_battery()
    await asyncio.sleep(6)
    assert [event.sign for event in r.radio.seen(ResetNoticed)] == ["greeting"]  # type: ignore[attr-defined]
    assert (r.radio.hardware.lights.ring[5], r.radio.hardware.lights.front) == (1, 1)
    assert r.radio.opened == 1


@inside(rig)
async def test_counters_that_fall_back_to_0_show_a_reset_without_a_greeting(r: Rig) -> None:
    await r.ask("set_encoders", 20000, -20000)
    await r.ask("encoders")
    await asyncio.sleep(0.1)
    for motor in r.radio.robot.firmware.motors:
        motor.steps = 0
    await r.ask("encoders")
    await asyncio.sleep(1)
    assert [event.sign for event in r.radio.seen(ResetNoticed)] == ["encoders"]  # type: ignore[attr-defined]
    assert await r.ask("encoders") == (20000, -20000)


# -- a restart while the link holds --


async def set_all(r: Rig) -> None:
    await r.ask("set_camera", 20, 20, 8, "grey", within=3)
    await r.ask("set_body_led", 1)
    await r.ask("set_encoders", 5000, 5000)
    await r.ask("encoders")


async def assert_all_is_set(r: Rig, counters: tuple[int, int] = (5000, 5000), body: int = 1) -> None:
    assert (await r.ask("camera", within=60))[:4] == (0, 20, 20, 8)  # type: ignore[index]
    assert await r.ask("encoders", within=60) == counters
    assert r.radio.hardware.lights.body == body


@pytest.mark.parametrize("firmware", sorted(PROFILES))
@simulated
async def test_a_reading_that_a_restart_lost_is_made_again_when_all_is_restored(firmware: str) -> None:
    async with rig(firmware) as r:
        await set_all(r)
        call = asyncio.ensure_future(r.ask("camera", within=5))
        await asyncio.sleep(0.0055)  # the robot has it, or a part of it, and the answer has not left it
        r.radio.press_reset()
        assert (await call)[:4] == (0, 20, 20, 8)  # type: ignore[index]
        assert len(r.radio.seen(Greeted)) == 1
        await assert_all_is_set(r)
        assert r.radio.opened == 1


@pytest.mark.parametrize("firmware", sorted(PROFILES))
@simulated
async def test_a_call_that_acts_and_that_a_restart_lost_ends_with_the_greeting(firmware: str) -> None:
    async with rig(firmware) as r:
        await set_all(r)
        call = asyncio.ensure_future(r.ask("set_speed", 0.5, 0.5, within=60))
        await asyncio.sleep(0.0055)  # the robot has it, or a part of it, and the answer has not left it
        r.radio.press_reset()
        greeted: list[float] = []
        r.channel.hooks.append(lambda time, event: greeted.append(time) if isinstance(event, Greeted) else None)
        with pytest.raises(ReplyTimeout, match=r"not answered: the robot was reset meanwhile") as error:
            await call
        assert "60 s" not in str(error.value)
        assert r.now - greeted[0] < 0.1
        await assert_all_is_set(r)
        assert r.radio.hardware.rates == (0, 0)


@pytest.mark.parametrize("firmware", sorted(PROFILES))
@pytest.mark.parametrize("draws", short([25, 400], 25))
def test_a_restart_at_any_moment_loses_nothing_that_was_set_and_no_answer(firmware: str, draws: int) -> None:
    calls: list[tuple[str, tuple[object, ...]]] = [
        ("proximity", ()),
        ("encoders", ()),
        ("image", ()),
        ("help_text", ()),
        ("distance" if firmware == "epuck2" else "attitude", ()),
        ("stop", ()),
        ("set_speed", (0.1, 0.1)),
        ("set_front_led", (1,)),
        ("set_body_led", (0,)),
        ("calibrate_proximity", ()),
    ]
    if firmware != "btcom-1.1.3":  # what waits in its ring while it starts may be garbled
        calls.append(("set_encoders", (700, -700)))

    @simulated
    async def story(draw: random.Random) -> None:
        (name, args), within = draw.choice(calls), draw.choice([0.5, 1.0, 2.0, 5.0, 10.0])
        what = f"{name}{args} within {within} s"
        async with rig(firmware, latency=draw.choice([0.0, 0.005, 0.03])) as r:
            await set_all(r)
            late: list[object] = []
            greeted: list[float] = []
            detector = LateAnswerDetector()

            def hook(time: float, event: TraceEvent) -> None:
                late.extend(filter(None, [detector.observe(event)]))
                if isinstance(event, Greeted):
                    greeted.append(time)

            r.channel.hooks.append(hook)
            restart = draw.choice([draw.uniform(0, 3), draw.uniform(2.95, 3.0), draw.uniform(1.6, 2.0)])
            loop = asyncio.get_running_loop()
            loop.call_later(restart, r.radio.press_reset)
            if draw.random() < 0.25:
                loop.call_later(restart + draw.uniform(0.5, 4), r.radio.press_reset)
            await asyncio.sleep(2.99)
            error, end = None, r.now + within
            try:
                await r.ask(name, *args, within=within)
            except ReplyTimeout as timeout:
                error = timeout
            ended = r.now
            await asyncio.sleep(15)
            if error is not None and r.request(name, *args).only_reads:
                assert end < greeted[-1] + 1.5, f"{what} had the time to be asked again"
            elif error is not None and ended < end:
                assert not late, f"{what} was ended, but its answer came"
                assert ended <= max(time for time in greeted if time <= ended) + 0.1, what
            counters, body = (5000, 5000), 1
            if name in ("set_speed", "set_encoders"):
                await r.ask("stop")
                counters = await r.ask("encoders")  # type: ignore[assignment]
                possible = [(700, -700)] if error is None else [(700, -700), (5000, 5000), (5700, 4300)]
                assert counters in possible if name == "set_encoders" else min(counters) >= 5000, what
            elif name == "set_body_led":
                body = 0 if error is None else r.radio.hardware.lights.body
            await assert_all_is_set(r, counters, body)
            assert r.radio.opened == 1, what

    for seed in range(draws):
        story(random.Random(f"{firmware} {seed}"))


@pytest.mark.parametrize("firmware", sorted(PROFILES))
@simulated
async def test_restoring_goes_on_though_answers_are_lost_and_the_robot_restarts_again(firmware: str) -> None:
    async with rig(firmware) as r:
        await set_all(r)
        r.radio.press_reset()
        await until(lambda: r.radio.seen(ResetNoticed))
        assert r.radio.link is not None
        r.radio.link.faults.extend(Fault(lose=each in (0, 3, 5)) for each in range(6))
        await until(lambda: r.radio.hardware.lights.body)
        r.radio.press_reset()
        await until(lambda: len(r.radio.seen(Greeted)) == 2)
        await assert_all_is_set(r)


@pytest.mark.parametrize("firmware", sorted(PROFILES))
@simulated
async def test_what_cannot_be_restored_is_said_and_tried_again_over_a_new_link(
    firmware: str, caplog: pytest.LogCaptureFixture
) -> None:
    async with rig(firmware) as r:
        await set_all(r)
        r.radio.press_reset()
        await until(lambda: r.radio.seen(ResetNoticed))

        def lose_answers(time: float, event: TraceEvent) -> None:
            if isinstance(event, Wrote) and event.data.startswith(b"J,") and r.radio.opened == 1:
                assert r.radio.link is not None
                r.radio.link.faults.append(Fault(lose=True))

        r.channel.hooks.append(lose_answers)
        with caplog.at_level(logging.WARNING, "elib"):
            await assert_all_is_set(r)
        assert r.radio.opened == 2
        (down,) = r.radio.seen(Disconnected)
        assert isinstance(down, Disconnected)
        assert "could not be set again: set_camera(20, 20, 8, 0) " in str(down.error)
        assert "could not be set again" in caplog.text


@inside(rig, policy=Policy(first_delay=0.5, longest_delay=2.0, give_up_after=10.0))
async def test_attempts_back_off_and_end_at_the_bound(r: Rig) -> None:
    r.radio.cut()
    began = r.now
    calls = [asyncio.ensure_future(r.ask("selector", within=60)) for _ in range(3)]
    results = await asyncio.gather(*calls, return_exceptions=True)
    assert [type(result) for result in results] == [LinkLost] * 3
    assert "did not come back within 10 s" in str(results[0])
    assert r.now - began <= 10.0
    # At 0, 0.5, 1.5, 3.5, 5.5, 7.5 and 9.5 s.
    assert r.radio.attempts - 1 == 7
    with pytest.raises(LinkLost):
        await r.ask("selector")
    assert isinstance(r.radio.seen(Ending)[-1].error, LinkLost)  # type: ignore[attr-defined]


@inside(rig, "btcom-2.0", Policy(give_up_after=5))
async def test_another_robot_behind_the_same_address_is_refused(r: Rig) -> None:
    r.radio.cut()
    r.radio.robot = Emulator("epuck2", FixedHardware(firmware="epuck2"), booted=True)
    r.radio.link = None
    r.radio.is_clear = True
    with pytest.raises(LinkLost, match="another robot answers"):
        await r.ask("selector", within=30)


@inside(rig)
async def test_closing_in_the_gap_ends_everything_at_once(r: Rig) -> None:
    r.radio.cut()
    call = asyncio.ensure_future(r.ask("selector", within=60))
    await asyncio.sleep(1)
    began = r.now
    await r.channel.close()
    with pytest.raises(LinkClosed):
        await call
    assert r.now == began
    with pytest.raises(LinkError):
        await r.ask("selector")


@simulated
async def test_many_cuts_leave_no_task_behind() -> None:
    before = len(asyncio.all_tasks())
    async with rig() as r:
        for _ in range(20):
            r.radio.cut()
            await asyncio.sleep(0.3)
            r.radio.is_clear = True
            assert await r.ask("selector", within=10) is not None
        assert r.radio.opened == 21
    await asyncio.sleep(0)
    assert len(asyncio.all_tasks()) == before


# -- the public interface --


def test_a_reconnecting_robot_has_the_blocking_style() -> None:
    with elib.reconnecting("sim://square?speed=max") as robot:
        robot.set_speed(0.25, 0.25)
        assert robot.speed() == (0.25, 0.25)
        assert robot.statistics.count >= 2


@inside(elib.reconnecting, "sim://square?speed=max")
async def test_a_reconnecting_robot_has_the_async_style(robot: elib.Epuck) -> None:
    assert (await robot.selector()).position == 3


def test_a_robot_that_cannot_be_opened_the_first_time_says_why_at_once() -> None:
    with pytest.raises(LinkNotFound), elib.reconnecting("/dev/no-such-port"):
        pass


@pytest.mark.parametrize(
    "wrong", [{"during_gap": "maybe"}, {"first_delay": 0}, {"longest_delay": float("nan")}, {"give_up_after": -1}]
)
def test_an_impossible_policy_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ArgumentError):
        elib.reconnecting("sim://", **wrong)  # type: ignore[arg-type]
