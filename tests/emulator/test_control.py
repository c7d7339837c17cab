"""Control of a running simulation: what can be done by hand, what cannot, and the same over a socket."""

import asyncio
import json
import math
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from fault_rig import ask
from hypothesis import given, settings
from hypothesis import strategies as st

from elib.base.errors import ArgumentError, LinkBusy, LinkLost, LinkNotFound, SimulationError
from elib.link.protocol.profiles import PROFILES
from elib.link.transport import open_transport, parse_url
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.control_server import (
    BURST,
    MAX_CLIENTS,
    MAX_MESSAGE,
    MESSAGES,
    answer,
    check,
    parse,
    serve_control,
)
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.sim_transport import open_sim
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.physics import Box, Cylinder, Defect, Scene, World
from elib.studies.fork import put_things
from shared import PATIENCE, until

ROOM = """
[arena]
size = [1.0, 1.0]
[[wall]]
from = [0.5, 0.0]
to = [0.5, 0.4]
[[box]]
position = [0.8, 0.8]
size = [0.2, 0.1]
[[box]]
position = [0.2, 0.8]
size = [0.1, 0.1]
pushable = true
name = "crate"
[[cylinder]]
position = [0.8, 0.2]
radius = 0.05
[[light]]
position = [0.9, 0.5]
[[sound]]
position = [0.1, 0.5]
[[zone]]
name = "plate"
[[robot]]
position = [0.2, 0.2]
[[robot]]
position = [0.3, 0.5]
heading = 90
"""


@pytest.fixture
def room(tmp_path) -> SimulationSettings:
    path = tmp_path / "room.toml"
    path.write_text(ROOM)
    return SimulationSettings(world=str(path), baud=0)


@pytest.fixture
async def served(room) -> AsyncIterator[tuple[Control, list[str]]]:
    """The control of a running simulation, and the URLs of its two robots."""
    controls: list[Control] = []
    async with serve(room, tcp="0", control=controls.append) as robots:
        yield controls[0], [robot.url for robot in robots]


@pytest.fixture
def control(served) -> Control:
    return served[0]


@pytest.fixture
def urls(served) -> list[str]:
    return served[1]


async def test_a_robot_is_put_where_it_is_wanted_and_keeps_its_heading_unless_another_is_given(control):
    control.move_robot("epuck-2", 0.7, 0.5)
    pose = control.snapshot().robots[1].pose
    assert (pose.x, pose.y) == (0.7, 0.5)
    assert pose.heading == pytest.approx(math.pi / 2)
    control.move_robot(1, 0.7, 0.5, 3 * math.pi)
    assert abs(control.snapshot().robots[1].pose.heading) == pytest.approx(math.pi)


async def test_objects_lights_sounds_and_the_light_of_the_room_can_be_changed(control):
    control.move_box("crate", 0.3, 0.7, math.pi / 2)
    control.move_box(0, 0.7, 0.8)
    control.move_cylinder(0, 0.9, 0.1)
    control.set_light(0, intensity=2.5, x=0.6)
    control.set_sound(0, volume=0)
    control.set_ambient(1234)
    seen = control.snapshot()
    assert [(box.x, box.y) for box in seen.boxes] == [(0.7, 0.8), (0.3, 0.7)]
    assert seen.boxes[1].angle == pytest.approx(math.pi / 2)
    assert (seen.cylinders[0].x, seen.cylinders[0].y) == (0.9, 0.1)
    assert (seen.lights[0].x, seen.lights[0].y, seen.lights[0].intensity) == (0.6, 0.5, 2.5)
    assert seen.sounds[0].volume == 0
    assert control.ambient == 1234


@pytest.mark.parametrize(
    ("x", "y", "blocked"),
    [
        (0.3, 0.45, "epuck-2"),
        (0.52, 0.2, "wall 0"),
        (0.75, 0.8, "box 0"),
        (0.2, 0.75, r"box 1 \(crate\)"),
        (0.8, 0.26, "cylinder 0"),
        (0.01, 0.5, "the edge of the arena"),
        (5.0, 0.5, "the edge of the arena"),
    ],
)
async def test_a_robot_is_not_put_into_anything_and_stays_where_it_was(control, x, y, blocked):
    before = control.snapshot().robots[0].pose
    with pytest.raises(ArgumentError, match=rf"epuck-1 has no room at \(.*\): {blocked} is in the way"):
        control.move_robot(0, x, y)
    assert control.snapshot().robots[0].pose == before


