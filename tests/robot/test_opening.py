"""What a user sees when a robot cannot be opened; nothing is left behind."""

import asyncio
import random
import socket
import threading
from collections.abc import Callable

import pytest

import elib
from elib.base.errors import ArgumentError, ElibError, LinkError, LinkNotFound
from elib.link.protocol.profiles import PROFILES
from elib.link.transport import open_transport
from elib.link.transport.lease import lease
from elib.testing import simulated

WRONG = [
    (5, ArgumentError, "a robot's URL is a str"),
    (b"sim://", ArgumentError, "a robot's URL is a str"),
    ("", ArgumentError, "neither a URL nor"),
    ("foo://x", ArgumentError, "no scheme foo://"),
    ("sim://?sped=max", ArgumentError, "did you mean speed"),
    ("sim://?speed=fast", ArgumentError, "'real', 'max' or a factor"),
    ("sim://?loss=nan", ArgumentError, "loss"),
    ("sim://?firmware=btcom", ArgumentError, "one of btcom-1.1.3"),
    ("sim://nowhere", LinkNotFound, "choose one of"),
    ("tcp://localhost", ArgumentError, "HOST:PORT"),
    ("replay://x.mcap", ArgumentError, "cannot be read"),
    ("/dev/no-such-port", LinkNotFound, "paired"),
]


@pytest.mark.parametrize(("url", "kind", "words"), WRONG)
def test_a_url_that_cannot_be_opened_says_why_and_what_to_do(url: object, kind: type[ElibError], words: str) -> None:
    before = set(threading.enumerate())
    with pytest.raises(kind) as caught:
        elib.connect(url)  # type: ignore[arg-type]
    assert words in str(caught.value)
    assert set(threading.enumerate()) <= before


def test_a_robot_on_wifi_that_does_not_listen_says_why_and_what_to_do() -> None:
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        with pytest.raises(LinkNotFound, match="selector"):
            elib.connect("wifi://{}:{}".format(*closed.getsockname()))


@pytest.mark.parametrize(("url", "kind", "words"), WRONG[:5])
def test_an_impossible_url_is_refused_before_the_loop_runs(url: object, kind: type[ElibError], words: str) -> None:
    with pytest.raises(kind, match=words):
        elib.open(url)  # type: ignore[arg-type]


def test_a_firmware_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ArgumentError, match=r"btcom-1\.1\.3"):
        elib.connect("sim://?speed=max", firmware="btcom")


def test_the_firmware_can_be_set_against_what_the_robot_answers() -> None:
    with elib.connect("sim://?speed=max&firmware=btcom-2.0", firmware="btcom-1.1.3") as robot:
        assert robot.firmware == "btcom-1.1.3"


def test_the_mounting_of_the_camera_can_be_set_for_one_robot() -> None:
    with elib.connect("sim://?speed=max&firmware=epuck2", mounting=elib.Mounting.QUARTER_LEFT) as robot:
        robot.set_camera(30, 20, 4)
        assert robot.camera()[:3] == (1, 30, 20)
        assert robot.image().pixels.shape == (20, 30, 3)


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_a_robot_that_calibrates_is_recognised_when_it_has_done(firmware: str) -> None:
    @simulated
    async def story(earlier: float) -> None:
        url = f"sim://square?speed=max&firmware={firmware}"
        with lease(url):
            before = await open_transport(url)
            await before.write(b"K\r")
            await asyncio.sleep(earlier)
            await before.close()
            async with elib.open(url) as robot:
                assert robot.firmware == firmware
                assert (await robot.selector()).position == 3

    draw = random.Random(firmware)
    for earlier in [0.01, *(draw.uniform(0.01, 3.7) for _ in range(12))]:
        story(earlier)


@pytest.mark.parametrize(
    "open_", [elib.open, elib.connect, elib.reconnecting, elib.swarm], ids=lambda each: each.__name__
)
@pytest.mark.parametrize("mounting", ["x", "upright", 1, object()])
def test_an_unknown_mounting_is_refused_before_anything_opens(open_: Callable[..., object], mounting: object) -> None:
    with pytest.raises(ArgumentError, match=r"mounting is .*; it must be an elib\.Mounting") as caught:
        open_("sim://square?speed=max", mounting=mounting)
    assert "elib.Mounting.UPRIGHT" in caught.value.hint


def test_opening_errors_are_link_errors_and_connection_errors() -> None:
    with pytest.raises(ConnectionError):
        elib.connect("/dev/no-such-port")
    assert issubclass(elib.RobotSilent, LinkError)
