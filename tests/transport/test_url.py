import asyncio
import socket
import sys
from types import SimpleNamespace

import pytest

from elib.base.errors import ArgumentError, Unsupported
from elib.link.transport import Scheme, Url, open_transport, parse_url, speed_of
from elib.link.transport import url as urls
from elib.link.transport.rfcomm import bluetooth_address
from elib.link.transport.tcp import host_and_port
from elib.simulator.emulator.settings import SimulationSettings, settings_of


@pytest.mark.parametrize(
    ("text", "scheme", "target"),
    [
        ("sim://", "sim", ""),
        ("SIM://square", "sim", "square"),
        ("serial:///dev/rfcomm0", "serial", "/dev/rfcomm0"),
        ("serial://COM3", "serial", "COM3"),
        ("serial://rfcomm0", "serial", "/dev/rfcomm0"),
        ("/dev/ttyUSB0", "serial", "/dev/ttyUSB0"),
        ("./epuck", "serial", "./epuck"),
        ("com3", "serial", "COM3"),
        ("rfcomm0", "serial", "/dev/rfcomm0"),
        ("ttyACM1", "serial", "/dev/ttyACM1"),
        (" tcp://localhost:4000 ", "tcp", "localhost:4000"),
        ("replay://a%20run.log", "replay", "a run.log"),
        ("wifi://192.168.1.5", "wifi", "192.168.1.5"),
        ("wifi://192.168.1.5:1000/", "wifi", "192.168.1.5"),
        ("wifi://robot.local:1001", "wifi", "robot.local:1001"),
        ("wifi://[fe80::1]", "wifi", "[fe80::1]"),
    ],
)
def test_a_url_or_a_bare_port_name_is_taken_apart(text: str, scheme: str, target: str) -> None:
    url = parse_url(text)
    assert (url.scheme, url.target) == (scheme, target)