async def test_objects_are_not_put_onto_a_robot_or_out_of_the_arena_either(control):
    for move in (
        lambda: control.move_box(0, 0.2, 0.2),
        lambda: control.move_box(0, 0.8, 1.01),
        lambda: control.move_cylinder(0, 0.3, 0.55),
    ):
        with pytest.raises(ArgumentError, match="has no room"):
            move()


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda control: control.move_robot("epuck-3", 0.5, 0.5), "there is no robot 'epuck-3'"),
        (lambda control: control.move_robot(-1, 0.5, 0.5), "there is no robot -1"),
        (lambda control: control.move_robot(0, math.nan, 0.5), "x is nan"),
        (lambda control: control.move_robot(0, 0.5, 0.5, math.inf), "not finite"),
        (lambda control: control.move_box("chest", 0.5, 0.5), "there is no box 'chest'"),
        (lambda control: control.move_cylinder(1, 0.5, 0.5), "there is no cylinder 1"),
        (lambda control: control.set_light(0, intensity=11), "intensity is 11"),
        (lambda control: control.set_sound(0, frequency=8001), "frequency is 8001"),
        (lambda control: control.set_ambient(5000), "ambient is 5000"),
        (lambda control: control.set_faults(0, loss=1.5), "loss is 1.5; it must be a number from 0 to 1"),
        (lambda control: control.set_faults(0, latency=-1), "latency is -1 s; it must be a number from 0 to 60 s"),
        (lambda control: control.cut("nobody"), "there is no robot 'nobody'"),
    ],
)
async def test_an_impossible_change_is_refused_with_the_rule(control, act, message):
    with pytest.raises(ArgumentError, match=message):
        act(control)


async def test_a_delay_set_by_hand_holds_for_every_answer_until_it_is_taken_away(control, urls):
    robot = await open_transport(urls[0])
    control.set_faults(0, latency=0.04)
    began = asyncio.get_running_loop().time()
    assert await ask(robot, b"E\r") == b"e,0,0\r\n"
    assert asyncio.get_running_loop().time() - began >= 0.04
    assert control.link(0).latency == 0.04
    control.set_faults("epuck-1", latency=0)
    assert control.link(0).latency == 0
    assert await ask(robot, b"E\r") == b"e,0,0\r\n"
    await robot.close()


async def test_with_a_loss_of_1_no_answer_comes_and_the_robot_still_receives(control, urls):
    robot = await open_transport(urls[0])
    control.set_faults(0, loss=1)
    await robot.write(b"D,100,100\r")
    await until(lambda: control.simulation.robots[0].emulator.firmware.report()["speed"] == [100, 100])
    control.set_faults(0, loss=0)
    assert await ask(robot, b"E\r") == b"e,100,100\r\n", "the first question is not answered"
    await robot.close()


async def test_a_cut_link_is_lost_and_closed_to_all_until_it_is_mended(control, urls):
    robot = await open_transport(urls[0])
    assert await ask(robot, b"D,50,60\r") == b"d\r\n"
    control.cut(0)
    assert control.link(0).is_cut
    assert control.is_cut(0)
    assert not control.is_cut(1)
    with pytest.raises(LinkLost):
        async with asyncio.timeout(PATIENCE):
            await robot.read()
    await robot.close()
    again = await open_transport(urls[0])
    with pytest.raises(LinkLost):
        async with asyncio.timeout(PATIENCE):
            await again.read()
    await again.close()
    control.cut(0)
    control.mend(0)
    control.mend(0)
    assert not control.link(0).is_cut
    mended = await open_transport(urls[0])
    assert await ask(mended, b"E\r") == b"e,50,60\r\n", "the robot went on meanwhile"
    await mended.close()


async def test_a_pty_vanishes_with_a_cut_and_comes_back_under_its_name(room):
    controls: list[Control] = []
    async with serve(room, control=controls.append) as robots:
        url = robots[0].url
        await (await open_transport(url)).close()
        controls[0].cut("epuck-1")
        with pytest.raises(LinkNotFound):
            await open_transport(url)
        controls[0].mend("epuck-1")
        robot = await open_transport(url)
        assert await ask(robot, b"E\r") == b"e,0,0\r\n"
        await robot.close()


