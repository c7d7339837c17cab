"""A robot on the serial port of the page: an emulator behind bytes, on the event loop of the page."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_studio_program import Rig

import elib
from elib.link.transport import parse_url
from elib.link.transport.memory import memory_pair
from elib.simulator.emulator.settings import settings_of
from elib.simulator.emulator.simulation import Simulation
from elib.studio import webserial

FIRMWARES = ("btcom-1.1.3", "btcom-2.0", "asercom-1.2.2", "epuck2")
DRIVE = """import elib
with elib.connect("webserial://") as robot:
    print(robot.firmware, robot.proximity().time > 0)
    robot.set_speed(0.4, 0.4)
    robot.sleep(0.1)
"""


class Plugged(Rig):
    """A worker whose page has a port with a robot behind it.

    Attributes:
        robots: The simulation of the robot.
    """

    def plug(self, url: str) -> None:
        """Choose the port of a robot."""
        self._web.run_until_complete(self._plugged(url))

    async def _plugged(self, url: str) -> None:
        settings = settings_of(parse_url(url))
        self.robots = Simulation(settings, is_connected=False)
        line, end = memory_pair()
        self.robots.take(0, settings, url).link.attach(end)
        port = self.worker.port
        line.listen(port.received)
        port.send = line.send_nowait
        port.opened()

    @property
    def speeds(self) -> tuple[float, float]:
        """Speeds of the robot's wheels, m/s."""
        assert self.robots.world is not None
        return self.robots.world.wheel_speeds(0)


@pytest.fixture
def rig(tmp_path: Path):
    made = Plugged(tmp_path)
    yield made
    webserial.port = None
    made.close()


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_program_drives_the_robot_on_the_port_and_leaves_it_standing(rig: Plugged, firmware: str) -> None:
    rig.plug(f"sim://arena?firmware={firmware}")
    seen: list[tuple[float, float]] = []
    rig.plan = [(lambda: rig.speeds != (0.0, 0.0), lambda: seen.append(rig.speeds))]
    rig.run(DRIVE, speed=1.0)
    assert rig.output == f"{firmware} True\n"
    assert seen[0][0] > 0
    assert [each[-2:] for each in rig.guards] == [b"S\r", b""]
    assert rig.speeds == (0.0, 0.0)


def test_without_a_port_it_is_said_what_to_click(rig: Plugged) -> None:
    rig.run(DRIVE, speed=1.0)
    mistake = rig.news[-1]["mistake"]
    assert mistake["kind"] == "LinkNotFound"
    assert "click Robot" in mistake["hint"]


def test_a_port_that_is_unplugged_in_a_run_ends_the_call(rig: Plugged) -> None:
    rig.plug("sim://arena")
    rig.plan = [(lambda: rig.speeds != (0.0, 0.0), lambda: rig.worker.port.lost("the port was unplugged"))]
    rig.run(DRIVE.replace("sleep(0.1)", "proximity()\n    robot.sleep(1)\n    robot.proximity()"), speed=1.0)
    assert rig.news[-1]["mistake"]["kind"] == "LinkLost"
    assert "unplugged" in rig.output


def test_a_program_that_is_stopped_stops_the_robot_on_the_port(rig: Plugged) -> None:
    rig.plug("sim://arena")
    rig.plan = [(lambda: rig.speeds != (0.0, 0.0), lambda: rig.say("stop_program"))]
    rig.run(DRIVE.replace("sleep(0.1)", "sleep(1000)"), speed=1.0)
    assert rig.speeds == (0.0, 0.0)


async def test_on_a_computer_it_is_said_where_the_port_would_be() -> None:

    with pytest.raises(elib.Unsupported, match="the studio's page"):
        await webserial.open_port(parse_url("webserial://"))
