"""Fault scripts: their times, and what they do to a toy robot on a link."""

import asyncio
import math

import pytest
from link_rig import Parrot, Rig, make_rig

from elib.base.errors import LinkLost, SimulationStalled
from elib.simulator.emulator.faultkinds import Counts, Ramp, TimedFault, When
from elib.simulator.emulator.faultplayer import FaultPlayer
from elib.simulator.emulator.faultscript import FaultScript, parse
from elib.testing import simulated
from shared import now


def script(text: str, seed: int = 1) -> FaultScript:
    return parse(f'description = "test"\nseed = {seed}\n{text}'.encode(), "test.toml")


def rough(text: str, *, seed: int = 1, robot: int = 0, parrot: Parrot | None = None) -> tuple[Rig, FaultPlayer]:
    """Return a toy robot under the faults of *text*, which begins with the first byte."""
    rig = make_rig(parrot)
    return rig, FaultPlayer(rig.link, script(text, seed), robot=robot)


# -- times -------------------------------------------------------------------------------------------------------------


def test_a_fault_without_times_always_holds() -> None:
    when = When()
    assert [when.share(time) for time in (0.0, 1.0, 1e9)] == [0.0, 0.0, 0.0]
    assert when.next_change(0.0) == math.inf


def test_a_span_begins_at_its_beginning_and_has_ended_at_its_end() -> None:
    when = When(2.0, 6.0)
    assert [when.share(time) for time in (1.999, 2.0, 3.0, 5.0, 6.0)] == [None, 0.0, 0.25, 0.75, None]
    assert [when.next_change(time) for time in (0.0, 2.0, 6.0)] == [2.0, 6.0, math.inf]


def test_what_comes_again_has_a_beginning_and_an_end_each_time_until_the_last() -> None:
    when = When(1.0, 25.0, every=10.0, lasting=4.0)
    changes, time = [], 0.0
    while math.isfinite(time := when.next_change(time)):
        changes.append((time, when.share(time) is not None))
    assert changes == [(1, True), (5, False), (11, True), (15, False), (21, True), (25, False)]
    assert when.share(13.0) == 0.5


@pytest.mark.parametrize("every", [0.1, 1 / 3, 0.7, 39.61])
@pytest.mark.parametrize("start", [0.0, 0.1])
def test_rounding_swallows_no_beginning_and_makes_none_twice(start: float, every: float) -> None:
    when = When(start, every=every)
    time, seen = -1.0, []
    for _ in range(1000):
        time = when.beginning(time)
        seen.append(time)
    assert seen == [start + count * every for count in range(1000)]
    spell = When(start, every=every, lasting=every / 2)
    assert all(spell.share(begin) == 0.0 for begin in seen)
    assert all(spell.share(math.nextafter(begin, -1.0)) is None for begin in seen)


def test_a_strength_rises_or_falls_over_the_span() -> None:
    fault = TimedFault("loss", When(0, 10), {"probability": Ramp(0.2, 0.6)})
    assert fault.level("probability", 0.5) == pytest.approx(0.4)
    assert TimedFault("noise", strengths={"rate": Ramp(1, 1)}).level("size", 0.0) == 1, "the kind's default"


# -- faults of answers -------------------------------------------------------------------------------------------------


@simulated
async def test_a_script_begins_with_the_first_byte_a_program_sends() -> None:
    rig, player = rough('[[fault]]\nkind = "silence"\nfrom = 2\nuntil = 5')
    await asyncio.sleep(100)
    assert player.time == 0
    assert await rig.ask(b"A\r") == b"a\r\n"
    assert player.time == 1
    await asyncio.sleep(1)
    assert await rig.ask(b"B\r") == b""
    await asyncio.sleep(2)
    assert await rig.ask(b"C\r") == b"c\r\n"
    assert rig.robot.heard == b"A\rB\rC\r"


@simulated
async def test_answers_are_lost_as_often_as_the_script_says_and_counted() -> None:
    rig, player = rough('[[fault]]\nkind = "loss"\nprobability = 0.3')
    answers = [await rig.ask(b"A\r", 0.01) for _ in range(500)]
    assert set(answers) == {b"", b"a\r\n"}
    assert player.counts == Counts(answers=500, lost=answers.count(b""))
    assert answers.count(b"") == pytest.approx(150, abs=35)


@simulated
async def test_loss_that_rises_spares_the_first_answers_and_takes_the_last() -> None:
    rig, _ = rough('[[fault]]\nkind = "loss"\nuntil = 10\nprobability = [0, 1]')
    answers = [await rig.ask(b"A\r", 0.01) for _ in range(1000)]
    came = [sum(map(bool, answers[start : start + 100])) for start in range(0, 1000, 100)]
    assert came[0] > 85
    assert came[-1] < 15
    assert 400 < sum(came) < 600
    await asyncio.sleep(1)
    assert await rig.ask(b"A\r") == b"a\r\n", "it is over"


