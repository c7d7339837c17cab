"""``elib.swarm()``: several robots opened, told and closed together."""

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest

import elib
from elib.base.errors import ArgumentError, LinkBusy, LinkClosed, LinkLost, LinkNotFound, ReplyTimeout, Unsupported
from elib.link.protocol.table import Request
from elib.link.session import Called, Wrote
from elib.link.transport import parse_url
from elib.robot.swarms.swarm import OPENING_AT_ONCE, default_names
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from elib.testing import faults_of, simulated
from elib.testing.inside import transport_of
from shared import inside, now, run_python, until

THREE = "sim://square?speed=max&robots=3"


def wheels(robots: elib.Swarm) -> Callable[[], list[list[float]]]:
    """Return a function that tells the speeds of all motors, open or closed, steps/s."""
    firmwares = [transport_of(robot).robot.emulator.firmware for robot in robots]
    return lambda: [[motor.speed for motor in firmware.motors] for firmware in firmwares]


STANDING = [[0, 0]] * 3


# -- opening -----------------------------------------------------------------------------------------------------------


@inside(elib.swarm, THREE)
async def test_every_robot_of_a_world_is_opened_with_a_link_statistics_and_name_of_its_own(robots: elib.Swarm) -> None:
    assert robots.names == ("epuck-1", "epuck-2", "epuck-3")
    assert len({transport_of(robot).simulation for robot in robots}) == 1
    assert len({transport_of(robot).robot.index for robot in robots}) == len({id(r.session) for r in robots}) == 3
    await robots[1].selector()
    await robots["epuck-2"].selector()
    assert [robot.statistics.count for robot in robots] == [0, 2, 0]
    assert [robot.name for robot in robots] == list(robots.names)


@inside(elib.swarm, "sim://crowd")
async def test_a_world_of_the_gallery_is_opened_with_as_many_robots_as_it_names(robots: elib.Swarm) -> None:
    assert len(robots) == 20
    assert (await robots.all.selector())["epuck-20"].position == 3


@inside(elib.swarm, THREE)
async def test_robots_are_found_by_place_by_name_and_in_parts(robots: elib.Swarm) -> None:
    assert robots["epuck-3"] is robots[2] is robots[-1]
    assert list(robots) == [robots[0], robots[1], robots[2]]
    assert robots[1:].names == ("epuck-2", "epuck-3")
    assert robots.only("epuck-3", 0).names == ("epuck-3", "epuck-1")
    assert "epuck-2" in robots
    assert robots[0] in robots
    assert "epuck-4" not in robots
    assert repr(robots) == "<Swarm of epuck-1, epuck-2, epuck-3>"
    assert repr(robots[:1].all) == "<AllRobots of epuck-1>"
    with pytest.raises(ArgumentError, match=r"there is no robot 'epuck-4'\nhint: there are epuck-1, epuck-2"):
        robots["epuck-4"]
    with pytest.raises(IndexError, match="there is no robot 3: there are 3, counted from 0"):
        robots[3]
    with pytest.raises(ArgumentError, match="twice"):
        robots.only(0, "epuck-1")


@simulated
async def test_several_urls_are_opened_each_and_a_world_among_them_with_all_its_robots() -> None:
    urls = ["sim://square", "sim://square", "sim://arena?robots=2&firmware=epuck2"]
    async with elib.swarm(urls) as robots:
        assert robots.names == ("epuck-1", "epuck-2", "epuck-3", "epuck-4")
        worlds = [transport_of(robot).simulation for robot in robots]
        assert worlds[0] is not worlds[1] is not worlds[2] is worlds[3]
        assert [robot.firmware for robot in robots] == ["asercom-1.2.2"] * 2 + ["epuck2"] * 2


@pytest.mark.parametrize(
    ("urls", "names"),
    [
        (["serial:///dev/rfcomm0", "rfcomm1", "COM3"], ["rfcomm0", "rfcomm1", "COM3"]),
        (["tcp://127.0.0.1:4000", "rfcomm://10:00:E8:6C:A2:B6"], ["127.0.0.1:4000", "10:00:E8:6C:A2:B6"]),
        (["serial:///a/robot", "serial:///b/robot"], ["serial:///a/robot", "serial:///b/robot"]),
        (["sim://?robots=9&robot=4", "sim://?robots=9&robot=2"], ["epuck-4", "epuck-2"]),
        (["sim://?robots=9&robot=4", "sim://?robots=8&robot=4"], ["epuck-1", "epuck-2"]),
        (["sim://", "serial:///dev/rfcomm0", "sim://"], ["epuck-1", "rfcomm0", "epuck-2"]),
    ],
)
def test_a_robot_is_called_by_its_port_or_by_its_number_in_the_world(urls: list[str], names: list[str]) -> None:
    assert list(default_names([parse_url(url) for url in urls])) == names


