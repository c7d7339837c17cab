"""Robots whose sensors, wheels, cameras and clocks are broken: what programs get of it, and what they do not."""

from itertools import pairwise
from pathlib import Path

import pytest

import elib
from elib.base.errors import SimulationError
from elib.link.protocol.profiles import profile_named
from elib.simulator.emulator.faultscript import parse
from elib.simulator.emulator.firmware import FIRMWARES
from elib.simulator.emulator.sim_transport import SimTransport
from elib.simulator.physics.defects import SENSORS
from elib.testing import faults_of, simulated, world_of
from shared import with_fault

READ = (*SENSORS, "image")
WORDS = {
    "proximity": 1500.0,
    "accelerometer": 3.0,
    "gyroscope": 2.0,
    "magnetometer": 60.0,
    "distance": 0.5,
    "image": 200.0,
}
"""What a sensor is stuck at where 300 counts are too many, in its unit."""


def fault(sensor: str) -> str:
    stuck = f"from = 3\nstuck = {WORDS.get(sensor, 300)}\n"
    if sensor == "image":
        return f'kind = "camera"\n{stuck}'
    return f'kind = "sensor"\nsensor = "{sensor}"\nnumbers = [0]\n{stuck}'


@simulated
async def bytes_of(firmware: str, folder: Path, broken: str = "") -> dict[str, bytes]:
    """Return the bytes that answer the question for each sensor, up to the one that is broken."""
    url = f"sim://line?speed=max&seed=3&firmware={firmware}"
    found: dict[str, bytes] = {}
    async with elib.open(with_fault(folder, fault(broken), url) if broken else url) as robot:
        transport = robot.session.transport
        assert isinstance(transport, SimTransport)
        sent = bytearray()
        transport.robot.link.trace = lambda time, way, data: sent.extend(data if way == "to host" else b"")
        await robot.set_camera(8, 8, mode=elib.CameraMode.GREY)
        await robot.sleep(4)
        for sensor in READ:
            if sensor not in profile_named(firmware).absent:
                sent.clear()
                await getattr(robot, sensor)()
                found[sensor] = bytes(sent)
            if sensor == broken:
                break
    return found


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_the_bytes_of_every_firmware_show_each_broken_sensor_and_nothing_else(firmware: str, tmp_path: Path) -> None:
    whole = bytes_of(firmware, tmp_path)
    if firmware.startswith("btcom"):
        del whole["ground"]  # no published BTcom reads it
    assert {"proximity", "ambient_light", "microphones", "accelerometer", "image"} <= set(whole)
    for sensor in whole:
        seen = bytes_of(firmware, tmp_path, sensor)
        assert seen.pop(sensor) != whole[sensor], sensor
        # The frame of an e-puck2 that has all sensors in it shows the one number, of 2 to 4 bytes.
        for other in seen.keys() & whole.keys():
            pairs = zip(seen[other], whole[other], strict=True)
            assert sum(a != b for a, b in pairs) <= 4 * (len(whole[other]) > 60), (sensor, other)


@pytest.mark.parametrize("firmware", FIRMWARES)
@simulated
async def test_a_loose_wheel_turns_the_robot_while_its_steps_count_on(firmware: str, tmp_path: Path) -> None:
    loose = 'kind = "wheel"\nwheel = "left"\nfactor = 0\n'
    async with elib.open(with_fault(tmp_path, loose, f"sim://square?speed=max&firmware={firmware}")) as robot:
        before = world_of(robot).pose(0).heading
        await robot.set_speed(0.5, 0.5)
        await robot.sleep(1.0)
        await robot.stop()
        steps = await robot.encoders()
        assert steps.left == pytest.approx(steps.right, abs=1) != 0
        assert world_of(robot).pose(0).heading - before > 1.0