@pytest.mark.parametrize(
    "text",
    ["sim://", "sim://arena?seed=3&speed=max", "serial:///dev/a b?c", "tcp://[::1]:400", "replay://ä?speed=2"],
)
def test_a_url_written_out_says_the_same_again(text: str) -> None:
    url = Url("serial", "/dev/a b?c") if "a b" in text else parse_url(text)
    assert parse_url(str(url)) == url


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("siml://", "no scheme siml://", "did you mean sim://?"),
        ("xyz://", "no scheme xyz://", "URLs look like sim://"),
        ("sim://?sed=3", "no key 'sed'", "did you mean seed?"),
        ("sim://?colour=red", "no key 'colour'", "choose one of firmware, seed"),
        ("tcp://h:1?seed=1", "no key 'seed'", "there are none"),
        ("sim://?seed", "seed has no value", "write seed=VALUE"),
        ("sim://?seed=1&seed=2", "seed is given twice", ""),
        ("sim://?latency=nan", "latency is nan s; it must be a number from 0 to 60 s", ""),
        ("sim://?latency=-0.1", "latency is -0.1 s; it must be a number from 0", ""),
        ("sim://?jitter=soon", "jitter is 'soon'; it must be a number", ""),
        ("sim://?loss=1.1", "loss is 1.1; it must be a number from 0 to 1", ""),
        ("sim://?robots=0", "robots is 0; it must be a whole number from 1", ""),
        ("sim://?robots=two", "robots is 'two'; it must be a whole number", ""),
        ("sim://?baud=1.5", "baud is 1.5 bit/s; it must be a whole number", ""),
        ("sim://?seed=-1", "seed is -1", ""),
        ("sim://?speed=fast", "speed is 'fast'; it must be 'real', 'max' or a factor", "speed=max"),
        ("sim://?speed=0", "speed is '0'", "speed=max"),
        ("sim://?speed=inf", "speed is 'inf'", "speed=max"),
        ("replay://a.log?speed=x", "speed is 'x'", "speed=max"),
        ("replay://", "names no file", ""),
        ("wifi://", "names no host", "wifi://192.168.1.5"),
        ("wifi://robot:70000", "port is 70000; it must be a whole number from 1 to 65535", ""),
        ("wifi://a b", "is not HOST:PORT", ""),
        ("serial://", "names no port", "serial:///dev/rfcomm0"),
        ("serial://dev/ttyS0", "two slashes where three belong", "serial:///dev/ttyS0"),
        ("tcp://robot", "'robot' is not HOST:PORT", "tcp://192.168.1.5:4000"),
        ("tcp://robot:70000", "port is 70000; it must be a whole number from 1 to 65535", ""),
        ("rfcomm://10:00:E8", "'10:00:E8' is not a Bluetooth address", "six pairs"),
        ("rfcomm://10:00:E8:AA:BB:CC?channel=31", "channel is '31'; it must be from 1 to 30", "leave it out"),
        ("10:00:E8:AA:BB:CC", "neither a URL nor", "write rfcomm://10:00:E8:AA:BB:CC"),
        ("127.0.0.1:4000", "neither a URL nor", "write tcp://127.0.0.1:4000"),
        ("tcp:h:1", "neither a URL nor", "write tcp://h:1"),
        ("sim", "neither a URL nor", "write sim://"),
        ("sim//square", "neither a URL nor", "write sim://square"),
        ("tcp//127.0.0.1:4000", "neither a URL nor", "write tcp://127.0.0.1:4000"),
        ("sim://square&speed=max&seed=2", "keys stand behind a ?", "did you mean sim://square?speed=max&seed=2?"),
        ("serial:/dev/ttyS0", "neither a URL nor", "write serial:///dev/ttyS0"),
        ("", "neither a URL nor", "URLs look like"),
    ],
)
def test_a_wrong_url_says_what_is_wrong_and_what_to_write(text: str, message: str, hint: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        parse_url(text)
    assert message in caught.value.message
    assert hint in caught.value.hint


def test_keys_become_settings_of_their_type() -> None:
    url = parse_url("sim://crowd?robots=20&seed=7&firmware=epuck2&latency=0.01&jitter=0.002&baud=0&loss=0.1&speed=4")
    assert settings_of(url) == SimulationSettings(
        world="crowd",
        robots=20,
        seed=7,
        firmware="epuck2",
        latency=0.01,
        jitter=0.002,
        baud=0,
        loss=0.1,
        speed=4.0,
    )
    assert settings_of(parse_url("sim://")) == SimulationSettings(world="arena")


def test_a_channel_of_many_digits_is_refused_as_any_other() -> None:
    with pytest.raises(ArgumentError, match="it must be from 1 to 30"):
        parse_url(f"rfcomm://10:00:E8:AA:BB:CC?channel={'9' * 5000}")  # more than Python reads as a number


def test_a_file_whose_name_is_not_utf_8_stays_the_same_in_a_url() -> None:
    url = parse_url("sim://w\udcff.toml?fault=f\udcff.toml")
    assert (url.target, url.keys["fault"]) == ("w\udcff.toml", "f\udcff.toml")
    assert str(url) == "sim://w%FF.toml?fault=f%FF.toml"
    assert parse_url(str(url)) == url


def test_keys_are_read_only_text() -> None:
    url = parse_url("sim://?seed=3&hardware=my%20file.json")
    assert dict(url.keys) == {"seed": "3", "hardware": "my file.json"}
    with pytest.raises(TypeError):
        url.keys["seed"] = "4"  # type: ignore[index]  # that is the point


@pytest.mark.parametrize(
    ("url", "speed"),
    [("sim://", "real"), ("sim://?speed=max", "max"), ("sim://?speed=0.5", 0.5), ("/dev/rfcomm0", "real")],
)
def test_the_speed_of_a_url_tells_which_loop_to_make(url: str, speed: object) -> None:
    assert speed_of(url) == speed
    assert speed_of(parse_url(url)) == speed


def test_addresses_are_taken_apart_for_the_transports() -> None:
    assert host_and_port(parse_url("tcp://[::1]:400")) == ("::1", 400)
    assert bluetooth_address(parse_url("rfcomm://10:00:e8:aa:bb:cc")) == ("10:00:E8:AA:BB:CC", None)
    assert bluetooth_address(parse_url("rfcomm://10:00:e8:aa:bb:cc?channel=2")) == ("10:00:E8:AA:BB:CC", 2)


async def test_a_scheme_of_another_package_is_opened_by_its_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Url] = []

    async def open_ble(url: Url) -> str:
        opened.append(url)
        return "a transport"

    monkeypatch.setattr(urls, "scheme_named", {"ble": Scheme(open_ble, keys=("power",))}.get)
    assert await open_transport("ble://robot?power=low") == "a transport"
    assert opened == [Url("ble", "robot", (("power", "low"),))]


def test_an_entry_point_that_is_not_a_scheme_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    class Entry:
        value = "ble.link:open_ble"

        def load(self) -> object:
            return open_transport

    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: [Entry()])
    urls.scheme_named.cache_clear()
    with pytest.raises(Unsupported, match=r"ble\.link:open_ble of ble:// is not an elib\.link\.transport\.Scheme"):
        parse_url("ble://robot")
    urls.scheme_named.cache_clear()


def test_an_entry_point_that_cannot_be_loaded_is_named_with_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    class Entry:
        value = "ble.link:SCHEME"
        dist = SimpleNamespace(name="epuck-ble")

        def load(self) -> object:
            raise ModuleNotFoundError("No module named 'bluepy'")

    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: [Entry()])
    urls.scheme_named.cache_clear()
    message = r"ble\.link:SCHEME of ble:// cannot be loaded: ModuleNotFoundError: No module(.|\n)*uninstall epuck-ble"
    with pytest.raises(Unsupported, match=message):
        parse_url("ble://robot")
    urls.scheme_named.cache_clear()


async def test_only_the_module_of_the_scheme_is_imported() -> None:
    script = (
        "import asyncio, sys, elib.link.transport as t, elib.base.errors as e\n"
        "try: asyncio.run(t.open_transport(sys.argv[1]))\n"
        "except e.LinkError: pass\n"
        "its = {'serialx', 'elib.simulator.emulator.sim_transport', 'elib.link.transport.tcp'}\n"
        "print(sorted(its & sys.modules.keys()))"
    )
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        url = "tcp://{}:{}".format(*closed.getsockname())
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-c", script, url, stdout=asyncio.subprocess.PIPE
        )
        output, _ = await process.communicate()
    assert output.decode().strip() == "['elib.link.transport.tcp']"