def test_names_can_be_given_and_must_be_as_many_as_the_robots_and_different() -> None:
    @simulated
    async def story() -> None:
        async with elib.swarm(THREE, names=["ann", "bob", "cid"]) as robots:
            assert set(await robots.all.speed()) == {"ann", "bob", "cid"}
        with pytest.raises(ArgumentError, match="there are 2 names for 3 robots"):
            await elib.swarm(THREE, names=["ann", "bob"])

    story()
    with pytest.raises(ArgumentError, match="the same name: ann, ann"):
        elib.swarm(["sim://", "sim://"], names=["ann", "ann"])


@pytest.mark.parametrize(
    ("urls", "message"),
    [([], "a swarm needs a robot"), (["simm://"], "there is no scheme"), ("sim://?robots=0", "robots is 0")],
)
def test_what_cannot_be_opened_is_refused_before_anything_is(urls: str | list[str], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        elib.swarm(urls)


@simulated
async def test_a_port_that_is_there_twice_is_refused() -> None:
    with pytest.raises(ArgumentError, match="serial:///dev/rfcomm0 is given twice"):
        await elib.swarm(["rfcomm0", "serial:///dev/rfcomm0"])


@simulated
async def test_when_one_cannot_be_opened_the_others_are_closed_and_the_error_names_it() -> None:
    other = await elib.open(f"{THREE}&robot=2", name="other")
    swarm = elib.swarm(THREE)
    with pytest.raises(elib.SwarmError, match=r"epuck-2: .*robot=2 is open already") as caught:
        await swarm
    assert caught.value.robot == "epuck-2"
    assert isinstance(caught.value.__cause__, LinkBusy)
    assert all(robot.session.error is not None for robot in (swarm[0], swarm[2]) if "not open" not in repr(robot))
    await other.close()
    async with elib.swarm(THREE) as robots:  # nobody holds them any more
        assert len(await robots.all.selector()) == 3


@simulated
async def test_a_bounded_number_is_opened_at_the_same_time() -> None:
    count = 2 * OPENING_AT_ONCE + 1
    async with elib.open("sim://square?latency=0.1"):
        one = now()
    began = now()
    async with elib.swarm(f"sim://crowd?robots={count}&latency=0.1"):
        assert now() - began == pytest.approx(3 * one, rel=0.05), "in three batches"


@simulated
async def test_opening_that_is_cancelled_closes_what_was_opened() -> None:
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.25):
            await elib.swarm("sim://crowd?robots=20&latency=0.1")
    async with elib.swarm("sim://crowd?robots=20&latency=0.1") as robots:
        assert len(robots) == 20
    assert asyncio.all_tasks() == {asyncio.current_task()}


@simulated
async def test_two_swarms_of_one_world_are_told_that_its_robots_are_taken() -> None:
    async with elib.swarm(THREE):
        with pytest.raises(elib.SwarmError, match="open already on this event loop"):
            await elib.swarm(THREE)
        async with elib.swarm(f"{THREE}&seed=5") as others:
            assert len(others) == 3


@simulated
async def test_a_swarm_lives_once() -> None:
    swarm = elib.swarm(THREE)
    async with swarm:
        pass
    with pytest.raises(LinkClosed, match="a swarm can be opened once"):
        await swarm
    await swarm.close()


def test_a_plain_with_says_what_to_write() -> None:
    with pytest.raises(ArgumentError, match=r"async with elib\.swarm"), elib.swarm(THREE):
        pass


# -- the same for all --------------------------------------------------------------------------------------------------


@inside(elib.swarm, f"{THREE}&latency=0.1")
async def test_all_are_asked_at_the_same_time_and_answer_by_name_in_order(robots: elib.Swarm) -> None:
    began = now()
    answers = await robots.all.encoders()
    assert now() - began == pytest.approx(0.2, rel=0.05)
    assert list(answers.items()) == [("epuck-1", (0, 0)), ("epuck-2", (0, 0)), ("epuck-3", (0, 0))]
    assert isinstance(answers["epuck-3"], elib.Steps)