@pytest.mark.parametrize("firmware", FIRMWARES)
@simulated
async def test_a_slow_clock_slows_both_motors_and_their_steps(firmware: str, tmp_path: Path) -> None:
    slow = 'kind = "clock"\nfactor = 0.5\nfrom = 2\nfor = 4\n'
    url = f"sim://square?speed=max&firmware={firmware}"
    async with elib.open(with_fault(tmp_path, slow, url)) as robot:
        await robot.set_speed(0.2, 0.2)
        counted = []
        for second in range(1, 9):
            await robot.sleep(second - faults_of(robot).time)
            counted.append((await robot.encoders()).left)
        made = [after - before for before, after in pairwise(counted)]
        assert made == pytest.approx([200, 100, 100, 100, 100, 200, 200], abs=12)


@simulated
async def test_one_robot_of_a_swarm_is_broken_by_name_or_number_and_the_others_are_as_without_it(
    tmp_path: Path,
) -> None:
    url = "sim://arena?robots=3&speed=max&seed=1"
    stuck = 'kind = "sensor"\nsensor = "proximity"\nstuck = 300\nrobots = [{}]\nfrom = 0.5\nuntil = 3\n'

    async def heard(url: str, at: float) -> list[tuple[int, ...]]:
        async with elib.swarm(url) as robots:
            await robots[0].sleep(at)
            return [tuple(await robot.proximity()) for robot in robots]

    for who in ('"epuck-2"', "2"):
        script = with_fault(tmp_path, stuck.format(who), url)
        whole, seen = await heard(url, 1.0), await heard(script, 1.0)
        assert seen[1] == (300,) * 8
        assert (seen[0], seen[2]) == (whole[0], whole[2])
        assert await heard(script, 5.0) == await heard(url, 5.0)


@pytest.mark.parametrize(
    ("keys", "message", "cure"),
    [
        ('sensor = "prox"', "test.toml:4: fault[0].sensor is 'prox'; it must be \"proximity\" or", "mean proximity?"),
        ("stuck = 3", "fault[0].sensor is missing", 'sensor = "proximity"'),
        ('sensor = "ground"', "test.toml:2: fault[0]: nothing is wrong", "write stuck or shift or noise or factor"),
        (
            'sensor = "ground"\nstuck = 1\nnumbers = [5]',
            "test.toml:6: fault[0].numbers has 5; those of ground are 0 to 4",
            "",
        ),
        ('sensor = "ground"\nstuk = 1', "test.toml:5: fault[0].stuk is not a key", "did you mean stuck?"),
        (
            'sensor = "ground"\nstuck = 1\nrobots = ["e2"]',
            "test.toml:6: fault[0].robots is ['e2']; it must be",
            '["epuck-2"]',
        ),
        (
            'sensor = "ground"\nstuck = 1\nrobots = [4]',
            "test.toml:6: fault[0].robots names robot 4; the world has 3",
            "",
        ),
        ('sensor = "ground"\nshift = [0, 9]', "shift goes from 0 to 9; it must be one number", "write shift = 0"),
    ],
)
def test_a_mistake_about_what_is_broken_is_named_with_its_line_and_what_there_is(
    keys: str, message: str, cure: str
) -> None:
    with pytest.raises(SimulationError) as caught:
        parse(
            f'description = "x"\n[[fault]]\nkind = "sensor"\n{keys}\n\n[[fault]]\nkind = "cut"\n'.encode(),
            "test.toml",
            3,
        )
    assert message in caught.value.message
    assert cure in caught.value.hint


@simulated
async def heard_over_wifi(url: str) -> dict[str, object]:
    async with elib.open(url) as robot:
        await robot.sleep(4)
        reading = await robot.sensors()
        image = await robot.image()
        return {sensor: getattr(reading, sensor) for sensor in SENSORS} | {"image": image.raw}


def test_over_wifi_each_broken_sensor_is_in_the_packets_and_the_others_are_as_they_were(tmp_path: Path) -> None:
    url = "sim://line?speed=max&seed=3&firmware=epuck2-wifi"
    whole = heard_over_wifi(url)
    for sensor in READ:
        seen = heard_over_wifi(with_fault(tmp_path, fault(sensor), url))
        assert {other for other in READ if seen[other] != whole[other]} == {sensor}
