"""Fault scripts on robots that are served: ports that vanish and come back under their name."""

import asyncio
import sys
from pathlib import Path

import pytest
from fault_rig import receive
from served_rig import Seen

from elib.base.errors import LinkLost, LinkNotFound
from elib.cli import main
from elib.link.transport import Transport, open_transport
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import PATIENCE, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no ptys")


CUT = '[[fault]]\nkind = "cut"\nfrom = 1\nuntil = 3\n'


def settings(folder: Path, text: str, robots: int = 1) -> SimulationSettings:
    path = folder / "faults.toml"
    path.write_text(f'description = "of a test"\n{text}')
    return SimulationSettings(world="square", robots=robots, fault=str(path))


class Stage:
    """Robots that are served in a world whose time only the test moves on."""

    def __init__(self, seen: Seen) -> None:
        self.seen = seen

    def take(self, control: Control) -> None:
        """Stop the time of the world."""
        self.control = control
        control.pause()

    def go_on(self, seconds: float) -> None:
        """Let so much time of the world pass."""
        self.control.simulation.step(seconds)

    async def write(self, transport: Transport, line: bytes) -> None:
        """Send *line*, and wait until it has come to the robot's port."""
        self.seen.data.clear()
        await transport.write(line)
        await until(lambda: self.seen.data == line)

    async def ask(self, transport: Transport, line: bytes) -> bytes:
        """Send *line*, and return the answer, which takes a tenth of a second of the world at most."""
        await self.write(transport, line)
        self.go_on(0.1)
        return await receive(transport)


@pytest.fixture
def stage(seen: Seen) -> Stage:
    return Stage(seen)


async def until_lost(transport: Transport) -> None:
    with pytest.raises(LinkLost):
        async with asyncio.timeout(PATIENCE):
            while True:
                await transport.read()
    await transport.close()


def exists(port: Path) -> bool:
    """Return whether there is something of that name, also a link that leads nowhere."""
    return port.is_symlink() or port.exists()


@pytest.mark.parametrize("is_named", [True, False])
async def test_a_pty_that_is_cut_vanishes_and_comes_back_with_the_same_robot(
    is_named: bool, tmp_path: Path, stage: Stage
) -> None:
    link = str(tmp_path / "robot") if is_named else None
    async with serve(settings(tmp_path, CUT), link=link, control=stage.take) as served:
        url = served[0].url
        port = Path(url.removeprefix("serial://"))
        transport = await open_transport(url)
        assert await stage.ask(transport, b"D,5,6\r") == b"d\r\n"
        stage.go_on(1)
        await until_lost(transport)
        assert not exists(port)
        with pytest.raises(LinkNotFound):
            await open_transport(url)
        stage.go_on(2)
        transport = await open_transport(url)
        assert await stage.ask(transport, b"E\r") == b"e,5,6\r\n"
        await transport.close()
    assert not exists(port)
    assert port.parent == tmp_path or not exists(port.parent), "a folder of its own goes with it"


async def test_a_client_on_tcp_is_cut_off_and_turned_away_until_the_cut_is_over(tmp_path: Path, stage: Stage) -> None:
    async with serve(settings(tmp_path, CUT), tcp="0", control=stage.take) as served:
        transport = await open_transport(served[0].url)
        assert await stage.ask(transport, b"D,5,6\r") == b"d\r\n"
        stage.go_on(1)
        await until_lost(transport)
        await until_lost(await open_transport(served[0].url))
        stage.go_on(2)
        transport = await open_transport(served[0].url)
        assert await stage.ask(transport, b"E\r") == b"e,5,6\r\n"
        await transport.close()


async def test_a_cut_takes_the_pty_away_too_while_somebody_is_there_over_tcp(tmp_path: Path, stage: Stage) -> None:
    async with serve(settings(tmp_path, CUT), tcp="0", link=str(tmp_path / "robot"), control=stage.take) as served:
        pty, tcp = served[0].url, served[1].url
        transport = await open_transport(tcp)
        assert await stage.ask(transport, b"E\r") == b"e,0,0\r\n"
        stage.go_on(1)
        await until_lost(transport)
        with pytest.raises(LinkNotFound):
            await open_transport(pty)
        stage.go_on(2)
        transport = await open_transport(pty)
        assert await stage.ask(transport, b"E\r") == b"e,0,0\r\n"
        await transport.close()


async def test_each_robots_script_begins_with_its_own_first_client(tmp_path: Path, stage: Stage) -> None:
    script = '[[fault]]\nkind = "silence"\nfrom = 5\nuntil = 8\n'
    async with serve(settings(tmp_path, script, robots=2), control=stage.take) as served:
        first = await open_transport(served[0].url)
        assert await stage.ask(first, b"E\r") == b"e,0,0\r\n"
        stage.go_on(6)
        await stage.write(first, b"E\r")
        second = await open_transport(served[1].url)
        assert await stage.ask(second, b"E\r") == b"e,0,0\r\n"
        stage.go_on(2)
        assert await stage.ask(first, b"C\r") == b"c,3\r\n", "the question before it was not answered"
        await first.close()
        await second.close()


@pytest.mark.parametrize(("script", "is_own"), [('[[fault]]\nkind = "silence"\nat = 1', True), (CUT, False)])
async def test_only_a_server_without_cuts_offers_its_ptys_under_their_own_names(
    script: str, is_own: bool, tmp_path: Path
) -> None:
    async with serve(settings(tmp_path, script)) as served:
        assert served[0].url.startswith("serial:///dev/") is is_own


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        (None, 2, "cannot be read"),
        ("fault = 1", 1, "storm.toml: description is missing"),
        ('description = "x"\n[[fault]]\nkind = "storm"', 1, "storm.toml:3: fault[0].kind is 'storm'"),
    ],
)
def test_the_command_line_refuses_an_impossible_script(
    text: str | None, code: int, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "storm.toml"
    if text is not None:
        path.write_text(text)
    assert main(["simulate", "--fault", str(path)]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err


def test_the_command_line_suggests_the_nearest_script(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "--fault", "flaky"]) == 2
    assert "flaky-bluetooth" in capsys.readouterr().err