async def test_faults_set_by_hand_come_on_top_of_a_fault_script(room, tmp_path):
    script = tmp_path / "script.toml"
    script.write_text('description = "Slow."\n[[fault]]\nkind = "delay"\ndelay = 0.02\n')
    controls: list[Control] = []
    settings = SimulationSettings(world=room.world, baud=0, fault=str(script))
    async with serve(settings, tcp="0", control=controls.append) as robots:
        robot = await open_transport(robots[0].url)
        controls[0].set_faults(0, latency=0.02)
        began = asyncio.get_running_loop().time()
        assert await ask(robot, b"E\r") == b"e,0,0\r\n"
        assert asyncio.get_running_loop().time() - began >= 0.04
        assert controls[0].simulation.robots[0].player.counts.delayed == 1
        assert controls[0].link(0).script == ("delay",)
        assert controls[0].link(1).script == (), "no program has talked to it yet"
        await robot.close()


async def test_parts_broken_by_hand_come_on_top_of_a_fault_script_and_are_mended_one_by_one_or_all(control, urls):
    robot = control.simulation.robots[0]
    robot.break_parts("Sensor", (Defect("proximity", (1,), stuck=100.0),))
    control.set_defect(0, "proximity", 1, shift=50.0)
    control.set_defect(0, "proximity", 1, shift=70.0)  # instead of what was wrong before
    control.set_defect("epuck-1", "clock", factor=0.5)
    assert control.world.proximity(0)[1] == 170
    assert control.link(0).broken == ("proximity 1 stuck at 100", "proximity 1 +70", "clock x 0.5")
    control.set_defect(0, "clock")
    assert control.link(0).broken == ("proximity 1 stuck at 100", "proximity 1 +70")
    assert robot.emulator.pace == 1.0
    control.set_defect(0, "proximity", 1)
    assert control.world.proximity(0)[1] == 100
    control.mend_parts(0)
    assert control.link(0).broken == ()
    assert control.world.proximity(0)[1] != 100
    for wrong in ({"of": "nose"}, {"of": "ground", "number": 7, "stuck": 1.0}, {"of": "clock", "factor": 50.0}):
        with pytest.raises(ArgumentError):
            control.set_defect(0, **wrong)


async def test_inside_a_program_a_cut_link_stays_cut_until_it_is_mended(room):
    url = f"sim://{room.world}"
    robot = await open_sim(parse_url(url))
    control = Control(robot.simulation)
    control.move_robot(0, 0.7, 0.6)
    control.cut(0)
    with pytest.raises(LinkLost):
        await robot.read()
    assert control.is_cut(0)
    assert control.link(0).is_cut
    with pytest.raises(LinkNotFound, match="was cut by hand"):
        await open_sim(parse_url(url))
    control.mend(0)
    assert not control.is_cut(0)
    again = await open_sim(parse_url(url))
    assert again.simulation is robot.simulation
    assert control.snapshot().robots[0].pose.x == 0.7
    with pytest.raises(ArgumentError, match="no program ever opened it"):
        control.cut(1)
    await again.close()


@pytest.mark.parametrize("firmware", PROFILES)
async def test_faults_that_one_control_set_are_seen_and_ended_by_another(room, firmware):
    robot = await open_sim(parse_url(f"sim://{room.world}?firmware={firmware}"))
    one, other = Control(robot.simulation), Control(robot.simulation)
    one.set_faults(0, latency=0.5, jitter=0.25, loss=1)
    one.set_ambient(1234)
    seen = other.link(0)
    assert (seen.latency, seen.jitter, seen.loss, other.ambient) == (0.5, 0.25, 1, 1234)
    other.set_faults(0, latency=0, jitter=0, loss=0)
    assert one.link(0) == other.link(0)
    assert one.link(0).loss == 0
    assert (await ask(robot, b"E\r")).strip() == b"e,0,0", "nothing of the first control is left"
    one.cut(0)
    assert other.is_cut(0)
    other.mend(0)
    assert not one.is_cut(0)
    await robot.close()