@inside(elib.swarm, f"{THREE}&latency=0.1")
async def test_in_turn_the_next_is_asked_when_the_one_before_has_answered(robots: elib.Swarm) -> None:
    asked: list[float] = []

    def note(time: float, event: object) -> None:
        if isinstance(event, Wrote):
            asked.append(time)

    for robot in robots:
        robot.trace(note)
    began = now()
    assert list(await robots.in_turn.selector()) == list(robots.names)
    assert [time - began for time in asked] == pytest.approx([0, 0.2, 0.4], abs=0.01)


@inside(elib.swarm, THREE)
async def test_every_command_and_action_reaches_all_with_its_arguments(robots: elib.Swarm) -> None:
    assert await robots.all.set_speed(0.2, right=-0.1) == dict.fromkeys(robots.names)
    assert (await robots.all.speed())["epuck-2"] == (0.2, -0.1)
    assert (await robots.all.sensors())["epuck-3"].selector.position == 3  # type: ignore[union-attr]
    assert (await robots.all.text("C")).keys() == set(robots.names)
    assert robots.all.set_speed.__doc__ == elib.Epuck.set_speed.__doc__
    began = now()
    await robots.all.sleep(1.5)
    assert now() - began == 1.5


@simulated
async def test_a_program_is_run_for_each_robot_at_the_same_time_or_in_turn() -> None:
    async def doze(robot: elib.Epuck) -> tuple[str, float]:
        await robot.sleep(1)
        return robot.name, now()

    async with elib.swarm(THREE) as robots:
        began = now()
        together = await robots.all.run(doze)
        assert together == {name: (name, pytest.approx(began + 1)) for name in robots.names}
        apart = await robots.only("epuck-3", "epuck-1").in_turn.run(doze)
        assert list(apart.values()) == [("epuck-3", pytest.approx(began + 2)), ("epuck-1", pytest.approx(began + 3))]


@inside(elib.swarm, THREE)
async def test_an_empty_group_answers_nothing(robots: elib.Swarm) -> None:
    assert await robots[:0].all.selector() == {}
    assert await robots[:0].in_turn.selector() == {}
    assert (await robots[:0].all.collect.selector()).answers == {}


@simulated
async def test_each_robot_has_the_firmware_that_its_world_names(tmp_path: Path) -> None:
    path = tmp_path / "mixed.toml"
    starts = ["", 'firmware = "epuck2"', 'firmware = "btcom-2.0"']
    path.write_text(
        "[arena]\nsize = [1, 1]\n"
        + "".join(f"[[robot]]\nposition = [{0.3 + place / 5}, 0.5]\n{line}\n" for place, line in enumerate(starts))
    )
    async with elib.swarm(f"sim://{path}?firmware=btcom-1.1.3") as robots:
        assert [robot.firmware for robot in robots] == ["btcom-1.1.3", "epuck2", "btcom-2.0"]
        found = await robots.all.collect.distance()
        assert list(found.answers) == ["epuck-2"]
        assert [type(error) for error in found.errors.values()] == [Unsupported, Unsupported]


# -- failing together --------------------------------------------------------------------------------------------------


@inside(elib.swarm, [*(f"{THREE}&robot={n}" for n in (1, 2)), "sim://square?firmware=epuck2"])
async def test_what_is_wrong_with_a_call_is_said_before_anything_is_sent(robots: elib.Swarm) -> None:
    sent: list[Request[object]] = []
    for robot in robots:
        robot.trace(lambda time, event: sent.append(event.request) if isinstance(event, Called) else None)
    with pytest.raises(ArgumentError, match=r"^epuck-1: left is 1.05 rev/s"):
        await robots.all.set_speed(1.05, 0)  # which the third could
    with pytest.raises(ArgumentError, match=r"^epuck-1: set_speed"):
        robots.all.set_speed(1)  # type: ignore[call-arg]
    with pytest.raises(Unsupported, match=r"^epuck-3: microphone_samples\(\)"):
        robots.in_turn.microphone_samples()
    with pytest.raises(ArgumentError, match=r"^speed is 9 m/s"):
        robots.all.drive(0.1, speed=9)
    assert sent == []


