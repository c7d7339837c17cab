"""Fault scripts on robots that are served: ports that vanish and come back under their name."""

import asyncio
import sys
from collections.abc import Callable, Coroutine
from pathlib import Path

import pytest
from fault_rig import ask

from elib.cli import main
from elib.emulator.server import serve
from elib.emulator.settings import SimulationSettings
from elib.errors import LinkError, LinkLost, LinkNotFound
from elib.timebase import ScaledLoop
from elib.transport import Transport, open_transport

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no ptys")


def settings(folder: Path, text: str, robots: int = 1) -> SimulationSettings:
    path = folder / "faults.toml"
    path.write_text(f'description = "of a test"\n{text}')
    return SimulationSettings(world="square", robots=robots, speed=10.0, fault=str(path))


def ten_times_as_fast(story: Callable[[], Coroutine[object, object, None]]) -> None:
    with asyncio.Runner(loop_factory=lambda: ScaledLoop(10)) as runner:
        runner.run(story())


async def until_lost(transport: Transport) -> None:
    with pytest.raises(LinkLost):
        async with asyncio.timeout(10):
            while True:
                await transport.read()
    await transport.close()


async def open_when_back(url: str) -> tuple[Transport, list[type[LinkError]]]:
    """Open *url* as soon as its robot answers; return also what failed before."""
    failures: list[type[LinkError]] = []
    async with asyncio.timeout(20):
        while True:
            try:
                transport = await open_transport(url)
                await ask(transport, b"C\r")
            except LinkError as error:
                failures.append(type(error))
                await asyncio.sleep(0.2)
            else:
                return transport, failures


def exists(port: Path) -> bool:
    """Return whether there is something of that name, also a link that leads nowhere."""
    return port.is_symlink() or port.exists()


CUT = '[[fault]]\nkind = "cut"\nfrom = 1\nuntil = 3\n'


@pytest.mark.parametrize("is_named", [True, False])
def test_a_pty_that_is_cut_vanishes_and_comes_back_with_the_same_robot(is_named: bool, tmp_path: Path) -> None:
    async def story() -> None:
        link = str(tmp_path / "robot") if is_named else None
        async with serve(settings(tmp_path, CUT), link=link) as served:
            url = served[0].url
            port = Path(url.removeprefix("serial://"))
            transport = await open_transport(url)
            assert await ask(transport, b"D,5,6\r") == b"d\r\n"
            await until_lost(transport)
            assert not exists(port)
            transport, failures = await open_when_back(url)
            assert set(failures) == {LinkNotFound}
            assert await ask(transport, b"E\r") == b"e,5,6\r\n"
            await transport.close()
        assert not exists(port)
        assert port.parent == tmp_path or not exists(port.parent), "a folder of its own goes with it"

    ten_times_as_fast(story)


def test_a_client_on_tcp_is_cut_off_and_turned_away_until_the_cut_is_over(tmp_path: Path) -> None:
    async def story() -> None:
        async with serve(settings(tmp_path, CUT), tcp="0") as served:
            transport = await open_transport(served[0].url)
            assert await ask(transport, b"D,5,6\r") == b"d\r\n"
            await until_lost(transport)
            transport, failures = await open_when_back(served[0].url)
            assert set(failures) == {LinkLost}
            assert await ask(transport, b"E\r") == b"e,5,6\r\n"
            await transport.close()

    ten_times_as_fast(story)


def test_a_cut_takes_the_pty_away_too_while_somebody_is_there_over_tcp(tmp_path: Path) -> None:
    async def story() -> None:
        async with serve(settings(tmp_path, CUT), tcp="0", link=str(tmp_path / "robot")) as served:
            pty, tcp = served[0].url, served[1].url
            transport = await open_transport(tcp)
            assert await ask(transport, b"E\r") == b"e,0,0\r\n"
            await until_lost(transport)
            with pytest.raises(LinkNotFound):
                await open_transport(pty)
            transport, _ = await open_when_back(pty)
            await transport.close()

    ten_times_as_fast(story)


def test_each_robots_script_begins_with_its_own_first_client(tmp_path: Path) -> None:
    async def story() -> None:
        # Half a second of the wall clock for the first question, and seconds for the rest: enough on a busy machine.
        script = '[[fault]]\nkind = "silence"\nfrom = 5\nuntil = 60\n'
        async with serve(settings(tmp_path, script, robots=2)) as served:
            first = await open_transport(served[0].url)
            assert await ask(first, b"E\r") == b"e,0,0\r\n"
            await asyncio.sleep(6)
            await first.write(b"E\r")
            second = await open_transport(served[1].url)
            assert await ask(second, b"E\r") == b"e,0,0\r\n"
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.5):
                    await first.read()
            await first.close()
            await second.close()

    ten_times_as_fast(story)


def test_a_server_without_cuts_offers_its_ptys_under_their_own_names(tmp_path: Path) -> None:
    async def story() -> None:
        async with serve(settings(tmp_path, '[[fault]]\nkind = "silence"\nat = 1')) as served:
            assert served[0].url.startswith("serial:///dev/")

    ten_times_as_fast(story)


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