async def test_a_box_or_a_wall_that_was_put_in_is_there_for_the_robots_and_only_so_many_are(room, monkeypatch):
    robot = await open_sim(parse_url(f"sim://{room.world}"))
    control = Control(robot.simulation)
    world = control.world
    control.move_robot(0, 0.7, 0.6, 0.0)
    assert max(world.proximity(0)[0], world.proximity(0)[7]) < 100
    assert control.add_box(0.8, 0.6, pushable=False) == 2
    assert max(world.proximity(0)[0], world.proximity(0)[7]) > 400
    with pytest.raises(ArgumentError, match="box 2 is in the way"):
        control.move_robot(0, 0.8, 0.6)
    control.remove_box(2)
    assert control.add_wall(0.745, 0.5, 0.745, 0.7) == 1
    assert max(world.proximity(0)[0], world.proximity(0)[7]) > 400
    for act in (
        lambda: control.add_wall(0.7, 0.5, 0.7, 0.7),
        lambda: control.move_wall(1, 0.7, 0.5, 0.7, 0.7),
        lambda: control.add_box(0.7, 0.6),
    ):
        with pytest.raises(ArgumentError, match="epuck-1 is in the way"):
            act()
    control.remove_wall(1)
    assert robot.describe()["scene"].count("[[wall]]") == 1
    assert max(world.proximity(0)[0], world.proximity(0)[7]) < 100
    assert "[[box]]" in robot.describe()["scene"]
    monkeypatch.setattr("elib.simulator.emulator.control.MAX_BY_HAND", 3)
    control.add_box(0.6, 0.6, width=0.02, depth=0.02)
    with pytest.raises(ArgumentError, match="the world has 3 boxes"):
        control.add_box(0.7, 0.6, width=0.02, depth=0.02)
    await robot.close()


async def test_the_button_of_an_e_puck2_is_held_until_it_is_released(room):
    robot = await open_sim(parse_url(f"sim://{room.world}?firmware=epuck2"))
    control = Control(robot.simulation)
    control.press_button(0)
    assert control.hardware(0).button_is_pressed()
    control.press_button(0, pressed=False)
    assert not control.hardware(0).button_is_pressed()
    await robot.close()


async def test_constant_readings_have_no_world_to_change(tmp_path):
    path = tmp_path / "readings.json"
    path.write_text("{}")
    controls: list[Control] = []
    async with serve(SimulationSettings(hardware=str(path)), tcp="0", control=controls.append):
        with pytest.raises(SimulationError, match="no world"):
            controls[0].move_robot(0, 0.5, 0.5)
        assert answer(controls[0], {"do": "state"})["ok"] is False
        for message in ({"do": "turn_selector", "robot": 0, "position": 1}, {"do": "add_box", "x": 0.5, "y": 0.5}):
            assert "no world" in str(answer(controls[0], message)["error"])
        controls[0].set_faults(0, loss=0.5)
        assert controls[0].link(0).loss == 0.5


# -- over a socket --