@inside(elib.swarm, THREE)
async def test_the_first_error_gives_up_the_others_stops_all_and_names_the_robot(robots: elib.Swarm) -> None:
    speeds = wheels(robots)
    await robots.all.set_speed(0.5, 0.5)
    transport_of(robots[1]).robot.link.silence()
    with pytest.raises(elib.SwarmError, match=r"^epuck-2: proximity\(\) did not end within 0.2 s") as caught:
        await robots.all.within(0.2).proximity()
    assert (caught.value.robot, list(caught.value.errors)) == ("epuck-2", ["epuck-2"])
    assert isinstance(caught.value.__cause__, ReplyTimeout)
    await asyncio.sleep(0.01)
    assert speeds() == STANDING, "the silent one hears, and was told too"


@inside(elib.swarm, THREE)
async def test_robots_that_fail_at_the_same_moment_are_all_named(robots: elib.Swarm) -> None:
    for robot in robots[1:]:
        transport_of(robot).robot.link.cut()
    with pytest.raises(elib.SwarmError, match=r"^epuck-2: .*; epuck-3 failed too") as caught:
        await robots.all.proximity()
    assert {name: type(error) for name, error in caught.value.errors.items()} == {
        "epuck-2": LinkLost,
        "epuck-3": LinkLost,
    }


@inside(elib.swarm, THREE)
async def test_in_turn_nobody_is_asked_any_more_after_the_first_error(robots: elib.Swarm) -> None:
    speeds = wheels(robots)
    await robots.all.set_speed(0.5, 0.5)
    transport_of(robots[1]).robot.link.cut()
    with pytest.raises(elib.SwarmError, match=r"^epuck-2: "):
        await robots.in_turn.set_body_led(1)
    lamps = [transport_of(robot).robot.emulator.firmware.lights.body for robot in robots]
    assert lamps == [1, 0, 0]
    assert speeds()[::2] == STANDING[::2]


@pytest.mark.parametrize("way", ["all", "in_turn"])
@inside(elib.swarm, THREE)
async def test_a_program_that_awaits_what_it_has_cancelled_fails_as_any_other(robots: elib.Swarm, way: str) -> None:
    async def give_up_first(robot: elib.Epuck) -> None:
        await robot.set_speed(0.3, 0.3)
        if robot.name == "epuck-1":
            task = asyncio.create_task(robot.sleep(9))
            task.cancel()
            await task
        await robot.sleep(60)

    speeds, began = wheels(robots), robots[0].time
    with pytest.raises(elib.SwarmError, match=r"^epuck-1: its program awaited what was cancelled"):
        await getattr(robots, way).run(give_up_first)
    assert robots[0].time - began < 1
    assert speeds() == STANDING
    assert list((await robots.all.collect.run(give_up_first)).errors) == ["epuck-1"]


@simulated
async def test_the_programs_of_the_others_are_cancelled_and_an_error_of_ones_own_keeps_its_type() -> None:
    ended: list[str] = []

    async def fail_second(robot: elib.Epuck) -> None:
        await robot.set_speed(0.3, 0.3)
        try:
            await robot.sleep(1 if robot.name == "epuck-2" else 60)
        finally:
            ended.append(robot.name)
        raise KeyError("wrong")

    async with elib.swarm(THREE) as robots:
        speeds = wheels(robots)
        with pytest.raises(KeyError) as caught:
            await robots.all.run(fail_second)
        assert caught.value.__notes__ == ["in the program of robot epuck-2"]
        assert sorted(ended) == list(robots.names)
        assert speeds() == STANDING
        assert asyncio.all_tasks() == {asyncio.current_task()}


@inside(elib.swarm, f"{THREE}&latency=0.1")
async def test_a_call_to_all_can_be_cancelled_and_the_robots_answer_on(robots: elib.Swarm) -> None:
    for view in (robots.all, robots.in_turn, robots.all.collect):
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.15):
                await view.selector()
    assert len(await robots.all.within(3).encoders()) == 3


# -- each for itself ---------------------------------------------------------------------------------------------------


@inside(elib.swarm, THREE)
async def test_collected_every_robot_has_exactly_one_outcome_and_nobody_is_stopped(robots: elib.Swarm) -> None:
    speeds = wheels(robots)
    await robots.all.set_speed(0.1, 0.1)
    transport_of(robots[0]).robot.link.cut()
    transport_of(robots[2]).robot.link.silence()
    for view in (robots.all, robots.in_turn):
        outcomes = await view.collect.within(0.3).proximity()
        assert list(outcomes.answers) == ["epuck-2"]
        assert [(name, type(error)) for name, error in outcomes.errors.items()] == [
            ("epuck-1", LinkLost),
            ("epuck-3", ReplyTimeout),
        ]
    assert speeds() == [[100, 100]] * 3


