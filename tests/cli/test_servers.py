"""``elib simulate --view --control``: servers beside the robots' ports."""

from __future__ import annotations

import json
import signal
import socket
import sys
from urllib.request import urlopen

import pytest
from elib_process import PATIENCE, Told, started

from elib.base.extras import install
from shared import needs_page

pytestmark = needs_page

posix = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")


@posix
@pytest.mark.long
def test_the_servers_start_after_the_robots_and_stand_on_stderr_where_no_script_takes_them_for_robots() -> None:
    with started("simulate", "square", "--tcp", "0", "--robots", "2", "--view", "0", "--control", "0") as server:
        assert [server.out.line().split()[0] for _ in range(2)] == ["epuck-1", "epuck-2"]
        view, page = server.err.line().split()
        control, address = server.err.line().split()
        assert (view, control) == ("view", "control")
        with urlopen(page, timeout=PATIENCE) as response:
            assert b"<title>elib</title>" in response.read()
        host, _, port = address.removeprefix("tcp://").rpartition(":")
        with socket.create_connection((host, int(port)), PATIENCE) as line, line.makefile("rw") as talk:
            talk.write('{"do": "move_robot", "robot": "epuck-2", "x": 0.3, "y": 0.7}\n{"do": "state"}\n')
            talk.flush()
            assert json.loads(talk.readline()) == {"ok": True}
            second = json.loads(talk.readline())["result"]["robots"][1]
            assert (second["x"], second["y"]) == (0.3, 0.7)
            assert server.end(signal.SIGTERM) == 0, "a client of the control server does not keep it running"
        assert len(server.out.rest().splitlines()) == 2
        assert len(server.err.rest().splitlines()) == 2


@pytest.mark.parametrize(
    ("tokens", "code", "message"),
    [
        (["--view", "0.0.0.0:8600"], 2, "'0.0.0.0' is not this computer"),
        (["--view", "127.0.0.1:70000"], 2, "a port is from 0 to 65535"),
        (["--control=example.org:1"], 2, "'example.org' is not this computer"),
    ],
)
def test_a_server_that_others_could_reach_is_refused_before_any_robot_is_offered(
    refused: Told, tokens: list[str], code: int, message: str
) -> None:
    assert message in refused("simulate", "square", "--tcp", "0", *tokens, code=code)


def test_a_view_without_its_extra_says_how_to_get_it(refused: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    assert install("web") in refused("simulate", "square", "--tcp", "0", "--view", "0", code=1)