class Client:
    """One client of the control server."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer

    async def say(self, line: bytes) -> dict:
        self.writer.write(line + b"\n")
        return await self.hear()

    async def hear(self) -> dict:
        async with asyncio.timeout(PATIENCE):
            return json.loads(await self.reader.readline())

    async def ask(self, **message: object) -> dict:
        return await self.say(json.dumps(message).encode())

    async def ends(self) -> bool:
        async with asyncio.timeout(PATIENCE):
            return await self.reader.read() == b""


@pytest.fixture
async def server(control) -> AsyncIterator[str]:
    async with serve_control(control, "0") as url:
        yield url


async def connect(url: str) -> Client:
    host, _, port = url.removeprefix("tcp://").rpartition(":")
    return Client(*await asyncio.open_connection(host, int(port)))


@pytest.fixture
async def client(server) -> AsyncIterator[Client]:
    client = await connect(server)
    yield client
    client.writer.close()


async def test_the_state_tells_everything_there_is(client):
    reply = await client.ask(do="state", id=5)
    assert (reply["id"], reply["ok"]) == (5, True)
    state = reply["result"]
    assert (state["world"], state["width"], state["depth"]) == ("room", 1.0, 1.0)
    first = state["robots"][0]
    assert (first["name"], first["x"], first["y"], first["cut"]) == ("epuck-1", 0.2, 0.2, False)
    assert [box["name"] for box in state["boxes"]] == ["", "crate"]
    assert [len(state[what]) for what in ("cylinders", "lights", "sounds")] == [1, 1, 1]
    assert state["walls"] == [{"x1": 0.5, "y1": 0.0, "x2": 0.5, "y2": 0.4}]
    assert (state["paused"], state["speed"], first["script"]) == (False, 1.0, [])


async def test_a_restart_stops_a_robot_and_turns_its_lamps_off(control: Control) -> None:
    for firmware in ("btcom-2.0", "epuck2-wifi"):
        simulation = Simulation(SimulationSettings(world="square", firmware=firmware))
        robot = simulation.robots[0]
        robot.emulator.firmware.drive(100, 100)
        Control(simulation).restart(0)
        assert robot.emulator.firmware.report()["speed"] == [0, 0]
        simulation.close()
    with pytest.raises(ArgumentError, match="there is no robot"):
        control.restart(99)


async def test_every_message_of_the_list_does_what_it_says(client, control):
    asked = {
        "state": {},
        "move_robot": {"robot": "epuck-1", "x": 0.7, "y": 0.6, "heading": 1},
        "move_box": {"box": "crate", "x": 0.3, "y": 0.8},
        "move_cylinder": {"cylinder": 0, "x": 0.9, "y": 0.2},
        "add_box": {"x": 0.2, "y": 0.35, "width": 0.05, "colour": "#102030"},
        "remove_box": {"box": 0},
        "add_wall": {"x1": 0.6, "y1": 0.1, "x2": 0.7, "y2": 0.1},
        "move_wall": {"wall": 1, "x1": 0.6, "y1": 0.2, "x2": 0.7, "y2": 0.2},
        "remove_wall": {"wall": 0},
        "set_light": {"light": 0, "intensity": 3},
        "set_sound": {"sound": 0, "volume": 2000},
        "switch": {"zone": "plate", "on": True},
        "set_ambient": {"ambient": 100},
        "turn_selector": {"robot": 0, "position": 8},
        "press_remote": {"robot": 0, "key": 60},
        "press_button": {"robot": 0},
        "restart": {"robot": 1},
        "pause": {},
        "resume": {},
        "step": {"seconds": 0.1},
        "set_speed": {"speed": 2},
        "set_faults": {"robot": 0, "loss": 0.25},
        "set_defect": {"robot": 0, "of": "ground", "number": 1, "stuck": 3},
        "mend_parts": {"robot": 1},
        "cut": {"robot": 1},
        "mend": {"robot": 1},
    }
    assert list(asked) == list(MESSAGES)
    refused = {"press_button": "epuck-1 has no button", "step": "only a paused world can be stepped"}
    for what, keys in asked.items():
        reply = await client.ask(do=what, **keys)
        assert reply["ok"] is (what not in refused), what
        assert reply.get("error") == refused.get(what)
    seen = control.snapshot()
    assert (seen.robots[0].pose.x, seen.boxes[0].x, seen.cylinders[0].x) == (0.7, 0.3, 0.9)
    assert (seen.boxes[1].y, seen.boxes[1].width, str(seen.boxes[1].colour)) == (0.35, 0.05, "#102030")
    assert [(wall.x1, wall.y1) for wall in seen.walls] == [(0.6, 0.2)]
    assert (control.hardware(0).selector(), control.hardware(0).infrared()) == (8, (1, 0, 60))
    assert control.simulation.clock.rate == 2
    assert (seen.lights[0].intensity, seen.sounds[0].volume, control.ambient) == (3, 2000, 100)
    assert (control.link(0).loss, control.link(1).is_cut) == (0.25, False)
    assert control.link(0).broken == ("ground 1 stuck at 3",)


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ({}, "'do' is None"),
        ({"do": "fly"}, "'do' is 'fly'"),
        ({"do": ["state"]}, "'do' is"),
        ({"do": "cut"}, "cut needs 'robot': a name, or an index from 0"),
        ({"do": "cut", "robot": 1.5}, "robot is 1.5; it must be a name, or an index from 0"),
        ({"do": "cut", "robot": True}, "robot is true"),
        ({"do": "cut", "robot": 10**400}, "there is no robot"),
        ({"do": "cut", "robot": 0, "now": 1}, "cut has no key 'now'"),
        ({"do": "set_light", "light": 0, "intensty": 1}, "set_light has no key 'intensty'"),
        ({"do": "move_robot", "robot": 0, "x": "left", "y": 0}, "x is 'left'; it must be a number"),
        ({"do": "move_robot", "robot": 0, "x": 10**400, "y": 0}, "x is a number of 1329 bits; it must be"),
        ({"do": "move_robot", "robot": 0, "x": 0.5}, "move_robot needs 'y'"),
        ({"do": "set_ambient", "ambient": -1}, "ambient is -1 counts; it must be a number from 0 to 4095 counts"),
        ({"do": "state", "id": [1]}, "'id' must be"),
        ({"do": "move_robot", "robot": 0, "x": 0.3, "y": 0.5}, "epuck-2 is in the way"),
    ],
)
async def test_a_message_with_a_mistake_is_answered_with_the_rule_and_the_connection_stays_open(client, message, error):
    reply = await client.ask(**message)
    assert reply["ok"] is False
    assert reply["error"].startswith(error) or error in reply["error"]
    assert (await client.ask(do="state"))["ok"] is True


@pytest.mark.parametrize(
    "line",
    [
        b"GET / HTTP/1.1",
        b"[1, 2]",
        b'{"do": NaN}',
        b"[" * 3000,
        b"\xff\xfe",
        b'{"do": "state"',
        b"x" * (MAX_MESSAGE + 10),
        b"1" * 4000,
    ],
)
async def test_a_client_that_does_not_send_json_is_told_so_and_disconnected(client, server, line):
    reply = await client.say(line + b'\n{"do": "set_ambient", "ambient": 0}')
    assert reply["ok"] is False
    assert "message" in reply["error"] or "line" in reply["error"]
    assert await client.ends()
    other = await connect(server)
    assert (await other.ask(do="state"))["result"]["ambient"] != 0, "nothing behind such a line is done"
    other.writer.close()


async def test_only_so_many_programs_at_once_and_one_that_leaves_makes_room(server):
    clients = [await connect(server) for _ in range(MAX_CLIENTS)]
    for client in clients:
        assert (await client.ask(do="state"))["ok"]
    late = await connect(server)
    assert "connected already" in (await late.hear())["error"]
    clients[0].writer.close()
    await clients[0].writer.wait_closed()

    async def is_let_in() -> bool:
        clients[0] = await connect(server)
        is_in: bool = (await clients[0].ask(do="state"))["ok"]
        if not is_in:
            clients[0].writer.close()
        return is_in

    await until(is_let_in)  # the server has yet to notice that one left
    for client in (*clients, late):
        client.writer.close()


async def test_programs_that_say_nothing_for_long_do_not_keep_others_out(server, monkeypatch):
    monkeypatch.setattr("elib.simulator.emulator.control_server.MAX_IDLE", 0.0)
    silent = await connect(server)
    clients = [await connect(server) for _ in range(MAX_CLIENTS - 1)]
    for client in clients:
        assert (await client.ask(do="state"))["ok"]
    late = await connect(server)
    assert (await late.ask(do="state"))["ok"]
    assert "needed the place" in (await silent.hear())["error"]
    assert await silent.ends()
    for client in (*clients, late):
        assert (await client.ask(do="state"))["ok"]
        client.writer.close()
    silent.writer.close()


async def test_a_client_that_floods_the_server_waits_and_loses_nothing(client):
    count = int(BURST) + 20
    client.writer.write(b'{"do": "cut", "robot": 7}\n' * count)
    assert [(await client.hear())["ok"] for _ in range(count)] == [False] * count


def test_an_end_while_a_client_that_left_still_has_messages_is_no_error(room):
    troubles: list[dict[str, object]] = []

    async def talk(control: Control) -> None:
        async with serve_control(control, "0") as url:
            client = await connect(url)
            client.writer.write(b'{"do": "cut", "robot": 7}\n' * (int(BURST) + 200))
            await client.hear()
            client.writer.close()

    async def main() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: troubles.append(context))
        controls: list[Control] = []
        async with serve(room, tcp="0", control=controls.append):
            await talk(controls[0])

    asyncio.run(main())
    assert troubles == []


async def test_the_port_counts_up_where_none_is_named_and_a_named_one_that_is_taken_is_refused(control):
    async with serve_control(control) as first, serve_control(control) as second:
        assert first != second
        with pytest.raises(LinkBusy, match="is taken"):
            async with serve_control(control, first.removeprefix("tcp://")):
                pass


@pytest.mark.parametrize("place", ["0.0.0.0:0", "192.168.1.5:80", "example.org:80", "here", "127.0.0.1:70000", "::80"])
async def test_an_address_that_others_could_reach_or_that_is_wrong_is_refused(control, place):
    with pytest.raises(ArgumentError):
        async with serve_control(control, place):
            pass


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=10), inner, max_size=3),
    max_leaves=6,
)
KEYS = sorted({key for keys in MESSAGES.values() for key in keys} | {"do", "id", "nonsense"})


def outcome(act, *arguments):
    """Return what comes of a call: its result, or the error that refuses it."""
    try:
        return act(*arguments)
    except ArgumentError as error:
        return error


@settings(derandomize=True, deadline=None)
@given(st.sampled_from(sorted(MESSAGES)), st.dictionaries(st.sampled_from(KEYS), JSON, max_size=6))
def test_whatever_a_message_holds_it_is_checked_or_refused_with_words(what, message):
    match outcome(check, {**message, "do": what}):
        case ArgumentError() as error:
            assert error.message
        case _, values:
            assert set(values) <= set(MESSAGES[what])
            assert all(isinstance(value, str | int) or math.isfinite(value) for value in values.values())


@settings(derandomize=True, deadline=None)
@given(st.binary(max_size=60))
def test_whatever_bytes_come_they_are_an_object_or_refused(line):
    assert isinstance(outcome(parse, line), dict | ArgumentError)


def test_the_guide_lists_every_message_with_its_keys():
    guide = (Path(__file__).parents[2] / "docs/guides/watch-a-simulation.md").read_text(encoding="utf-8")
    _, *rows = (line.split("|") for line in guide.splitlines() if line.startswith("| `"))
    listed = {row[1].strip(" `"): {key.strip(" `") for key in row[2].split(",")} - {""} for row in rows}
    assert listed == {what: set(keys) for what, keys in MESSAGES.items()}


def test_recorded_things_are_put_where_they_lay_also_where_another_one_stood(caplog):
    boxes = tuple(Box(0.2 + 0.2 * k, 0.5, 0.1, 0.1, is_pushable=True) for k in range(3))
    scene = Scene(1, 1, boxes=boxes, cylinders=(Cylinder(0.8, 0.2, 0.05, is_pushable=True),))
    world = World(scene)
    lay = {"boxes": [(0.4, 0.5, 0.0), (0.6, 0.5, 0.0), (0.9, 0.8, 0.5)], "cylinders": [(0.2, 0.5)]}
    put_things(world, lay, is_exact=True)
    assert [(box.x, box.y) for box in world.snapshot().boxes] == [place[:2] for place in lay["boxes"]]
    assert (world.snapshot().cylinders[0].x, world.snapshot().cylinders[0].y) == (0.2, 0.5)
    lay["boxes"][0] = (2.0, 0.5, 0.0)
    put_things(world, lay, is_exact=False)
    assert "box 0 has no room at (2.000, 0.500): the edge of the arena is in the way; it stays" in caplog.text
    with pytest.raises(ArgumentError, match="box 0 has no room"):
        put_things(world, lay, is_exact=True)


def test_things_of_another_number_stay_where_they_are_and_that_is_said(caplog):
    world = World(Scene(1, 1, boxes=(Box(0.2, 0.5, 0.1, 0.1, is_pushable=True),)))
    lay = {"boxes": [(0.4, 0.5, 0.0), (0.6, 0.5, 0.0)], "cylinders": []}
    put_things(world, lay, is_exact=False)
    assert world.snapshot().boxes[0].x == 0.2
    assert "boxes were added or removed, and the recording does not say which; all things stand where" in caplog.text
    with pytest.raises(ArgumentError, match="does not say which"):
        put_things(world, lay, is_exact=True)