@simulated
async def test_collected_programs_fail_each_for_itself() -> None:
    async def divide(robot: elib.Epuck) -> float:
        return 1 / (int(robot.name[-1]) - 2)

    async with elib.swarm(THREE) as robots:
        outcomes = await robots.all.collect.run(divide)
        assert outcomes.answers == {"epuck-1": -1, "epuck-3": 1}
        assert {name: type(error) for name, error in outcomes.errors.items()} == {"epuck-2": ZeroDivisionError}


# -- leaving -----------------------------------------------------------------------------------------------------------


@simulated
async def test_leaving_lets_the_wheels_of_all_stand_in_the_world() -> None:
    watcher = await elib.open("sim://square?robots=4&robot=4")  # it keeps the world running
    async with elib.swarm([f"sim://square?robots=4&robot={number}" for number in (1, 2, 3)]) as robots:
        await robots.all.set_speed(0.2, 0.2)
        await robots.all.sleep(0.5)
    simulation = transport_of(watcher).simulation
    assert simulation.world is not None
    await watcher.sleep(0.1)  # the tick in which they stopped ends
    simulation.catch_up()
    before = simulation.world.poses
    await watcher.sleep(1)
    simulation.catch_up()
    assert simulation.world.poses == before
    await watcher.close()


@pytest.mark.parametrize("error", [ValueError, asyncio.CancelledError, ReplyTimeout])
def test_leaving_by_an_error_stops_all(error: type[BaseException]) -> None:
    @simulated
    async def story() -> None:
        with pytest.raises(error):
            async with elib.swarm(THREE) as robots:
                nonlocal speeds
                speeds = wheels(robots)
                await robots.all.set_speed(0.5, 0.5)
                raise error
        assert speeds() == STANDING

    speeds: Callable[[], list[list[float]]] = list
    story()


@simulated
async def test_robots_that_do_not_answer_keep_none_of_the_others_from_being_stopped() -> None:
    async with elib.swarm(THREE) as robots:
        speeds = wheels(robots)
        await robots.all.set_speed(0.5, 0.5)
        transport_of(robots[0]).robot.link.silence()
        transport_of(robots[1]).robot.link.stall()
        began = now()
    assert now() - began < 1
    assert (speeds()[0], speeds()[2]) == ([0, 0], [0, 0])


@simulated
async def test_keep_moving_leaves_all_wheels_turning() -> None:
    async with elib.swarm(THREE, keep_moving=True) as robots:
        speeds = wheels(robots)
        await robots.all.set_speed(0.5, 0.5)
    assert speeds() == [[500, 500]] * 3


def test_a_signal_stops_all_robots_of_a_program() -> None:
    source = """
        import asyncio, os, signal, sys
        import elib
        from elib.testing import emulator_of

        async def wander(robot):
            while True:
                await robot.proximity()

        async def main(robots):
            global firmwares
            firmwares = [emulator_of(robot).firmware for robot in robots]
            await robots.all.set_speed(0.5, 0.5)
            asyncio.get_running_loop().call_later(0.01, os.kill, os.getpid(), signal.SIGINT)
            await robots.all.run(wander)

        try:
            elib.swarm("sim://square?robots=3", keep_moving=True).run(main)
        except KeyboardInterrupt:
            sys.exit(130)
        finally:
            print([motor.speed for firmware in firmwares for motor in firmware.motors])
    """
    done = run_python(source)
    assert (done.returncode, done.stdout) == (130, "[0, 0, 0, 0, 0, 0]\n"), done.stderr
    assert "Traceback" not in done.stderr


# -- links that break --------------------------------------------------------------------------------------------------