@simulated
async def test_an_answer_can_come_late_and_changed_and_twice_at_once() -> None:
    rig, player = rough(
        '[[fault]]\nkind = "delay"\ndelay = 0.5\n[[fault]]\nkind = "corrupt"\nprobability = 1\n'
        '[[fault]]\nkind = "duplicate"\nprobability = 1\nafter = 0.25'
    )
    await rig.host.write(b"ABC\r")
    first = await rig.host.read()
    assert now() == 0.5
    assert await rig.host.read() == first
    assert now() == 0.75
    assert sum(a != b for a, b in zip(first, b"abc\r\n", strict=True)) == 1
    assert player.counts == Counts(answers=1, corrupted=1, duplicated=1, delayed=1)


@simulated
async def test_of_a_halved_answer_the_first_half_comes_and_nothing_is_left_for_the_next() -> None:
    rig, player = rough('[[fault]]\nkind = "halve"\nuntil = 2\nprobability = 1')
    assert await rig.ask(b"ABCDEF\r", 3) == b"abcd"
    assert await rig.ask(b"ABCDEF\r") == b"abcdef\r\n"
    assert player.counts == Counts(answers=2, halved=1)


@simulated
async def test_the_delay_of_an_answer_varies_about_its_mean_and_never_reorders() -> None:
    rig, _ = rough('[[fault]]\nkind = "delay"\ndelay = 0.2\njitter = 0.05')
    trips = []
    for _ in range(200):
        start = now()
        await rig.host.write(b"A\r")
        assert await rig.host.read() == b"a\r\n"
        trips.append(now() - start)
    mean = sum(trips) / 200
    assert mean == pytest.approx(0.2, abs=0.02)
    assert math.sqrt(sum((trip - mean) ** 2 for trip in trips) / 200) == pytest.approx(0.05, rel=0.3)


@simulated
async def test_a_fault_ordered_by_a_test_goes_before_the_script() -> None:
    rig, player = rough('[[fault]]\nkind = "loss"\nprobability = 1')
    rig.link.halve_next_reply()
    assert await rig.ask(b"ABCD\r") == b"abc"
    assert await rig.ask(b"ABCD\r") == b""
    assert player.counts == Counts(answers=1, lost=1)


@simulated
async def test_a_player_that_is_closed_lets_nothing_happen_any_more() -> None:
    rig, player = rough('[[fault]]\nkind = "loss"\nprobability = 1\n[[fault]]\nkind = "cut"\nat = 5')
    assert await rig.ask(b"A\r") == b""
    player.close()
    assert await rig.ask(b"A\r", 10) == b"a\r\n"
    assert rig.link.is_connected


def test_the_same_seed_gives_the_same_faults_and_each_robot_has_its_own() -> None:
    @simulated
    async def run(seed: int, robot: int = 0) -> list[bytes]:
        rig, _ = rough(
            '[[fault]]\nkind = "loss"\nprobability = 0.5\n[[fault]]\nkind = "noise"\nrate = 5', seed=seed, robot=robot
        )
        return [await rig.ask(b"ABCDEF\r", 0.2) for _ in range(50)]

    first = run(7)
    assert run(7) == first
    assert run(8) != first
    assert run(7, robot=1) != first


def test_a_fault_that_is_added_does_not_change_what_the_others_do() -> None:
    @simulated
    async def lost(text: str) -> list[bool]:
        rig, _ = rough('[[fault]]\nkind = "loss"\nprobability = 0.5\n' + text)
        return [await rig.ask(b"A\r", 0.2) == b"" for _ in range(50)]

    assert lost("") == lost('[[fault]]\nkind = "duplicate"\nprobability = 0.5')


# -- what happens by itself --------------------------------------------------------------------------------------------


@simulated
async def test_a_stall_holds_everything_back_and_then_lets_all_come_at_once() -> None:
    rig, player = rough('[[fault]]\nkind = "stall"\nfrom = 1\nevery = 10\nfor = 3')
    assert await rig.ask(b"A\r", 1.5) == b"a\r\n"
    assert not player.is_reachable
    await rig.host.write(b"B\r")
    await rig.host.write(b"C\r")
    assert await rig.host.read() == b"b\r\nc\r\n"
    assert now() == 4
    assert player.is_reachable
    await asyncio.sleep(8)
    assert (now(), player.counts.stalls) == (12, 2)


