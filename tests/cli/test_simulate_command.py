"""``elib simulate``: a server of its own process, and clients of others."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from elib_process import PATIENCE, Told, elib, started

from elib import Epuck, LinkError, Swarm, SwarmError, swarm
from shared import wait_until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs ptys and POSIX signals")


def send(*words: str) -> subprocess.CompletedProcess[str]:
    """Send a command in a process of its own, which waits as long as a busy machine takes."""
    return elib("send", words[0], "--within", str(PATIENCE), *words[1:])


@pytest.mark.long
def test_a_client_drives_a_robot_on_a_pty_and_the_robot_stays_as_it_was_left(tmp_path: Path) -> None:
    with started("simulate", "square", "--pty", str(tmp_path / "robot0"), "--robots", "2") as server:
        first, second = server.out.line().split(), server.out.line().split()
        assert first == ["epuck-1", f"serial://{tmp_path}/robot0"]
        assert second == ["epuck-2", f"serial://{tmp_path}/robot1"]
        assert send("set_speed", "0.25", "-0.5", "--robot", first[1]).returncode == 0
        speed = send("speed", "--json", "--robot", first[1])
        assert json.loads(speed.stdout) == {"left": 0.25, "right": -0.5}
        untouched = send("speed", "--json", "--robot", second[1])
        assert json.loads(untouched.stdout) == {"left": 0.0, "right": 0.0}
        assert server.end(signal.SIGTERM) == 0
        assert server.err.rest() == ""
    assert list(tmp_path.iterdir()) == []


def test_without_a_choice_each_robot_gets_a_pty_and_ctrl_c_is_the_usual_end() -> None:
    with started("simulate") as server:
        name, url = server.out.line().split()
        assert name == "epuck-1"
        assert url.startswith("serial:///dev/")
        assert server.end(signal.SIGINT) == 0
        assert server.err.rest() == ""


@pytest.mark.long
def test_over_tcp_other_firmwares_and_faster_time_are_served_and_the_traffic_is_shown() -> None:
    with started("simulate", "--tcp", "127.0.0.1:0", "--firmware", "epuck2", "--speed", "5", "-v") as server:
        name, url = server.out.line().split()
        assert url.startswith("tcp://127.0.0.1:")
        version = send("version", "--json", "--robot", url)
        assert json.loads(version.stdout)["firmware"] == "epuck2"
        assert server.end() == 0
        traffic = server.err.rest()
        assert f"{name} > V\\r" in traffic
        assert "version()" in traffic
        assert f"{name} < v,Version 2.0 January" in traffic
        assert "version: Version 2.0 January 2018" in traffic


@pytest.mark.long
def test_robots_are_offered_over_wifi_and_what_a_client_did_to_one_is_said() -> None:
    with started("simulate", "square", "--wifi", "--robots", "2", "--seed", "4") as server:
        served = [server.out.line().split() for _ in range(2)]
        assert [name for name, _ in served] == ["epuck-1", "epuck-2"]
        assert all(url.startswith("wifi://127.0.0.1:") for _, url in served)
        for number, (_, url) in enumerate(served, start=1):
            assert send("set_speed", str(number / 10), "0", "--robot", url).returncode == 0
        picture = send("image", "--robot", served[0][1])
        assert "160 x 120" in picture.stdout
        port = int(served[1][1].rpartition(":")[2])
        socket.create_connection(("127.0.0.1", port), PATIENCE).close()
        server.err.until("epuck-2: a client left before it sent a valid command")
        assert server.end() == 0


@pytest.mark.long
def test_a_named_world_is_served_with_a_whole_crowd_and_a_killed_server_fails_the_swarm_by_name() -> None:
    with started("simulate", "--world", "crowd", "--robots", "5", "--tcp", "0", "--baud", "0") as server:
        served = [server.out.line().split() for _ in range(5)]
        names, urls = [name for name, _ in served], [url for _, url in served]
        assert names == [f"epuck-{number}" for number in range(1, 6)]

        async def main(robots: Swarm) -> None:
            await robots.all.set_speed(0.1, 0.2)
            readings = await robots.all.sensors()
            assert all(reading.proximity is not None for reading in readings.values())
            server.process.kill()
            with pytest.raises(SwarmError) as caught:
                await robots.all.within(10).run(polling)
            assert caught.value.robot in names
            assert isinstance(caught.value.__cause__, LinkError)
            outcomes = await robots.all.collect.selector()
            assert list(outcomes.errors) == names

        async def polling(robot: Epuck) -> None:
            while True:
                await robot.proximity()

        swarm(urls, names=names).run(main)


def test_a_world_named_twice_alike_is_served_once() -> None:
    with started("simulate", "square", "--world", "square", "--tcp", "0") as server:
        assert server.out.line().startswith("epuck-1 tcp://")
        assert server.end() == 0


def test_bytes_that_are_not_a_command_do_not_disturb_the_server() -> None:
    with started("simulate", "--tcp", "0", "-v") as server:
        port = int(server.out.line().rpartition(":")[2])
        with socket.create_connection(("127.0.0.1", port), PATIENCE) as line:
            line.settimeout(PATIENCE)
            line.sendall(b"\xff\xfe" + bytes(40) + b"\r?????\rV\r")
            heard = b""
            while b"Version" not in heard:
                heard += line.recv(4096)
        assert server.end() == 0
        assert "Traceback" not in server.err.rest()


@pytest.mark.parametrize(
    ("tokens", "code", "message"),
    [
        (["--speed", "max"], 2, "programs that open a port run in real time\nhint: use --speed 10"),
        (["--speed", "fast"], 2, "speed is 'fast'"),
        (["--robots", "0"], 2, "robots is 0; it must be a whole number from 1 to 10000"),
        (["--robots", "two"], 2, "robots is 'two'; it must be a whole number"),
        (["--loss", "2"], 2, "loss is 2; it must be a number from 0 to 1"),
        (["--firmware", "btcom"], 2, "there is no firmware 'btcom'"),
        (["crowd", "--tcp", "65530"], 2, "20 robots from port 65530 on pass port 65535\nhint: take a lower port, or 0"),
        (["--tcp", "here"], 2, "'here' is neither HOST:PORT nor PORT"),
        (["--wifi=here"], 2, "'here' is neither HOST:PORT nor PORT"),
        (["--wifi", "--firmware", "epuck2"], 2, "no robot of this simulation has Wi-Fi"),
        (["--wifi", "--pty"], 2, "no serial line"),
        (["nowhere"], 1, "there is no world 'nowhere'"),
        (["--world", "nowhere"], 1, "there is no world 'nowhere'"),
        (["crowd", "--world", "square"], 2, "two worlds are named, crowd and square\nhint: write elib simulate square"),
        (["--hardware", "/no/such/file"], 2, "/no/such/file"),
    ],
)
def test_what_cannot_be_served_is_refused_with_the_rule(
    refused: Told, tokens: list[str], code: int, message: str
) -> None:
    assert message in refused("simulate", *tokens, code=code)


def test_a_name_that_is_taken_is_left_alone(refused: Told, tmp_path: Path) -> None:
    (tmp_path / "robot").write_text("mine")
    assert "exists already" in refused("simulate", "--pty", tmp_path / "robot", code=1)
    assert (tmp_path / "robot").read_text() == "mine"


@pytest.mark.long
def test_an_interrupted_command_leaves_the_robot_stopped() -> None:
    with started("simulate", "square", "--tcp", "0", "-v") as server:
        url = server.out.line().split()[1]

        def is_interrupted() -> bool:
            """Interrupt a command that takes 2.6 s; return whether it was not done before."""
            assert send("set_speed", "0.1", "0.1", "--robot", url).returncode == 0
            with started("send", "calibrate_proximity", "--robot", url) as client:
                server.err.until("> K\\r")
                code = client.end()
                assert client.err.rest() == ("" if code == 130 else "calibrate_proximity: done")
                return code == 130

        wait_until(is_interrupted)
        stood = [send("encoders", "--json", "--robot", url).stdout for _ in range(3)]
        assert stood[0] == stood[2] != ""
        assert server.end() == 0