@simulated
async def test_a_script_cuts_one_link_and_the_others_go_on(tmp_path: Path) -> None:
    path = tmp_path / "cut.toml"
    path.write_text('description = "gone"\n[[fault]]\nkind = "cut"\nfrom = 1\nuntil = 3\n')
    urls = [f"{THREE}&robot=1", f"{THREE}&robot=2&fault={path}", f"{THREE}&robot=3"]
    async with elib.swarm(urls) as robots:
        assert faults_of(robots[1]).script.description == "gone"
        with pytest.raises(ArgumentError, match="no fault script"):
            faults_of(robots[2])
        await robots.all.sleep(2)
        outcomes = await robots.all.collect.selector()
        assert list(outcomes.answers) == ["epuck-1", "epuck-3"]
        assert "the link was cut at 1 s, as the fault script says" in str(outcomes.errors["epuck-2"])
        world = transport_of(robots[0]).simulation
    await asyncio.sleep(2)
    async with elib.swarm(urls) as robots:
        assert len(await robots.all.selector()) == 3
        assert transport_of(robots[0]).simulation is world, "it had waited for the robot that was lost"


@simulated
async def test_reconnecting_robots_come_back_into_the_same_world(tmp_path: Path) -> None:
    path = tmp_path / "cut.toml"
    path.write_text('description = "gone"\n[[fault]]\nkind = "cut"\nfrom = 1\nuntil = 3\n')
    async with elib.swarm(f"{THREE}&fault={path}", reconnecting=True) as robots:
        world = transport_of(robots[0]).simulation
        events = robots[2].events
        await robots.all.set_encoders(100, 200)
        await robots.all.sleep(2)
        assert await robots.all.within(10).encoders() == dict.fromkeys(robots.names, (100, 200))
        assert now() > 3
        assert {transport_of(robot).simulation for robot in robots} == {world}
        assert [type(event).__name__ for event in events.recent] == ["LinkDown", "LinkBack"]


# -- time --------------------------------------------------------------------------------------------------------------


def test_two_runs_of_a_program_in_simulated_time_give_the_same_world_and_another_seed_another() -> None:
    async def scatter(robots: elib.Swarm) -> str:
        async def wander(robot: elib.Epuck) -> None:
            for _ in range(20):
                near = await robot.proximity()
                await robot.set_speed(0.6, 0.6 if max(near) < 200 else -0.6)
                await robot.sleep(0.1)

        await robots.all.run(wander)
        simulation = transport_of(robots[0]).simulation
        simulation.catch_up()
        assert simulation.world is not None
        return simulation.world.hash()

    def run(seed: int) -> str:
        return elib.swarm(f"sim://crowd?robots=5&speed=max&jitter=0.01&seed={seed}").run(scatter)

    assert run(1) == run(1)
    assert run(1) != run(2)


def test_run_refuses_urls_of_different_speeds() -> None:
    async def main(robots: elib.Swarm) -> None: ...

    with pytest.raises(ArgumentError, match=r"different speeds, 2\.0 and max"):
        elib.swarm(["sim://?speed=max", "sim://?speed=2"]).run(main)


@pytest.mark.parametrize("way", ["pty", "tcp"])
async def test_a_served_crowd_is_driven_over_ports_in_real_time(way: str) -> None:
    settings = SimulationSettings(world="square", robots=4, baud=0)
    controls: list[Control] = []
    async with serve(settings, tcp="0" if way == "tcp" else None, control=controls.append) as served:
        async with elib.swarm([robot.url for robot in served], names=[robot.name for robot in served]) as robots:
            assert robots.names == ("epuck-1", "epuck-2", "epuck-3", "epuck-4")
            await robots.all.set_speed(0.25, 0.25)
            assert await robots.all.speed() == dict.fromkeys(robots.names, (0.25, 0.25))
            seen = await robots.all.sensors()
            assert all(readings.proximity is not None for readings in seen.values())

            async def have_driven() -> bool:
                return all(steps.left > 0 for steps in (await robots.all.encoders()).values())

            await until(have_driven)
        async with elib.swarm([robot.url for robot in served]) as robots:
            await robots.all.selector()  # what was sent before has arrived with that
            crowd = controls[0].simulation.robots.values()
            assert not any(motor.speed for robot in crowd for motor in robot.emulator.firmware.motors)


async def test_a_port_where_nobody_listens_is_named() -> None:
    async with serve(SimulationSettings(world="square", baud=0), tcp="0") as served:
        with pytest.raises(elib.SwarmError, match=r"^nobody: ") as caught:
            await elib.swarm([served[0].url, "serial:///dev/no-such-port"], names=["there", "nobody"])
        assert isinstance(caught.value.__cause__, LinkNotFound)
        async with elib.swarm(served[0].url) as robots:
            assert len(await robots.all.selector()) == 1