@pytest.mark.parametrize("origin", [0.1, 1e3 / 3, 1e6 / 7])
@simulated
async def test_what_is_due_happens_at_its_time_whenever_the_script_began(origin: float) -> None:
    await asyncio.sleep(origin)
    rig, player = rough('[[fault]]\nkind = "stall"\nfrom = 0.7\nevery = 0.7\nfor = 0.3')
    plays = 0
    play = player._play

    def counted(time: float) -> None:
        nonlocal plays
        plays += 1
        assert plays < 1000, "the player wakes up again and again without end"
        play(time)

    player._play = counted  # type: ignore[method-assign]
    await rig.ask(b"A\r", 69.9)
    assert player.counts.stalls == 99
    assert plays == pytest.approx(199, abs=1)


@simulated
async def test_noise_comes_at_its_rate_while_it_lasts() -> None:
    rig, player = rough('[[fault]]\nkind = "noise"\nfrom = 10\nuntil = 110\nrate = 2\nsize = 5')
    assert await rig.ask(b"A\r", 10) == b"a\r\n"
    noise = await rig.listen(100)
    assert len(noise) % 5 == 0
    assert len(noise) == pytest.approx(1000, rel=0.2)
    assert await rig.listen(100) == b""
    assert player.counts == Counts(answers=1, noise=len(noise))


@simulated
async def test_a_cut_kills_the_link_and_the_robot_goes_on() -> None:
    rig, player = rough('[[fault]]\nkind = "cut"\nat = 2\nfor = 5', parrot=Parrot(service=3))
    seen: list[tuple[float, str]] = []
    rig.link.on_down = lambda: seen.append((now(), "cut"))
    rig.link.on_up = lambda: seen.append((now(), "mended"))
    await rig.host.write(b"A\r")
    with pytest.raises(LinkLost):
        await rig.host.read()
    assert (player.is_cut, player.mends_in, player.counts.cuts) == (True, 5.0, 1)
    await asyncio.sleep(5)
    assert (player.is_cut, player.mends_in) == (False, 0.0)
    assert seen == [(2.0, "cut"), (7.0, "mended")]
    assert rig.robot.is_idle, "it answered, and nobody heard it"


@simulated
async def test_cuts_that_follow_each_other_without_a_gap_are_waited_for_together() -> None:
    rig, player = rough(
        '[[fault]]\nkind = "cut"\nfrom = 1\nuntil = 4\n[[fault]]\nkind = "cut"\nat = 3\nfor = 6\n'
        '[[fault]]\nkind = "cut"\nat = 20'
    )
    await rig.ask(b"A\r", 0.5)
    await asyncio.sleep(1)
    assert player.mends_in == pytest.approx(7.5)
    assert player.counts.cuts == 1
    await asyncio.sleep(20)
    assert player.mends_in == math.inf
    assert player.cuts


@simulated
async def test_cuts_that_follow_each_other_for_ever_are_permanent() -> None:
    rig, player = rough("".join(f'[[fault]]\nkind = "cut"\nfrom = {begin}\nevery = 2\nfor = 1.5\n' for begin in (1, 2)))
    with pytest.raises(LinkLost):
        await rig.ask(b"A\r", 1.25)
    assert player.mends_in == math.inf


@simulated
async def test_a_script_that_begins_with_a_cut_does_not_let_even_the_first_byte_through() -> None:
    rig, player = rough('[[fault]]\nkind = "cut"\nfor = 1')
    with pytest.raises(LinkLost):
        await rig.ask(b"A\r")
    assert rig.robot.heard == b""
    assert player.is_cut


@simulated
async def test_a_robot_counts_as_given_up_once_its_answers_stay_away() -> None:
    rig, player = rough('[[fault]]\nkind = "loss"\nuntil = 5\nprobability = 1')
    reachable = []
    for _ in range(7):
        reachable.append(player.is_reachable)
        await rig.ask(b"A\r", 1)
    assert reachable == [True, True, True, False, False, False, True]


def test_a_program_that_waits_for_nothing_is_told_so_although_the_script_never_ends() -> None:
    @simulated
    async def story() -> None:
        rig, _ = rough('[[fault]]\nkind = "stall"\nfrom = 10\nevery = 10\nfor = 1')
        await rig.ask(b"A\r")
        await asyncio.Event().wait()

    with pytest.raises(SimulationStalled):
        story()


@simulated
async def test_after_a_long_pause_the_script_is_where_it_would_have_been() -> None:
    rig, player = rough('[[fault]]\nkind = "silence"\nfrom = 10\nevery = 100\nfor = 50')
    await rig.ask(b"A\r")
    await asyncio.sleep(100_000)
    assert player.counts.silences < 50, "nobody was there"
    await asyncio.sleep(35)
    assert await rig.ask(b"B\r", 30) == b""
    assert await rig.ask(b"C\r", 30) == b"c\r\n"
